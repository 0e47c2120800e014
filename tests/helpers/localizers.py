"""The answers of labs 4, 5 and 8 and localizers made with them, for tests and benchmarks."""

from functools import cache, partial
from pathlib import Path

import numpy as np

from labkit.history import make_filter
from labkit.legged import FuzzyGrid, Hybrid, Memory, ParticleFilter, Triangulation
from labkit.notebook.answers import load_answer

GRID = ("membership", "fuse_range", "estimate", "lost_by_spread", "lost")  # what lab 5 asks for
LABS = dict.fromkeys(GRID, "05_fuzzy_hybrid") | {"restart": "08_further"}
START = np.diag([0.1, 0.1, 0.1]) ** 2


@cache
def answer(name):
    """What the solution of lab 4, 5 or 8 defines under this name."""
    return load_answer(LABS.get(name, "04_legged_robot"), name, Path(__file__).resolve().parents[2] / "solutions")


def ekf(log, x0=None, P0=START, noise=None, **options):
    """The solution's EKF for a log, from the true start unless told otherwise."""
    KF = partial(answer("EKF"), **options)
    return make_filter(KF, log, x0=log.truth[0] if x0 is None else x0, P0=P0, noise=noise or log.noise.told())


def hybrid(log, finder, **options):
    return Hybrid(finder, lambda x0, P0: ekf(log, x0, P0), answer("lost"), **options)


CONTESTANTS = {
    "EKF alone": ekf,
    "EKF, no gate": partial(ekf, gate=np.inf),
    "grid alone": lambda log: FuzzyGrid(log.noise.told()),
    "MCL 500": lambda log: ParticleFilter(500, log.noise.told(), rng=0),
    "MCL 2000": lambda log: ParticleFilter(2000, log.noise.told(), rng=0),
    "triangulation": lambda log: Triangulation(),
    "MCL + EKF": lambda log: hybrid(log, ParticleFilter(500, log.noise.told(), rng=0)),
    "grid + EKF": lambda log: hybrid(log, FuzzyGrid(log.noise.told())),
    "grid (backgr.) + EKF": lambda log: hybrid(log, FuzzyGrid(log.noise.told()), background=3),
    "memory + EKF": lambda log: hybrid(log, Memory(answer("restart"), log.noise.told()), background=1, frames=1),
}
