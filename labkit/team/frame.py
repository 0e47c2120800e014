"""Frames that nobody fixed: errors of a team that do not depend on the frame, and how honest they are."""

from dataclasses import dataclass
from itertools import permutations

import numpy as np

from ..geometry import Array, Poses, align, relative, transform
from ..history import History, of_one_run, truth_of
from ..metrics import squared
from ..validation import as_numbers
from .log import TeamLog


@dataclass(frozen=True)
class FrameErrors:
    """Errors of poses (N+1, n, 3) [m], step by step, of robot `who`.

    gauge   (N+1,) in the frame in which the estimate began;
    aligned (N+1,) after the whole estimate, all robots and steps, was laid on the truth once;
    ego     (N+1,) of where each of the others sees it, in its own frame: the mean over the others;
    turned  [rad] the angle of that laying: by how much the frame has turned.
    """

    gauge: Array
    aligned: Array
    ego: Array
    turned: float


def frame_errors(poses: Poses, truth: Poses, who: int = 0) -> FrameErrors:
    """The FrameErrors of an estimate against the truth, both (N+1, n, 3); NaN where the truth is.

    Raises ValueError for other shapes, and for a robot that is not there.
    """
    poses, truth = as_numbers(poses, "poses"), as_numbers(truth, "truth")
    if poses.ndim != 3 or poses.shape != truth.shape or poses.shape[2] != 3:
        raise ValueError(f"poses and truth must have the same shape (N+1, n, 3), but have {poses.shape}, {truth.shape}")
    if who not in range(poses.shape[1]):
        raise ValueError(f"who must be a robot from 0 to {poses.shape[1] - 1}, but it is {who!r}")
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


def relative_rms(poses: Poses, truth: Poses) -> float:
    """Root mean square error [m] of where the robots have each other in their own frames: poses, truth (N+1, n, 3)."""
    pairs = permutations(range(poses.shape[1]), 2)
    off = [relative(poses[:, j], poses[:, i]) - relative(truth[:, j], truth[:, i]) for i, j in pairs]
    return float(np.sqrt(np.nanmean([(e[:, :2] ** 2).sum(axis=1) for e in off])))


def relative_nees_per_dimension(history: History, log: TeamLog) -> float:
    """Mean NEES per dimension, over all ordered pairs, of where each robot has each other one in its own frame.

    Steps whose truth is not known (NaN) are left out.  A turn or shift of everything changes nothing, so 1 is
    consistent whatever the frame does.  Raises ValueError for a log without truth.
    """
    of_one_run(history, log)
    history.sound()
    truth, pairs = truth_of(log), permutations(range(log.n), 2)
    return float(np.mean(np.concatenate([_relative_nees(history, truth, i, j) for i, j in pairs])))


def _relative_nees(history, truth, i, j):
    """Of the place of robot j in the frame of robot i, at the steps whose truth is known."""
    poses, there = history.x, relative(history.x[:, j], history.x[:, i])
    e = (there - relative(truth[:, j], truth[:, i]))[:, :2]
    c, s = np.cos(poses[:, i, 2]), np.sin(poses[:, i, 2])
    J = np.zeros((len(poses), 2, 6))  # by the pose of i, then of j
    J[:, 0, 0], J[:, 0, 1], J[:, 1, 0], J[:, 1, 1] = -c, -s, s, -c
    J[:, 0, 2], J[:, 1, 2] = there[:, 1], -there[:, 0]
    J[:, :, 3:5] = -J[:, :, :2]
    both = [*range(3 * i, 3 * i + 3), *range(3 * j, 3 * j + 3)]
    C = J @ history.P[:, both][:, :, both] @ np.swapaxes(J, 1, 2)
    known = np.isfinite(e).all(axis=1)
    return squared(e[known], C[known]) / 2
