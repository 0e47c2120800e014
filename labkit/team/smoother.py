"""The smoother: the best that can be made of a run afterwards, by which filters, which know the past, are measured."""

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu

from ..geometry import Covariance, Poses, relative, wrap
from .log import TeamLog, dead_reckoned
from .world import TeamNoise


def least_squares(
    log: TeamLog, x0: Poses, P0: Covariance, noise: TeamNoise, believe: Callable | None = None, rounds: int = 8
) -> Poses:
    """Poses (N+1, n, 3) of all robots at all steps that fit start, odometry and readings best.

    x0 (n, 3), P0 (3n, 3n): what is known of the start.
    believe: a function (k, observer, target, z) -> bool that leaves readings out; by default all are used.
    Gauss and Newton's method on a sparse system: a chain of odometry for each robot, tied by the readings.
    Raises ValueError if it does not settle: if poses still move by more than a millimetre in the last round.
    """
    x0, (k, i, j, z) = np.asarray(x0, dtype=float), _readings(log, believe)
    # Robots that stand have no odometry noise; a tenth of a millimetre keeps the system regular.
    sigma = np.maximum(noise.of_step(log.controls), [1e-4, 1e-4, 1e-5])
    root = np.linalg.inv(np.linalg.cholesky(np.asarray(P0) + 1e-12 * np.eye(x0.size)))
    x = dead_reckoned(log, x0)
    number = np.arange(x.size).reshape(x.shape)  # the column of each number of x
    for _ in range(rounds):
        parts = [
            _of_start(x, x0, root, number),
            _of_odometry(x, log.controls, sigma, number),
            _of_readings(x, k, i, j, z, noise, number),
        ]
        J, residual = _stacked(parts, x.size)
        step = splu((J.T @ J).tocsc()).solve(-J.T @ residual).reshape(x.shape)
        x = x + step
        x[..., 2] = wrap(x[..., 2])
        if abs(step).max() < 1e-6:
            return x
    if abs(step).max() > 1e-3:
        raise ValueError(f"the fit does not settle: after {rounds} rounds poses still move by {abs(step).max():.2g}")
    return x


def _readings(log, believe):
    """(M,) the poses' step, observer and target of each reading, and (M, 2) what was read."""
    seen = [
        (k + 1, i, j, *z)
        for k, one in enumerate(log.measurements())
        for i, j, z in one
        if believe is None or believe(k, i, j, z)
    ]
    k, i, j = np.array([s[:3] for s in seen], dtype=int).reshape(-1, 3).T
    return k, i, j, np.array([s[3:] for s in seen], dtype=float).reshape(-1, 2)


# Each part of the system is its misfits (..., r) in standard deviations, and a list of their derivatives
# (..., r, c) with the columns (..., c) that these stand in.


def _stacked(parts, width):
    """(sparse Jacobian, misfits) of all parts, one below the other."""
    entries, top = [], 0
    for misfit, blocks in parts:
        rows = top + np.arange(misfit.size).reshape(misfit.shape)[..., None]
        for derivative, columns in blocks:
            entries.append(np.broadcast_arrays(rows, columns[..., None, :], derivative))
        top += misfit.size
    rows, columns, values = (np.concatenate([entry[c].ravel() for entry in entries]) for c in range(3))
    return csr_array((values, (rows, columns)), shape=(top, width)), np.concatenate([m.ravel() for m, _ in parts])


def _of_start(x, x0, root, number):
    first = x[0] - x0
    first[:, 2] = wrap(first[:, 2])
    return root @ first.ravel(), [(root, number[0].ravel())]


def _of_odometry(x, u, sigma, number):
    """The motion between two poses, in the frame of the first, less what was reported."""
    came = relative(x[1:], x[:-1])
    misfit = came - u
    misfit[..., 2] = wrap(misfit[..., 2])
    c, s = np.cos(x[:-1, :, 2]), np.sin(x[:-1, :, 2])
    after = np.zeros((*u.shape, 3))
    after[..., 0, 0], after[..., 0, 1], after[..., 1, 0], after[..., 1, 1], after[..., 2, 2] = c, s, -s, c, 1
    before = -after
    before[..., 0, 2], before[..., 1, 2] = came[..., 1], -came[..., 0]
    weight = sigma[..., None]
    return misfit / sigma, [(after / weight, number[1:]), (before / weight, number[:-1])]


def _of_readings(x, k, i, j, z, noise, number):
    o, p = x[k, i], x[k, j]
    dx, dy = p[:, 0] - o[:, 0], p[:, 1] - o[:, 1]
    q = np.maximum(dx**2 + dy**2, 1e-6)
    r = np.sqrt(q)
    weight = 1 / np.maximum(np.stack([np.full(len(r), noise.range), noise.of_bearing(r)], axis=-1), 1e-5)
    misfit = np.stack([r - z[:, 0], wrap(np.arctan2(dy, dx) - o[:, 2] - z[:, 1])], axis=-1)
    H = np.zeros((len(k), 2, 3))
    H[:, 0, 0], H[:, 0, 1], H[:, 1, 0], H[:, 1, 1] = dx / r, dy / r, -dy / q, dx / q
    Ho = -H
    Ho[:, 1, 2] = -1
    H, Ho = H * weight[..., None], Ho * weight[..., None]
    return misfit * weight, [(H, number[k, j]), (Ho, number[k, i])]
