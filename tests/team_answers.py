"""Lab 5's answers, and filters made with them, for tests and benchmarks."""

from functools import cache
from pathlib import Path

import numpy as np

from labkit.notebook import load_answer
from labkit.team import TeamNoise


@cache
def answer(name):
    """What lab 5's solution defines under this name."""
    return load_answer("05_observers", name, Path(__file__).resolve().parent.parent / "solutions")


def started(log, seed, noise=TeamNoise(), **options):
    """The solution's joint filter for a log, started with an error of 13 cm and 1 degree for all but robot 0."""
    sigma = np.tile([0.13, 0.13, np.deg2rad(1.0)], (log.n, 1))
    sigma[0] = 1e-6
    x0 = log.truth[0] + sigma * np.random.default_rng(seed).standard_normal(sigma.shape)
    return answer("GroupEKF")(x0, np.diag(sigma.ravel() ** 2), noise, **options)
