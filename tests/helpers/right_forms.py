"""Right filters of lab 3 that differ from the solution: code behind it, with a place for what a test chooses."""

IN_ORDER = """class KF(KF):
    def update(self, y):
        for lm in {}:
            k = self.map[self.map.index(lm)]
            H = jacobian(self.xk_k, k)
            S = H @ self.Pk_k @ H.T + self.R
            K = self.Pk_k @ H.T @ np.linalg.inv(S)
            nu = lm.p - h(self.xk_k, k)
            nu[1] = wrap(nu[1])
            self.xk_k = self.xk_k + K @ nu
            self.Pk_k = (np.eye(2) - K @ H) @ self.Pk_k
"""
GATED = """class KF(KF):
    def update(self, y):
        fit = []
        for lm in y:
            k = self.map[self.map.index(lm)]
            H = jacobian(self.xk_k, k)
            S = H @ self.Pk_k @ H.T + self.R
            nu = lm.p - h(self.xk_k, k)
            nu[1] = wrap(nu[1])
            if not ({}):
                fit.append(lm)
        super().update(fit)
"""
GATED_XY = """class KF(KF):
    def update(self, y):
        fit = []
        for lm in y:
            nu, S = lm.p - (self.map[self.map.index(lm)].p - self.xk_k), self.Pk_k + self.R
            if not ({}):
                fit.append(lm)
        super().update(fit)
"""
