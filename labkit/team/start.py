"""A first guess of where an observer stands, from what it saw of a robot that drove by (with the kit)."""

import numpy as np

from ..geometry import wrap
from .frame import align, laid

BASELINE = 1.0  # [m] the robot must have driven at least so far
CONTRADICTION = 0.5  # [m] if half of the readings are farther off than this, they are not of this robot


def by_alignment(track, ranges, bearings):
    """(pose (3,), spread) of the observer: its readings laid on the robot's own odometry track.

    track (N, 2) [m] in the robot's frame, ranges (N,) [m], bearings (N,) [rad] from the observer's heading.
    The observer's readings are points in its own frame; the turn and shift that lays them on the track is its pose.
    spread [m]: root mean square of what is left over.
    Raises ValueError, in a sentence, if the robot has not driven far enough to tell, or if the readings contradict
    each other wherever the observer stands.
    """
    track = np.asarray(track, dtype=float)
    far = np.linalg.norm(track[:, None] - track[None], axis=2).max() if len(track) else 0.0
    if far < BASELINE:
        raise ValueError(
            f"the robot has moved by only {far:.2f} m: at least {BASELINE} m are needed to tell where the observer is"
        )
    points = np.stack([ranges * np.cos(bearings), ranges * np.sin(bearings)], axis=-1)
    # Some readings may be false: pairs of readings propose poses, and the one that fits half of all readings best
    # tells which readings to believe.
    if len(points) != len(track) or not np.isfinite(points).all() or not np.isfinite(track).all():
        raise ValueError(
            f"track, ranges and bearings must be finite and equally long, but are {len(track)} and {len(points)}"
        )
    half = len(points) // 2
    proposals = [
        align(points[[k, k + half]], track[[k, k + half]])
        for k in range(half)
        if (track[k] != track[k + half]).any()
    ]
    best = min((_off(points, track, *one) for one in proposals), key=np.median)
    if np.median(best) > CONTRADICTION:
        raise ValueError(
            f"the readings contradict each other: wherever the observer stands, half of them are {np.median(best):.1f} m off or more"
        )
    good = best <= max(3 * 1.4826 * np.median(best), 0.15)
    angle, shift = align(points[good], track[good])
    return np.array([*shift, wrap(angle)]), float(
        np.sqrt(np.mean(_off(points[good], track[good], angle, shift) ** 2))
    )


def _off(points, track, angle, shift):
    """(N,) [m] how far points are from the track after a turn and a shift."""
    return np.linalg.norm(laid(points, angle, shift) - track, axis=1)
