# %% id="setup" tags=["setup"]
import numpy as np

from labkit import Landmark, Map, Robot, check, random_map, replay, simulate

# %% id="answer-stack" tags=["answer"]
def stack(y, m, x):
    """Stacked measurement (2p,) and what the map predicts from position x (2p,)."""
    ### BEGIN SOLUTION
    seen = np.concatenate([lm.p for lm in y])
    expected = np.concatenate([m[m.index(lm)] - x for lm in y])
    return seen, expected
    ### END SOLUTION


# %% id="check-stack" tags=["check"]
check("cartesian-stack", stack)

# %% id="answer-repeat" tags=["answer"]
def repeat_R(R, p):
    """The covariance (2p, 2p) of p landmarks that are measured independently, each with R (2, 2)."""
    ### BEGIN SOLUTION
    return np.kron(np.eye(p), R)
    ### END SOLUTION


# %% id="check-repeat" tags=["check"]
check("cartesian-repeat", repeat_R)

# %% id="answer-kf" tags=["answer"]
class KF:
    """Kalman filter for the position of a robot that measures relative Cartesian positions."""

    def __init__(self, x0, P0, Q, R, m, dt=0.25):
        self.xk_k = np.array(x0, dtype=float)  # (2,) estimate of the position [m]
        self.Pk_k = np.array(P0, dtype=float)  # (2, 2) its covariance [m^2]
        self.Q = np.array(Q) * dt  # (2, 2) process noise of one step [m^2]
        self.R = np.array(R) / dt  # (2, 2) noise of one measured landmark [m^2]
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
        seen, expected = stack(y, self.map, self.xk_k)
        innovation = seen - expected
        H = np.tile(-np.eye(2), (p, 1))
        S = H @ self.Pk_k @ H.T + repeat_R(self.R, p)
        K = np.linalg.solve(S, H @ self.Pk_k).T
        self.xk_k = self.xk_k + K @ innovation
        self.Pk_k = self.Pk_k - K @ S @ K.T
        ### END SOLUTION


# %% id="check-kf" tags=["check"]
check("cartesian-kf", KF)
