"""Lab 6's answers, and filters made with them, for tests and benchmarks."""

from functools import cache
from pathlib import Path

import numpy as np

from labkit import wrap
from labkit.geometry import relative
from labkit.notebook.answers import load_answer
from labkit.team import TeamNoise, dead_reckoned, initial_pose


@cache
def answer(name):
    """What lab 6's solution defines under this name."""
    return load_answer("06_observers", name, Path(__file__).resolve().parents[2] / "solutions")


TOLD = TeamNoise()


def started(log, seed, noise=TOLD, KF="GroupEKF", **options):
    """A filter of the solution's for a log, started with an error of 13 cm and 1 degree for all but robot 0."""
    sigma = np.tile([0.13, 0.13, np.deg2rad(1.0)], (log.n, 1))
    sigma[0] = 1e-6
    x0 = log.truth[0] + sigma * np.random.default_rng(seed + 1000).standard_normal(sigma.shape)
    return answer(KF)(x0, np.diag(sigma.ravel() ** 2), noise, **options)


def start_errors(scenario, runs, metres=3.3):
    """(position [m], heading [rad]) rms errors of observers that are placed after robot 0's first metres."""
    off = []
    for seed in range(runs):
        log = scenario(rng=seed)
        track = dead_reckoned(log, np.zeros((log.n, 3)))[:, 0]
        way = np.cumsum(np.linalg.norm(np.diff(track[:, :2], axis=0), axis=1))
        for i in range(1, log.n):
            one = log.logs[i]
            early = way[one.seen_step] < metres
            pose, _ = initial_pose(track[one.seen_step[early] + 1, :2], *one.seen[early].T)
            e = pose - relative(log.truth[0, i], log.truth[0, 0])
            off.append([np.hypot(*e[:2]), wrap(e[2])])
    return np.sqrt(np.mean(np.square(off), axis=0))
