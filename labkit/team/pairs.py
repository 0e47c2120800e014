"""For large groups: a small filter for each observer, instead of one large one for all."""

from collections.abc import Sequence

import numpy as np

from ..geometry import Array, Covariances, Measurements, Motion, Poses, wrap
from .world import TeamNoise


class PairFilters:
    """The pose of one target in the frames of n observers, each by an extended Kalman filter of its own.

    poses (n, 3): the target as each observer believes to see it, [m, m, rad] in the observer's own frame; P (n, 3, 3).
    noise: a TeamNoise.  All observers are computed at once; n can be thousands.
    What is lost against a joint filter: readings of one observer tell the others nothing. What is gained: a cost that
    grows with n and not with its cube, and no correlation that could be forgotten.
    """

    def __init__(self, poses: Poses, P: Covariances, noise: TeamNoise, gate: float = 13.8, inflate: float = 4.0):
        poses, P = np.array(poses, dtype=float), np.array(P, dtype=float)
        n = len(poses)
        if poses.shape != (n, 3) or P.shape != (n, 3, 3):
            raise ValueError(f"poses must be (n, 3) and P (n, 3, 3), but they are {poses.shape} and {P.shape}")
        # The observers stand last, side by side in memory: products of small matrices are six times as fast so.
        self._x, self._P = np.ascontiguousarray(poses.T), np.ascontiguousarray(np.moveaxis(P, 0, -1))
        self.noise, self.gate, self.inflate = noise, gate, inflate

    @property
    def x(self) -> Poses:
        """(n, 3) the target's pose in the observers' frames [m, m, rad]."""
        return self._x.T.copy()

    @property
    def P(self) -> Covariances:
        """(n, 3, 3) its covariances."""
        return np.moveaxis(self._P, -1, 0).copy()

    def predict(self, target: Motion, observers: Motion) -> None:
        """Move by the odometry of the target (3,) and of the observers (n, 3) [m, m, rad]."""
        target, observers = np.asarray(target, dtype=float), np.asarray(observers, dtype=float)
        u, v = target[:, None], observers.T
        c, s, cv, sv = np.cos(self._x[2]), np.sin(self._x[2]), np.cos(v[2]), np.sin(v[2])
        dx = c * u[0] - s * u[1]
        dy = s * u[0] + c * u[1]
        px, py = self._x[0] + dx - v[0], self._x[1] + dy - v[1]
        # The observer's own step takes its frame along: what it saw is now seen from the new place, turned back.
        x, y = cv * px + sv * py, cv * py - sv * px
        self._x = np.stack([x, y, wrap(self._x[2] + u[2] - v[2])])
        zero, one = np.zeros_like(x), np.ones_like(x)
        F = np.array([[cv, sv, sv * dx - cv * dy], [-sv, cv, sv * dy + cv * dx], [zero, zero, one]])
        # Columns: the target's odometry, then the observer's, each times its standard deviation.
        a, b = cv * c + sv * s, cv * s - sv * c
        G = np.array([[a, -b, zero, -cv, -sv, y], [b, a, zero, sv, -cv, -x], [zero, zero, one, zero, zero, -one]])
        sigmas = [self.noise.of_step(one).reshape(-1, 3).T for one in (target, observers)]
        G *= np.sqrt(self.inflate) * np.concatenate([np.broadcast_to(one, self._x.shape) for one in sigmas])
        self._P = _times_turned(_times(F, self._P), F) + _times_turned(G, G)

    def update(self, who: Sequence[int] | np.ndarray, z: Measurements) -> Array:
        """Correct observers `who` (m,) with what they see of the target, z (m, 2); the m values of d2.

        Raises ValueError if one of them is named twice or does not exist, or if there is not a reading for each.
        """
        who, z = np.asarray(who, dtype=int), np.asarray(z, dtype=float).reshape(-1, 2).T
        if who.shape != z.shape[1:] or not ((0 <= who) & (who < self._x.shape[1])).all():
            raise ValueError(f"who must name an observer from 0 to {self._x.shape[1] - 1} for each reading, z (m, 2)")
        if len(np.unique(who)) < len(who):
            raise ValueError("an observer has two readings of the same step: update with one after the other")
        (x, y, _), P = self._x[:, who], self._P[:, :, who]
        q = np.maximum(x**2 + y**2, 1e-6)
        d, zero = np.sqrt(q), np.zeros_like(q)
        H = np.array([[x / d, y / d, zero], [-y / q, x / q, zero]])
        nu = np.array([z[0] - d, wrap(z[1] - np.arctan2(y, x))])
        HP = _times(H, P)
        S = _times_turned(HP, H)
        S[0, 0] += self.noise.range**2
        S[1, 1] += self.noise.of_bearing(d) ** 2
        inverse = np.array([[S[1, 1], -S[0, 1]], [-S[0, 1], S[0, 0]]]) / (S[0, 0] * S[1, 1] - S[0, 1] ** 2)
        half = np.einsum("ijn,jn->in", inverse, nu)
        d2 = (nu * half).sum(axis=0)
        good = d2 < self.gate
        new = self._x[:, who] + np.einsum("jin,jn->in", HP, half)
        new[2] = wrap(new[2])
        less = np.einsum("jin,jkn->ikn", HP, _times(inverse, HP))
        self._x[:, who[good]] = new[:, good]
        self._P[:, :, who[good]] = (P - less)[..., good]
        return d2


def _times(A, B):
    """Products of n pairs of matrices (i, j, n), (j, k, n)."""
    return np.einsum("ijn,jkn->ikn", A, B)


def _times_turned(A, B):
    """The same, with B transposed."""
    return np.einsum("ijn,kjn->ikn", A, B)
