"""Several filters side by side, each with a guess of its own, and how probable each one is."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..geometry import Array, Pose, Poses, wrap
from .log import TeamLog

MOST = 13.8  # of d2 that one reading may count: a false one, which contradicts all guesses, then condemns none


def run_bank(filters: Sequence[Any], log: TeamLog, weigh: Callable[[Array, Array], Array]) -> tuple[Array, Poses]:
    """(weights (N+1, k) of k filters, poses (N+1, n, 3) of the most probable one) over a log.

    weigh(w, misfits): the weights (k,) after a step, from those before it (k,) and each filter's sum of d2 (k,).
    """
    weights, poses = [np.full(len(filters), 1 / len(filters))], [np.array(filters[0].x)]
    for u, seen in zip(log.controls, log.measurements()):
        misfits = []
        for kf in filters:
            kf.predict(u)
            kf.update(seen)
            misfits.append(sum(min(d2, MOST) for d2 in kf.d2))
        weights.append(np.array(weigh(weights[-1], np.array(misfits))))
        poses.append(np.array(filters[int(np.argmax(weights[-1]))].x))
    return np.array(weights), np.array(poses)


def mirrored(pose: Pose) -> Pose:
    """The pose (3,) on the other side of the x axis that sees the origin at the same range and bearing."""
    x, y, theta = pose
    return np.array([x, -y, wrap(theta + np.arctan2(y, -x) - np.arctan2(-y, -x))])
