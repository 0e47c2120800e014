"""The best that can be made of a whole run afterwards: what filters, which know only the past, are measured by."""

import numpy as np

from ..geometry import compose, relative, wrap


def least_squares(log, x0, P0, noise, believe=None, rounds=8):
    """Poses (N+1, n, 3) of all robots at all steps that fit start, odometry and readings best.

    log: a TeamLog.  x0 (n, 3), P0 (3n, 3n): what is known of the start.  noise: a TeamNoise.
    believe: a function (k, observer, target, z) -> bool that leaves readings out; by default all are used.
    Gauss and Newton's method on a sparse system: a chain of odometry for each robot, tied by the readings.
    Raises ValueError if it does not settle: if poses still move by more than a millimetre in the last round.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import splu

    n, N, u = log.n, len(log), log.controls
    # Robots that stand have no odometry noise; a tenth of a millimetre keeps the system regular.
    sigma = np.maximum(noise.of_step(u), [1e-4, 1e-4, 1e-5])
    seen = [
        (k + 1, i, j, *z)
        for k, one in enumerate(log.measurements())
        for i, j, z in one
        if believe is None or believe(k, i, j, z)
    ]
    k, i, j = np.array([s[:3] for s in seen], dtype=int).reshape(-1, 3).T
    z = np.array([s[3:] for s in seen], dtype=float).reshape(-1, 2)
    root = np.linalg.inv(np.linalg.cholesky(np.asarray(P0) + 1e-12 * np.eye(3 * n)))
    x = _chain(np.asarray(x0, dtype=float), u)
    for _ in range(rounds):
        blocks, residual = _system(x, np.asarray(x0), root, u, sigma, (k, i, j, z), noise)
        rows, columns, values = (np.concatenate([b[c].ravel() for b in blocks]) for c in range(3))
        J = csr_array((values, (rows, columns)), shape=(len(residual), 3 * n * (N + 1)))
        step = splu((J.T @ J).tocsc()).solve(-J.T @ residual).reshape(N + 1, n, 3)
        x = x + step
        x[..., 2] = wrap(x[..., 2])
        if abs(step).max() < 1e-6:
            return x
    if abs(step).max() > 1e-3:
        raise ValueError(f"the fit does not settle: after {rounds} rounds poses still move by {abs(step).max():.2g}")
    return x


def _chain(x0, u):
    x = [x0]
    for one in u:
        x.append(compose(x[-1], one))
    return np.array(x)


def _system(x, x0, root, u, sigma, readings, noise):
    """(list of (rows, columns, values), residuals): the derivatives and misfits in standard deviations."""
    N, n = u.shape[:2]
    number = np.arange(3 * n * (N + 1)).reshape(N + 1, n, 3)
    first = x[0] - x0
    first[:, 2] = wrap(first[:, 2])
    residual = [root @ first.ravel()]
    rows = np.arange(3 * n)
    blocks = [(np.repeat(rows, 3 * n), np.tile(number[0].ravel(), 3 * n), root)]
    # Odometry: the motion between two poses, in the frame of the first, less what was reported.
    c, s = np.cos(x[:-1, :, 2]), np.sin(x[:-1, :, 2])
    came = relative(x[1:], x[:-1])
    misfit = came - u
    misfit[..., 2] = wrap(misfit[..., 2])
    turn = np.zeros((N, n, 3, 3))
    turn[..., 0, 0], turn[..., 0, 1], turn[..., 1, 0], turn[..., 1, 1], turn[..., 2, 2] = c, s, -s, c, 1
    back = -turn
    back[..., 0, 2], back[..., 1, 2] = came[..., 1], -came[..., 0]
    at = len(residual[0]) + np.arange(3 * n * N).reshape(N, n, 3)
    for derivative, which in ((turn, number[1:]), (back, number[:-1])):
        rows = np.broadcast_to(at[..., None], (N, n, 3, 3))
        columns = np.broadcast_to(which[..., None, :], (N, n, 3, 3))
        blocks.append((rows, columns, derivative / sigma[..., None]))
    residual.append((misfit / sigma).ravel())
    # Readings.
    k, i, j, z = readings
    o, p = x[k, i], x[k, j]
    ex, ey = (p - o)[:, :2].T
    q = np.maximum(ex**2 + ey**2, 1e-6)
    r = np.sqrt(q)
    weight = 1 / np.maximum(np.stack([np.full(len(r), noise.range), noise.of_bearing(r)], axis=-1), 1e-5)
    misfit = np.stack([r - z[:, 0], wrap(np.arctan2(ey, ex) - o[:, 2] - z[:, 1])], axis=-1)
    H = np.zeros((len(k), 2, 3))
    H[:, 0, 0], H[:, 0, 1], H[:, 1, 0], H[:, 1, 1] = ex / r, ey / r, -ey / q, ex / q
    Ho = -H
    Ho[:, 1, 2] = -1
    at = 3 * n * (N + 1) + np.arange(2 * len(k)).reshape(-1, 2)
    for derivative, who in ((H, j), (Ho, i)):
        rows = np.broadcast_to(at[:, :, None], derivative.shape)
        columns = np.broadcast_to(number[k, who][:, None, :], derivative.shape)
        blocks.append((rows, columns, derivative * weight[:, :, None]))
    residual.append((misfit * weight).ravel())
    return blocks, np.concatenate(residual)
