"""The answers of labs 6 to 8, and filters made with them, for tests and benchmarks."""

from functools import cache
from pathlib import Path

import numpy as np

from labkit import team, wrap
from labkit.geometry import relative
from labkit.notebook.answers import load_answer
from labkit.team import TeamNoise, first_metres, initial_pose
from labkit.team.formation import Rules

SOLUTIONS = Path(__file__).resolve().parents[2] / "solutions"
ELSEWHERE = dict.fromkeys(("slot_velocity", "force", "steer", "weigh"), "07_formation")
ELSEWHERE |= dict.fromkeys(("FastEKF", "ConvertedKF", "AtReading", "Patient", "InvariantEKF"), "08_further")


@cache
def answer(name):
    """What one of the solutions defines under this name."""
    return load_answer(ELSEWHERE.get(name, "06_observers"), name, SOLUTIONS)


TOLD = TeamNoise()


def started(log, seed, noise=TOLD, KF="GroupEKF", **options):
    """A filter of the solution's for a log, started near its true poses."""
    return team.started(answer(KF), log, seed, noise, **options)


def rules():
    """The followers' rules, of the solution's functions."""
    return Rules(answer("slot_velocity"), answer("force"), answer("steer"))


def start_errors(scenario, runs, metres=3.3):
    """(position [m], heading [rad]) rms errors of observers that are placed after robot 0's first metres."""
    off = []
    for seed in range(runs):
        log = scenario(rng=seed)
        for i in range(1, log.n):
            pose, _ = initial_pose(*first_metres(log, i, metres))
            e = pose - relative(log.truth[0, i], log.truth[0, 0])
            off.append([np.hypot(*e[:2]), wrap(e[2])])
    return np.sqrt(np.mean(np.square(off), axis=0))
