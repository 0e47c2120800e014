"""A particle filter for a team: guesses of where robot 0 is, and for each of them a small filter per observer."""

import numpy as np

from ..geometry import Covariance, Motion, Poses, Seed, compose, resampled, root, weighted, wrap
from .log import Reading
from .world import TeamNoise

GATE = 13.8  # as a joint filter's


class TeamParticles:
    """Rao-Blackwellised particle filter: `predict(u)`, `update(seen)`, x (n, 3), P (3n, 3n), and `particles` (m, 3).

    m: how many.  x0 (n, 3), P0 (3n, 3n), noise: as for a joint filter.  rng: a numpy Generator, or a seed for one.
    Robot 0 is sampled. Given where it is, the observers are independent of each other, so each particle has an
    extended Kalman filter for each of them; `observers` (m, n-1, 3) are their means.  Only what the observers see of
    robot 0 is used; readings between observers, and those of robot 0 itself, are left aside.
    Source: the paper's figure 8; K. Murphy, S. Russell, "Rao-Blackwellised particle filtering for dynamic Bayesian
    networks" (2001).
    """

    def __init__(self, m: int, x0: Poses, P0: Covariance, noise: TeamNoise, inflate: float = 4.0, rng: Seed = None):
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

    def predict(self, u: Motion) -> None:
        """Move all by the odometry u (n, 3) of a step."""
        u = np.asarray(u, dtype=float)
        sigma = np.sqrt(self.inflate) * self.noise.of_step(u)
        moves = u[0] + sigma[0] * self.rng.standard_normal((self.m, 3))
        self.particles = compose(self.particles, moves)
        if (u[1:] != 0).any():
            c, s = np.cos(self.observers[..., 2]), np.sin(self.observers[..., 2])
            before, self.observers = self.observers, compose(self.observers, u[1:])
            dx, dy = np.moveaxis((self.observers - before)[..., :2], -1, 0)
            F, W = np.zeros((2, *before.shape, 3))
            F[..., :, :] = np.eye(3)
            F[..., 0, 2], F[..., 1, 2] = -dy, dx
            W[..., 0, 0], W[..., 0, 1], W[..., 1, 0], W[..., 1, 1], W[..., 2, 2] = c, -s, s, c, 1
            Q = W * (sigma[1:] ** 2)[:, None, :] @ np.swapaxes(W, -1, -2)
            self.covariances = F @ self.covariances @ np.swapaxes(F, -1, -2) + Q

    def update(self, seen: list[Reading]) -> None:
        """Weigh the particles by the readings of a step, and resample where few carry the weight."""
        for i, j, z in seen:
            if j == 0:
                self._weigh(i - 1, z)
        if 1 / (self.w @ self.w) < self.m / 2:
            which = resampled(self.w, self.rng)
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

    def draws(self, i: int) -> Poses:
        """Poses (m, 3) of observer i, 1 or more: one from the small filter in each particle."""
        noise = self.rng.standard_normal((self.m, 3))
        return self.observers[:, i - 1] + np.einsum("mab,mb->ma", root(self.covariances[:, i - 1]), noise)

    @property
    def x(self) -> Poses:
        """(n, 3) the mean of the particles."""
        return self._weighted()[0]

    @property
    def P(self) -> Covariance:
        """Covariance from the particles and from the small filters inside them."""
        P = self._weighted()[1]
        P = P + 1e-10 * np.eye(len(P))
        for i, block in enumerate(np.einsum("m,mnab->nab", self.w, self.covariances), 1):
            P[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] += block
        return P

    def _weighted(self):
        return weighted(np.concatenate([self.particles[:, None], self.observers], axis=1), self.w)
