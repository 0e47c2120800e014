"""A particle filter for a team: guesses of where robot 0 is, and for each of them a small filter per observer."""

import numpy as np

from ..geometry import root, wrap

GATE = 13.8  # as a joint filter's


class TeamParticles:
    """Rao-Blackwellised particle filter: `predict(u)`, `update(seen)`, x (n, 3), P (3n, 3n), and `particles` (m, 3).

    m: how many.  x0 (n, 3), P0 (3n, 3n), noise: as for a joint filter.  rng: a numpy Generator, or a seed for one.
    Robot 0 is sampled. Given where it is, the observers are independent of each other, so each particle has an
    extended Kalman filter for each of them; `observers` (m, n-1, 3) are their means.  Only what the observers see of
    robot 0 is used; readings between observers, and those of robot 0 itself, are left aside.  Source: the paper's figure 8; K. Murphy, S. Russell, "Rao-Blackwellised particle filtering for dynamic
    Bayesian networks" (2001).
    """

    def __init__(self, m, x0, P0, noise, inflate=4.0, rng=None):
        if m != int(m) or m < 10:
            raise ValueError(f"m must be a number of particles, 10 or more, but it is {m!r}")
        self.noise, self.inflate, self.rng = noise, inflate, np.random.default_rng(rng)
        x0, P0 = np.asarray(x0, dtype=float), np.asarray(P0, dtype=float)
        n, self.m = len(x0), int(m)
        self.particles = self.rng.multivariate_normal(x0[0], P0[:3, :3], self.m)
        self.observers = np.tile(x0[1:], (self.m, 1, 1))
        blocks = np.stack([P0[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] for i in range(1, n)])
        self.covariances = np.tile(blocks, (self.m, 1, 1, 1))
        self.w = np.full(self.m, 1 / self.m)

    def predict(self, u):
        u = np.asarray(u, dtype=float)
        sigma = np.sqrt(self.inflate) * self.noise.of_step(u)
        moves = u[0] + sigma[0] * self.rng.standard_normal((self.m, 3))
        self.particles, _ = _moved(self.particles, moves)
        if (u[1:] != 0).any():
            self.observers, F = _moved(self.observers, np.broadcast_to(u[1:], self.observers.shape))
            W = np.zeros_like(F)
            c, s = np.cos(self.observers[..., 2] - u[1:, 2]), np.sin(self.observers[..., 2] - u[1:, 2])
            W[..., 0, 0], W[..., 0, 1], W[..., 1, 0], W[..., 1, 1], W[..., 2, 2] = c, -s, s, c, 1
            Q = W * (sigma[1:] ** 2)[:, None, :] @ np.swapaxes(W, -1, -2)
            self.covariances = F @ self.covariances @ np.swapaxes(F, -1, -2) + Q

    def update(self, seen):
        for i, j, z in seen:
            if j == 0:
                self._weigh(i - 1, z)
        if 1 / (self.w @ self.w) < self.m / 2:
            start = self.rng.random() / self.m
            which = np.searchsorted(np.cumsum(self.w), start + np.arange(self.m) / self.m).clip(max=self.m - 1)
            self.particles, self.observers = self.particles[which], self.observers[which]
            self.covariances, self.w = self.covariances[which], np.full(self.m, 1 / self.m)

    def _weigh(self, i, z):
        """One reading of robot 0 by observer i: correct it in each particle, and weigh the particles."""
        o, P = self.observers[:, i], self.covariances[:, i]
        dx, dy = (self.particles - o)[:, :2].T
        q = np.maximum(dx**2 + dy**2, 1e-6)
        d = np.sqrt(q)
        nu = np.stack([z[0] - d, wrap(z[1] - np.arctan2(dy, dx) + o[:, 2])], axis=-1)
        H = np.zeros((self.m, 2, 3))
        H[:, 0, 0], H[:, 0, 1], H[:, 1, 0], H[:, 1, 1], H[:, 1, 2] = -dx / d, -dy / d, dy / q, -dx / q, -1
        HP = H @ P
        S = HP @ np.swapaxes(H, 1, 2)
        S[:, 0, 0] += self.noise.range**2
        S[:, 1, 1] += self.noise.of_bearing(d) ** 2
        K = np.swapaxes(np.linalg.solve(S, HP), 1, 2)
        d2 = np.einsum("mi,mi->m", nu, np.linalg.solve(S, nu[..., None])[..., 0])
        # A false reading is as improbable for every particle as one at the gate, and so condemns none.
        likelihood = np.exp(-np.minimum(d2, GATE) / 2) / np.sqrt(np.linalg.det(S))
        good = d2 < GATE
        self.observers[good, i] = o[good] + (K[good] @ nu[good, :, None])[..., 0]
        self.covariances[good, i] = (P - K @ HP)[good]
        self.w = self.w * likelihood
        self.w = self.w / self.w.sum()

    def draws(self, i):
        """Poses (m, 3) of observer i, 1 or more: one from the small filter in each particle."""
        noise = self.rng.standard_normal((self.m, 3))
        return self.observers[:, i - 1] + np.einsum("mab,mb->ma", root(self.covariances[:, i - 1]), noise)

    @property
    def x(self):
        all_poses = np.concatenate([self.particles[:, None], self.observers], axis=1)
        heading = np.arctan2(self.w @ np.sin(all_poses[..., 2]), self.w @ np.cos(all_poses[..., 2]))
        return np.column_stack([np.einsum("m,mnk->nk", self.w, all_poses[..., :2]), heading])

    @property
    def P(self):
        """Covariance from the particles and from the small filters inside them."""
        all_poses = np.concatenate([self.particles[:, None], self.observers], axis=1)
        off = all_poses - self.x
        off[..., 2] = wrap(off[..., 2])
        flat = off.reshape(self.m, -1)
        P = (self.w * flat.T) @ flat + 1e-10 * np.eye(flat.shape[1])
        for i, block in enumerate(np.einsum("m,mnab->nab", self.w, self.covariances), 1):
            P[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] += block
        return P


def _moved(poses, u):
    """Poses after the motions u, and the Jacobians (..., 3, 3) of that by the pose."""
    c, s = np.cos(poses[..., 2]), np.sin(poses[..., 2])
    dx, dy = c * u[..., 0] - s * u[..., 1], s * u[..., 0] + c * u[..., 1]
    F = np.zeros((*poses.shape, 3))
    F[..., 0, 0] = F[..., 1, 1] = F[..., 2, 2] = 1
    F[..., 0, 2], F[..., 1, 2] = -dy, dx
    return np.stack([poses[..., 0] + dx, poses[..., 1] + dy, wrap(poses[..., 2] + u[..., 2])], axis=-1), F
