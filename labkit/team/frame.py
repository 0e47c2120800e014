"""Frames that nobody fixed: errors of a team that do not depend on the frame, and how honest they are."""

from dataclasses import dataclass

import numpy as np

from ..geometry import align, relative, transform, wrap


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
    mine, due = (relative(p[:, [who]], p[:, others])[..., :2] for p in (poses, truth))
    return FrameErrors(
        np.linalg.norm((poses - truth)[:, who, :2], axis=1),
        np.linalg.norm(transform(poses, angle, shift)[:, who, :2] - truth[:, who, :2], axis=1),
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
            there = relative(poses[:, j], poses[:, i])
            e = (there - relative(truth[:, j], truth[:, i]))[:, :2]
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
