"""How an answer differs from the right one: a result by how much, a filter's run from which step on."""

import warnings
from typing import Any

import numpy as np

from ...checks.compare import gap_of
from ...checks.trace import OddResultError, as_value
from ...history import History, make_filter, replay

FAR = 100  # [m] no run of a lab leads as far away


def replayed(KF: type, record: Any, options: dict[str, Any]) -> History:
    """The History of a filter class of this process over a log; options: what `labkit.make_filter` takes for it.

    Raises FilterError as `labkit.replay` does.
    """
    with warnings.catch_warnings():  # what is printed to stderr would fail the cell
        warnings.simplefilter("ignore")
        return replay(make_filter(KF, record, **options), record)


def apart(came: Any, right: Any) -> float:
    """How far a result is from the right one, in tolerances: inf where it is of another kind."""
    if isinstance(right, tuple):
        fits = isinstance(came, tuple | list) and len(came) == len(right)
        return max(map(apart, came, right)) if fits else np.inf
    try:
        return gap_of(as_value(came, "the result"), as_value(right, "the result"))
    except OddResultError:
        return np.inf


def first_gap(mine: History, right: History) -> tuple[int, float] | None:
    """(first step that differs, largest distance of the positions [m]), or None where the two agree.

    Means are held against the largest of the run, covariances, which grow and shrink, against their own step's.
    """
    far = gap_of(mine.x, right.x) > 1
    steps = enumerate(zip(mine.x, right.x, mine.P, right.P))
    wrong = [k for k, (x, due_x, P, due_P) in steps if gap_of(P, due_P) > 1 or (far and gap_of(x, due_x) > 1)]
    if not far and not wrong:
        return None
    return (wrong or [0])[0], float(np.linalg.norm((mine.x - right.x)[..., :2], axis=-1).max())


def how_far(distance: float) -> str:
    """How far off an estimate gets, as the end of a sentence; distance: the largest distance of the positions [m]."""
    if not distance < FAR:
        return f": it runs away, to more than {FAR} m"
    return f", by {distance:.2g} m" if distance >= 0.001 else "; the positions agree to the millimetre"
