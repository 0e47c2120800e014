"""For large groups: a small filter for each observer, instead of one large one for all."""

import numpy as np

from ..geometry import wrap


class PairFilters:
    """The pose of one target in the frames of n observers, each by an extended Kalman filter of its own.

    poses (n, 3): the target as each observer believes to see it, [m, m, rad] in the observer's own frame; P (n, 3, 3).
    noise: a TeamNoise.  All observers are computed at once; n can be thousands.
    What is lost against a joint filter: readings of one observer tell the others nothing. What is gained: a cost that
    grows with n and not with its cube, and no correlation that could be forgotten.
    """

    def __init__(self, poses, P, noise, gate=13.8, inflate=4.0):
        self.x, self.P = np.array(poses, dtype=float), np.array(P, dtype=float)
        n = len(self.x)
        if self.x.shape != (n, 3) or self.P.shape != (n, 3, 3):
            raise ValueError(
                f"poses must be (n, 3) and P (n, 3, 3), but they are {self.x.shape} and {self.P.shape}"
            )
        self.noise, self.gate, self.inflate = noise, gate, inflate

    def predict(self, target, observers):
        """Move by the odometry of the target (3,) and of the observers (n, 3) [m, m, rad]."""
        u, v = (
            np.broadcast_to(np.asarray(target, dtype=float), self.x.shape),
            np.asarray(observers, dtype=float),
        )
        heading = self.x[:, 2]
        c, s = np.cos(heading), np.sin(heading)
        px = self.x[:, 0] + c * u[:, 0] - s * u[:, 1] - v[:, 0]
        py = self.x[:, 1] + s * u[:, 0] + c * u[:, 1] - v[:, 1]
        # The observer's own step takes its frame along: what it saw is now seen from the new place, turned back.
        cv, sv = np.cos(v[:, 2]), np.sin(v[:, 2])
        x, y = cv * px + sv * py, cv * py - sv * px
        theta = wrap(self.x[:, 2] + u[:, 2] - v[:, 2])
        n = len(x)
        F = np.zeros((n, 3, 3))
        F[:, 0, 0], F[:, 0, 1], F[:, 1, 0], F[:, 1, 1], F[:, 2, 2] = cv, sv, -sv, cv, 1
        dx, dy = -s * u[:, 0] - c * u[:, 1], c * u[:, 0] - s * u[:, 1]
        F[:, 0, 2], F[:, 1, 2] = cv * dx + sv * dy, cv * dy - sv * dx
        W = np.zeros((n, 3, 3))  # of the target's odometry
        W[:, 0, 0], W[:, 0, 1], W[:, 1, 0], W[:, 1, 1], W[:, 2, 2] = (
            cv * c + sv * s,
            sv * c - cv * s,
            cv * s - sv * c,
            cv * c + sv * s,
            1,
        )
        V = np.zeros((n, 3, 3))  # of the observer's
        V[:, 0, 0], V[:, 0, 1], V[:, 1, 0], V[:, 1, 1], V[:, 2, 2] = -cv, -sv, sv, -cv, -1
        V[:, 0, 2], V[:, 1, 2] = y, -x
        q, r = self.inflate * self.noise.of_step(u) ** 2, self.inflate * self.noise.of_step(v) ** 2
        turn = np.swapaxes
        self.P = F @ self.P @ turn(F, 1, 2) + W * q[:, None] @ turn(W, 1, 2) + V * r[:, None] @ turn(V, 1, 2)
        self.x = np.stack([x, y, theta], axis=-1)

    def update(self, who, z):
        """Correct observers `who` (m,) with what they see of the target, z (m, 2); the m values of d2."""
        who, z = np.asarray(who, dtype=int), np.asarray(z, dtype=float).reshape(-1, 2)
        x, P = self.x[who], self.P[who]
        q = np.maximum(x[:, 0] ** 2 + x[:, 1] ** 2, 1e-6)
        d = np.sqrt(q)
        H = np.zeros((len(who), 2, 3))
        H[:, 0, 0], H[:, 0, 1], H[:, 1, 0], H[:, 1, 1] = x[:, 0] / d, x[:, 1] / d, -x[:, 1] / q, x[:, 0] / q
        nu = np.stack([z[:, 0] - d, wrap(z[:, 1] - np.arctan2(x[:, 1], x[:, 0]))], axis=-1)
        R = np.zeros((len(who), 2, 2))
        R[:, 0, 0], R[:, 1, 1] = self.noise.range**2, self.noise.of_bearing(d) ** 2
        HP = H @ P
        S = HP @ np.swapaxes(H, 1, 2) + R
        a, b, c = S[:, 0, 0], S[:, 0, 1], S[:, 1, 1]
        inverse = np.stack([c, -b, -b, a], axis=-1).reshape(-1, 2, 2) / (a * c - b * b)[:, None, None]
        K = np.swapaxes(inverse @ HP, 1, 2)
        d2 = np.einsum("mi,mij,mj->m", nu, inverse, nu)
        good = d2 < self.gate
        new = x + (K @ nu[..., None])[..., 0]
        new[:, 2] = wrap(new[:, 2])
        self.x[who[good]] = new[good]
        self.P[who[good]] = (P - K @ HP)[good]
        return d2
