"""At which estimate a filter linearises, and which landmark it takes, is told by name."""

import pytest
from checks.test_checks import failure

LAB1, LAB3, LAB4 = "cartesian-kf", "range-bearing-kf", "legged-ekf"
MOVE = "self.xk_k = self.xk_k + self.dt * u"
P3, P4 = "self.Pk_k = self.Pk_k - K @ S @ K.T", "        I_KH ="
J, STACK = "np.vstack([jacobian(self.xk_k, k) for k in known])", "stack(y, self.map, self.xk_k, self.noise)"
BEFORE = [
    (MOVE, f"self.old = self.xk_k\n        {MOVE}"),
    ("p = len(y)", "p, old = len(y), getattr(self, 'old', self.xk_k)"),
]
STEP4 = "self.xk_k, self.Pk_k = predicted("
BEFORE4 = [
    (STEP4, f"self.old = self.xk_k\n        {STEP4}"),
    (STACK, STACK.replace("self.xk_k", "getattr(self, 'old', self.xk_k)")),
]
AGAIN = """class KF(KF):
    def update(self, y):
        if not y:
            return
        known, x = [self.map[self.map.index(lm)] for lm in y], self.xk_k
        for _ in range(3):
            H = np.vstack([jacobian(x, k) for k in known])
            nu = np.concatenate([lm.p - h(x, k) for lm, k in zip(y, known)])
            nu[1::2] = wrap(nu[1::2])
            S = H @ self.Pk_k @ H.T + np.kron(np.eye(len(y)), self.R)
            K = self.Pk_k @ H.T @ np.linalg.inv(S)
            x = self.xk_k + K @ (nu - H @ (self.xk_k - x))
        self.xk_k = x
        self.Pk_k = self.Pk_k - K @ S @ K.T
"""
XY = "x + lm.p[0] * np.array([np.cos(lm.p[1]), np.sin(lm.p[1])])"
POSE = "x[:2] + lm.p[0] * np.array([np.cos(x[2] + lm.p[1]), np.sin(x[2] + lm.p[1])])"
NEAREST = "min({}, key=lambda k: np.hypot(*({} - k.p)))"
FIND = "[self.map[self.map.index(lm)] for lm in y]"

TOLD = [
    (
        LAB3,
        [*BEFORE, ("lm.p - h(self.xk_k", "lm.p - h(old"), (J, J.replace("self.xk_k", "old"))],
        "and H are those of the",
    ),
    (LAB3, [*BEFORE, ("lm.p - h(self.xk_k", "lm.p - h(old")], "what is expected is that of the estimate before it"),
    (LAB3, [*BEFORE, (J, J.replace("self.xk_k", "old"))], "after `predict`, H is that of the estimate before it"),
    (LAB4, BEFORE4, "what is expected and H are those of the estimate before it"),
    (
        LAB3,
        [(P3, f"H = {J}\n        self.Pk_k = self.Pk_k - K @ H @ self.Pk_k")],
        "Pk_k depends on where xk_k moves to",
    ),
    (LAB4, [(P4, f"        H, R = {STACK}[1:]\n{P4}")], "Pk_k depends on where xk_k moves to"),
    (LAB3, AGAIN, "h and H are linearised again at the corrected estimate"),
    (LAB1, [("m[m.index(lm)] - x", NEAREST.format("m", "x + lm.p") + " - x")], "is taken for landmark 3"),
    (LAB3, [(FIND, f"[{NEAREST.format('self.map', XY.replace('x +', 'self.xk_k +'))} for lm in y]")], "is taken for"),
    (LAB4, [("m[m.index(lm)]", NEAREST.format("m", POSE))], "is taken for landmark 'yellow-pink'"),
]


@pytest.mark.parametrize("name, form, says", TOLD)
def test_the_place_is_told(name, form, says):
    text = " ".join(str(failure(name, form)).split())
    assert says in text and "e-1" not in text
