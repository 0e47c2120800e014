"""How an answer differs from the right one: a result by how much, a filter's run from which step on."""

import warnings
from typing import Any

import numpy as np

from ...checks.compare import gap_of
from ...checks.trace import OddResultError, as_value
from ...history import History, make_filter, replay


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


def same_run(mine: History, right: History) -> bool:
    """Whether two runs agree.

    Means are held against the largest of the run, covariances, which grow and shrink, against their own step's.
    """
    return gap_of(mine.x, right.x) <= 1 and all(gap_of(P, due) <= 1 for P, due in zip(mine.P, right.P, strict=True))
