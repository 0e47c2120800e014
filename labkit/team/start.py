"""Where a team's filter starts: at the true poses with an error, or from what the robots saw of one another."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ..geometry import Array, Covariance, Points, Pose, Poses, relative, wrap
from ..history import truth_of
from .initial_pose import initial_pose
from .log import TeamLog, dead_reckoned, later
from .scenarios import cross
from .world import TeamNoise

SIGMA = (0.13, 0.13, np.deg2rad(1.0))  # [m, m, rad] of an observer that was found by what it saw of 3.3 m


def near(poses: Poses, seed: int) -> tuple[Poses, Covariance]:
    """(x0 (n, 3), P0 (3n, 3n)): poses (n, 3) with an error of SIGMA for all but robot 0, which is the origin."""
    sigma = np.tile(SIGMA, (len(poses), 1))
    sigma[0] = 1e-6
    return poses + sigma * np.random.default_rng(seed + 1000).standard_normal(sigma.shape), np.diag(sigma.ravel() ** 2)


def started(KF: Callable, log: TeamLog, seed: int, noise: TeamNoise | None = None, **options: Any) -> Any:
    """A filter KF(x0, P0, noise, ...) for a log, started near its true poses; options: what else KF takes."""
    return KF(*near(truth_of(log)[0], seed), noise or TeamNoise(), **options)


def first_metres(log: TeamLog, i: int, metres: float = 3.3) -> tuple[Points, Array, Array]:
    """Track (N, 2) [m] by odometry, ranges (N,) [m], bearings (N,) [rad] of robot 0's first metres, seen by robot i."""
    track, way = _track(log)
    seen = log.logs[i]
    early = way[seen.seen_step] < metres
    return track[seen.seen_step[early] + 1, :2], *seen.seen[early].T


def _track(log):
    """(poses (N+1, 3) of robot 0 by its odometry from the origin, (N,) metres it has driven after each step)."""
    track = dead_reckoned(log, np.zeros((log.n, 3)))[:, 0]
    return track, np.cumsum(np.linalg.norm(np.diff(track[:, :2], axis=0), axis=1))


def median_of_pairs(two_circles: Callable, mean: Callable, track: Points, ranges: Array, bearings: Array) -> Pose:
    """The median pose (3,) of what pairs of sightings say, 25 readings (1.5 m) apart or more; NaN if none says one.

    two_circles, mean: the student's.
    """
    sigma, z = TeamNoise().of_bearing(float(np.mean(ranges))), np.column_stack([ranges, bearings])
    pairs = [(k, m) for k in range(0, len(z), 3) for m in range(k + 25, len(z), 3)]
    poses = np.array([two_circles(track[k], z[k], track[m], z[m], sigma) for k, m in pairs]).reshape(-1, 3)
    poses = poses[np.isfinite(poses).all(axis=1)]
    return np.array([*np.median(poses[:, :2], axis=0), mean(poses[:, 2])]) if len(poses) else np.full(3, np.nan)


def start_errors(find: Callable, runs: int = 30) -> tuple[float, float, float]:
    """How well find(track, ranges, bearings) places the two observers of a cross, in so many runs.

    (share of them that are found, root mean square [m] of their places, and [rad] of their headings)
    """
    off = []
    for log in (cross(rng=seed, steps=100) for seed in range(runs)):
        for i in (1, 2):
            e = find(*first_metres(log, i)) - relative(truth_of(log)[0, i], truth_of(log)[0, 0])
            off.append([*e[:2], wrap(e[2])])
    found = np.array(off)[np.isfinite(off).all(axis=1)]
    far, turned = np.sqrt(np.mean(found[:, :2] ** 2) * 2), np.sqrt(np.mean(found[:, 2] ** 2))
    return len(found) / len(off), float(far), float(turned)


def own_start(KF: Callable, log: TeamLog, metres: float = 3.3) -> tuple[Any, TeamLog]:
    """A filter that starts from readings alone, after robot 0's first metres, and the log from there."""
    track, way = _track(log)
    now = int(np.sum(way < metres))
    found = [initial_pose(*first_metres(log, i, metres))[0] for i in range(1, log.n)]
    x0 = np.array([np.zeros(3), *(relative(pose, track[now]) for pose in found)])
    return KF(x0, near(x0, 0)[1], TeamNoise()), later(log, now)
