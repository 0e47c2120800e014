"""Whether a filter for a team does the same as another one: asked step by step, so that a difference has a place."""

from collections.abc import Callable, Iterator, Sequence
from itertools import product

import numpy as np

from ..geometry import Array, compose, relative
from .world import TeamNoise

POSES = np.array([[0.5, -1.0, 0.7], [2.5, 1.0, -2.2], [-1.5, 2.0, 1.9]])  # [m, m, rad], along no axis
STEP = np.array([[0.3, 0.05, 0.2], [0.2, 0.0, -0.3], [0.1, -0.02, 0.25]])  # [m, m, rad]
NAMES = ("x", "y", "heading")


def compare(KF: Callable, like: Callable) -> None:
    """Print, for each of a few steps, whether a filter comes to the same x, P and d2 as another one that is `like` it.

    KF, like: classes, made as KF(x0 (n, 3), P0 (3n, 3n), noise, ...), with `predict`, `update`, x, P and d2.
    One reading at most is used at a time, so that it does not matter whether they are taken one after the other.
    """
    for name, poses, calls, what in _steps():
        mine, right = (_after(cls, poses, calls) for cls in (KF, like))
        off = [part for part in what if not _same(mine[part], right[part], part)]
        told = "the same" if not off else ", ".join(_where(mine[part], right[part], part) for part in off)
        print(f"{name:28s} {', '.join(what):8s} {told}")


def _steps() -> Iterator[tuple[str, Array, Sequence, Sequence[str]]]:
    """(name, poses to start from, calls, what is compared after them)."""
    yield "a step of odometry", POSES, [("predict", STEP)], ("x", "P")
    yield "nothing in view", POSES, [("update", [])], ("x", "P")
    exact = _reading(POSES, 1, 2)
    yield "a reading just as expected", POSES, [("update", [(1, 2, exact)])], ("P", "d2")
    yield "one a little off", POSES, [("update", [(1, 2, exact + [0.02, -0.01])])], ("x", "d2")
    behind = POSES.copy()
    behind[2] = compose(behind[1], np.array([-2.0, -0.004, 0.3]))  # just right of straight behind robot 1
    seen = _reading(behind, 1, 2) + [0.01, 2 * np.pi - 0.01]
    yield "one over the half turn", behind, [("update", [(1, 2, seen)])], ("x", "d2")
    far = (1, 2, exact + [2.0, 0.0])
    yield "one beyond the gate", POSES, [("update", [far])], ("x", "P", "d2")
    good = (0, 2, _reading(POSES, 0, 2) + [0.02, 0.01])
    yield "the same, beside a good one", POSES, [("update", [far, good])], ("x", "d2")


def _reading(poses, i, j):
    """What robot i should see of robot j (2,): range [m] and bearing [rad]."""
    x, y, _ = relative(poses[j], poses[i])
    return np.array([np.hypot(x, y), np.arctan2(y, x)])


def _after(KF, poses, calls):
    root = 0.02 * np.random.default_rng(3).standard_normal((9, 9))
    kf = KF(poses.copy(), root @ root.T, TeamNoise())
    for method, given in calls:
        getattr(kf, method)(given.copy())
    found = {"x": np.array(kf.x, dtype=float), "P": np.array(kf.P, dtype=float)}
    return found | {"d2": np.array(getattr(kf, "d2", []), dtype=float)}


def _same(mine, right, part):
    """Whether two results are; x may differ by 2 mm, since a filter that is invariant goes along an arc."""
    if mine.shape != right.shape:
        return False
    least = {"x": 2e-3, "P": 1e-9, "d2": 1e-9}[part]
    return np.allclose(mine, right, rtol=1e-6, atol=least)


def _where(mine, right, part):
    """What differs, in words."""
    if mine.shape != right.shape:
        return f"{part} has {mine.size} numbers, not {right.size}"
    if part != "P":
        return f"{part} differs by up to {np.abs(mine - right).max():.2g}"
    n = len(mine) // 3
    wrong = ~np.isclose(mine, right, rtol=1e-6, atol=1e-9).reshape(n, 3, n, 3)
    own, between = wrong[range(n), :, range(n)].any(axis=0), (wrong & ~np.eye(n, dtype=bool)[:, None, :, None])
    places = [("of one robot", own), ("between two", between.any(axis=(0, 2)))]
    said = [f"{_pairs(where)} {name}" for name, where in places if where.any()]
    return f"P differs: {'; '.join(said)}"


def _pairs(where):
    """'x-x, x-heading' of a table (3, 3)."""
    if where.all():
        return "everywhere"
    return ", ".join(f"{NAMES[a]}-{NAMES[b]}" for a, b in product(range(3), repeat=2) if where[a, b])
