# %% id="setup" tags=["setup"]
import numpy as np

from labkit import Landmark, Map, Robot, check, random_map, replay, simulate, wrap

# %% id="answer-h" tags=["answer"]
def h(x, landmark):
    """What a robot at x (2,) should measure of a landmark: array (range [m], bearing [rad])."""
    ### BEGIN SOLUTION
    dx, dy = landmark - x
    return np.array([np.hypot(dx, dy), np.arctan2(dy, dx)])
    ### END SOLUTION


# %% id="check-h" tags=["check"]
check("range-bearing-h", h)

# %% id="answer-jacobian" tags=["answer"]
def jacobian(x, landmark):
    """Derivatives (2, 2) of h(x, landmark): row 1 of the range, row 2 of the bearing, columns x and y."""
    ### BEGIN SOLUTION
    dx, dy = landmark - x
    r = np.hypot(dx, dy)
    return np.array([[-dx / r, -dy / r], [dy / r**2, -dx / r**2]])
    ### END SOLUTION


# %% id="check-jacobian" tags=["check"]
check("range-bearing-jacobian", jacobian)

# %% id="answer-kf" tags=["answer"]
class KF:
    """Extended Kalman filter for the position of a robot that measures ranges and bearings."""

    def __init__(self, x0, P0, Q, R, m, dt=0.25):
        self.xk_k = np.array(x0, dtype=float)  # (2,) estimate of the position [m]
        self.Pk_k = np.array(P0, dtype=float)  # (2, 2) its covariance [m^2]
        self.Q = np.array(Q) * dt  # (2, 2) process noise of one step [m^2]
        self.R = np.array(R) / dt  # (2, 2) noise of one landmark: diag([m^2], [rad^2])
        self.map = m  # the Map
        self.dt = dt  # length of a step [s]

    def predict(self, u):
        """Move the estimate by the commanded velocity u (2,) [m/s] for one step."""
        ### BEGIN SOLUTION
        self.xk_k = self.xk_k + self.dt * u
        self.Pk_k = self.Pk_k + self.Q
        ### END SOLUTION

    def update(self, y):
        """Correct the estimate with the landmarks in view: a list of Landmark, maybe empty."""
        ### BEGIN SOLUTION
        if not y:
            return
        p = len(y)
        known = [self.map[self.map.index(lm)] for lm in y]
        innovation = np.concatenate([lm.p - h(self.xk_k, k) for lm, k in zip(y, known)])
        innovation[1::2] = wrap(innovation[1::2])
        H = np.vstack([jacobian(self.xk_k, k) for k in known])
        S = H @ self.Pk_k @ H.T + np.kron(np.eye(p), self.R)
        K = np.linalg.solve(S, H @ self.Pk_k).T
        self.xk_k = self.xk_k + K @ innovation
        self.Pk_k = self.Pk_k - K @ S @ K.T
        ### END SOLUTION


# %% id="check-kf" tags=["check"]
check("range-bearing-kf", KF)
