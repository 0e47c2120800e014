"""What a step of a filter costs in a group of many."""

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from ..geometry import Array, relative
from .pairs import PairFilters
from .world import TeamNoise


def milliseconds(steps: int, *calls: Callable) -> float:
    """Time [ms] of a step that is made of these calls: the best of three means over so many steps."""
    took = []
    for _ in range(3):
        start = time.perf_counter()
        for _ in range(steps):
            for call in calls:
                call()
        took.append(1e3 * (time.perf_counter() - start) / steps)
    return min(took)


def cost(n: int, *joint: tuple[Callable, int]) -> Array:
    """Milliseconds (k + 1,) of a step in which n - 1 robots see robot 0: of k joint filters, then of pair filters.

    joint: (class, the most robots that it is asked for); NaN for more.
    """
    rng, noise = np.random.default_rng(0), TeamNoise()
    x0 = np.column_stack([rng.uniform(-8, 8, (n, 2)), rng.uniform(-3, 3, n)])
    there, u, took = relative(x0[:1], x0[1:]), np.tile([0.05, 0.0, 0.01], (n, 1)), []
    z = np.column_stack([np.hypot(*there[:, :2].T), np.arctan2(there[:, 1], there[:, 0])])
    seen = [(i + 1, 0, reading) for i, reading in enumerate(z)]
    for KF, most in joint:
        took.append(np.nan)
        if n <= most:
            kf = KF(x0.copy(), 0.01 * np.eye(3 * n), noise, gate=np.inf)
            took[-1] = milliseconds(5, partial(kf.predict, u), partial(kf.update, seen))
    pairs, who = PairFilters(there, np.tile(0.01 * np.eye(3), (n - 1, 1, 1)), noise, gate=np.inf), np.arange(n - 1)
    took.append(milliseconds(20, lambda: pairs.predict(u[0], u[1:]), lambda: pairs.update(who, z)))
    return np.array(took)
