"""Where a team's filter starts: at the true poses with an error, or from what the robots saw of one another."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ..geometry import Array, Covariance, Points, Poses, relative
from ..history import truth_of
from .initial_pose import initial_pose
from .log import TeamLog, dead_reckoned, later
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


def own_start(KF: Callable, log: TeamLog, metres: float = 3.3) -> tuple[Any, TeamLog]:
    """A filter that starts from readings alone, after robot 0's first metres, and the log from there."""
    track, way = _track(log)
    now = int(np.sum(way < metres))
    found = [initial_pose(*first_metres(log, i, metres))[0] for i in range(1, log.n)]
    x0 = np.array([np.zeros(3), *(relative(pose, track[now]) for pose in found)])
    return KF(x0, near(x0, 0)[1], TeamNoise()), later(log, now)
