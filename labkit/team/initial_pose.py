"""A first guess of where an observer stands, from what it saw of a robot that drove by (with the kit)."""

import numpy as np

from ..geometry import Array, Points, Pose, align, transform, wrap
from ..world import located

BASELINE = 1.0  # [m] the robot must have driven at least so far
APART = 0.1  # [m] two places must be, and the readings of them, to propose a pose
CONTRADICTION = 0.5  # [m] if half of the readings are farther off than this, they are not of this robot


def initial_pose(track: Points, ranges: Array, bearings: Array) -> tuple[Pose, float]:
    """(pose (3,), spread) of the observer: its readings laid on the robot's own odometry track.

    track (N, 2) [m] in the robot's frame, ranges (N,) [m], bearings (N,) [rad] from the observer's heading.
    The observer's readings are points in its own frame; the turn and shift that lays them on the track is its pose.
    spread [m]: root mean square of what is left over.
    Raises ValueError, in a sentence, if the robot has not driven far enough to tell, or if the readings contradict
    each other wherever the observer stands.
    """
    track, points = _checked(*(np.asarray(one, dtype=float) for one in (track, ranges, bearings)))
    # Some readings may be false: pairs of readings propose poses, and the one that fits half of all readings best
    # tells which readings to believe.
    half = len(points) // 2
    proposals = [
        align(points[[k, m]], track[[k, m]])
        for k, m in zip(range(half), range(half, 2 * half))
        if min(np.linalg.norm(one[k] - one[m]) for one in (points, track)) > APART
    ]
    if not proposals:
        raise ValueError("the readings tell too little: none is of a place other than half of the way before")
    best = min((_off(points, track, *one) for one in proposals), key=np.median)
    if np.median(best) > CONTRADICTION:
        raise ValueError(
            "the readings contradict each other: "
            f"wherever the observer stands, half of them are {np.median(best):.1f} m off or more"
        )
    good = best <= max(3 * 1.4826 * np.median(best), 0.15)
    angle, shift = align(points[good], track[good])
    return np.array([*shift, wrap(angle)]), float(np.sqrt(np.mean(_off(points[good], track[good], angle, shift) ** 2)))


def _checked(track, ranges, bearings):
    """The track and, as points in the observer's frame, the readings, if they can tell something."""
    if track.ndim != 2 or track.shape[1] != 2 or not len(track) == len(ranges) == len(bearings):
        raise ValueError(
            "track must be (N, 2), ranges and bearings (N,), "
            f"but they are {track.shape}, {ranges.shape}, {bearings.shape}"
        )
    if not all(np.isfinite(one).all() for one in (track, ranges, bearings)):
        raise ValueError("track, ranges and bearings must be finite numbers, but one of them is not")
    far = np.linalg.norm(track[:, None] - track[None], axis=2).max() if len(track) else 0.0
    if far < BASELINE:
        raise ValueError(
            f"the robot has moved by only {far:.2f} m: at least {BASELINE} m are needed to tell where the observer is"
        )
    return track, located(np.zeros(2), np.stack([ranges, bearings], axis=-1), "rb")


def _off(points, track, angle, shift):
    """(N,) [m] how far points are from the track after a turn and a shift."""
    return np.linalg.norm(transform(points, angle, shift) - track, axis=1)
