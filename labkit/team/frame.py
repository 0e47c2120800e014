"""Frames that nobody fixed: laying one set of points on another, and errors that do not depend on the frame."""

from dataclasses import dataclass

import numpy as np

from ..geometry import wrap


def align(a, b):
    """The turn and shift that lays points a (N, 2) on b (N, 2) with the least squares: (angle [rad], shift (2,) [m]).

    Rigid: no scale, no mirror.  b is about rotation(angle) @ a + shift.  Raises ValueError for fewer than two
    different points.  Source: K. Arun, T. Huang, S. Blostein, "Least-squares fitting of two 3-D point sets" (1987),
    in the plane.
    """
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    if a.shape != b.shape or a.ndim != 2 or a.shape[1] != 2:
        raise ValueError(f"a and b must have the same shape (N, 2), but have {a.shape} and {b.shape}")
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise ValueError("a and b must be finite numbers, but one of them is not")
    p, q = (points - points.mean(axis=0) if len(points) else points for points in (a, b))
    if len(a) < 2 or not min((p**2).sum(), (q**2).sum()) > 1e-12 * len(a):
        raise ValueError("two different points are the least that can be laid on others")
    mean_a, mean_b = a.mean(axis=0), b.mean(axis=0)
    angle = np.arctan2(np.sum(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]), np.sum(p * q))
    return float(angle), mean_b - _turned(mean_a, angle)


def laid(poses, angle, shift):
    """Poses (..., 3), or points (..., 2), after a turn and a shift."""
    poses = np.asarray(poses, dtype=float)
    points = _turned(poses[..., :2], angle) + shift
    return points if poses.shape[-1] == 2 else np.concatenate([points, wrap(poses[..., 2:] + angle)], axis=-1)


def _turned(points, angle):
    c, s = np.cos(angle), np.sin(angle)
    x, y = points[..., 0], points[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def seen_from(observer, target):
    """Poses of targets (..., 3) in the frames of observers (..., 3): what an error of the common frame cannot touch."""
    d = target[..., :2] - observer[..., :2]
    c, s = np.cos(observer[..., 2]), np.sin(observer[..., 2])
    x, y = c * d[..., 0] + s * d[..., 1], c * d[..., 1] - s * d[..., 0]
    return np.stack([x, y, wrap(target[..., 2] - observer[..., 2])], axis=-1)


@dataclass(frozen=True)
class FrameErrors:
    """Errors of poses (N+1, n, 3) [m], step by step, of robot `who`.

    gauge   (N+1,) in the frame in which the estimate began;
    aligned (N+1,) after the whole estimate, all robots and steps, was laid on the truth once;
    ego     (N+1,) of where each of the others sees it, in its own frame: the mean over the others;
    turned  [rad] the angle of that laying: by how much the frame has turned.
    """

    gauge: np.ndarray
    aligned: np.ndarray
    ego: np.ndarray
    turned: float


def frame_errors(poses, truth, who=0):
    """The FrameErrors of an estimate against the truth, both (N+1, n, 3); NaN where the truth is."""
    poses, truth = np.asarray(poses), np.asarray(truth)
    known = np.isfinite(truth[..., :2]).all(axis=-1)
    angle, shift = align(poses[known][:, :2], truth[known][:, :2])
    others = [i for i in range(poses.shape[1]) if i != who]
    mine, due = (seen_from(p[:, others], p[:, [who]])[..., :2] for p in (poses, truth))
    return FrameErrors(
        np.linalg.norm((poses - truth)[:, who, :2], axis=1),
        np.linalg.norm(laid(poses, angle, shift)[:, who, :2] - truth[:, who, :2], axis=1),
        np.linalg.norm(mine - due, axis=2).mean(axis=1),
        angle,
    )


def nees(poses, covariances, truth, part=None):
    """(N+1,) normalized estimation error squared, per dimension: 1 on average for a filter that is honest.

    poses, truth (N+1, n, 3) in the same frame, covariances (N+1, 3n, 3n).
    part: which of the 3n numbers to look at, by default all.
    """
    e = poses - truth
    e[..., 2] = wrap(e[..., 2])
    e = e.reshape(len(e), -1)
    part = np.arange(e.shape[1]) if part is None else np.asarray(part)
    e, P = e[:, part], covariances[:, part[:, None], part]
    # The origin is known exactly: a micrometre and a microradian on top keep its rows regular.
    solved = np.linalg.solve(P + 1e-12 * np.eye(len(part)), e[..., None])[..., 0]
    return np.einsum("ki,ki->k", e, solved) / len(part)


def relative_nees(poses, covariances, truth):
    """Normalized estimation error squared, per dimension, of where each robot has each other one in its own frame.

    Mean over all ordered pairs and all steps whose truth is known (no NaN); poses, truth (N+1, n, 3), covariances
    (N+1, 3n, 3n).  A turn or shift of everything changes nothing, so 1 is honest whatever the frame does.
    """
    values = []
    n = poses.shape[1]
    for i in range(n):
        for j in range(n):
            if i == j:
                continue
            there = seen_from(poses[:, i], poses[:, j])
            e = (there - seen_from(truth[:, i], truth[:, j]))[:, :2]
            c, s = np.cos(poses[:, i, 2]), np.sin(poses[:, i, 2])
            J = np.zeros((len(poses), 2, 6))  # by the pose of i, then of j
            J[:, 0, 0], J[:, 0, 1], J[:, 1, 0], J[:, 1, 1] = -c, -s, s, -c
            J[:, 0, 2], J[:, 1, 2] = there[:, 1], -there[:, 0]
            J[:, :, 3:5] = -J[:, :, :2]
            both = [*range(3 * i, 3 * i + 3), *range(3 * j, 3 * j + 3)]
            C = J @ covariances[:, both][:, :, both] @ np.swapaxes(J, 1, 2)
            known = np.isfinite(e).all(axis=1)
            e, C = e[known], C[known]
            values.append(np.einsum("ki,ki->k", e, np.linalg.solve(C, e[..., None])[..., 0]) / 2)
    return float(np.mean(np.concatenate(values)))
