"""The solutions' answers as plain Python objects, for the tests of the kit around them."""

import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from labkit.history import make_filter, replay
from labkit.log import simulate
from labkit.notebook.answers import load_answer
from labkit.robot import HANDOUT_Q as Q, HANDOUT_R as R, Robot
from labkit.world import Map, random_map

ROOT = Path(__file__).resolve().parents[2]
LABS = [path.stem for path in sorted((ROOT / "solutions").glob("[0-9]*_*.py"))]
COURSE = [lab for lab in LABS if lab < "09"]  # the eight, which have limits of their own; a lab of one's own has not
GRADED = [lab for lab in LABS if lab != "08_further"]  # its explorations give no points
IN_CI = os.environ.get("LABKIT_CI") == "1"  # as .ci/run says: there, what takes long and seldom fails runs as well
# Beside other tests a page of Jupyter's may lose what a kernel says while it starts: CI runs these by themselves.
by_itself = pytest.mark.skipif(IN_CI and os.environ.get("LABKIT_ALONE") != "1", reason="runs by itself in CI")
ci_only = pytest.mark.skipif(not IN_CI, reason="takes long; it runs in CI, and with LABKIT_CI=1")
LAB = {"xy": "01_cartesian_ekf", "rb": "03_range_bearing_ekf"}


@cache
def solution(sensor):
    """The solution's class KF for a sensor."""
    return load_answer(LAB[sensor], "KF", ROOT / "solutions")


def record(sensor="xy", seed=1, landmarks=25, **options):
    """A run of the handout's robot in the handout's world."""
    return simulate(Robot((2, -2), Q, R[sensor], type=sensor, rng=seed, **options), random_map(landmarks, rng=seed))


def history(log, **told):
    return replay(make_filter(solution(log.sensor), log, **told), log)


def far_from_path(map, distance):
    """The landmarks of a map that the robot on its square passes at `distance` [m] or more."""
    side = np.linspace(-2, 2, 41)
    ends = np.full_like(side, 2.0)
    path = np.concatenate([np.stack(p, axis=1) for p in [(ends, side), (-ends, side), (side, ends), (side, -ends)]])
    return Map(lm for lm in map if np.hypot(*(path - lm.p).T).min() >= distance)
