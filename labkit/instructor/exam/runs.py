"""How an answer differs from the right one: a result by how much, a filter's run from which step on."""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest
from typing import Any

import numpy as np

from ...checks.compare import TOLERANCE, gap_of
from ...checks.trace import OddResultError, as_value, run
from ...geometry import Array, wrap
from ...history import History, make_filter, replay
from ...log import Log
from ...world import places, sensed

# times as far apart as known right ones are, one step in another order may be; mistakes are by 11 and more
SPREAD = 7.0
ALL_ORDERS = 3  # of so many landmarks all orders are known
STEP = 1e-5  # what one step may be off by rounding
BELIEVABLE = 6.0  # d2 of a measurement that a gate at 3 sigma, which is 9, lets pass whatever comes before it


def replayed(KF: type, record: Any, options: dict[str, Any]) -> History:
    """The History of a filter class of this process over a log; options: what `labkit.make_filter` takes for it.

    Raises FilterError as `labkit.replay` does.
    """
    with warnings.catch_warnings():  # what is printed to stderr would fail the cell
        warnings.simplefilter("ignore")
        return replay(make_filter(KF, record, **options), record)


def apart(came: Any, right: Any, turns: int | None = None) -> float:
    """How far a result is from the right one, in tolerances: inf where it is of another kind; turns: as `Exam.same`."""
    if isinstance(right, tuple):
        fits = isinstance(came, tuple | list) and len(came) == len(right)
        return max(map(apart, came, right)) if fits else np.inf
    try:
        came, right = as_value(came, "the result"), as_value(right, "the result")
        if turns is not None and np.shape(came) == np.shape(right):
            came[turns] = right[turns] + wrap(came[turns] - right[turns])
        return gap_of(came, right)
    except OddResultError:
        return np.inf


def same_run(mine: History, right: History) -> bool:
    """Whether two runs agree.

    Means are held against the largest of the run, covariances, which grow and shrink, against their own step's.
    """
    return gap_of(mine.x, right.x) <= 1 and all(gap_of(P, due) <= 1 for P, due in zip(mine.P, right.P, strict=True))


class Steps:
    """Whether a run takes each of its steps as one of several right filters does from the same estimate.

    rights: the filters, in which landmarks are taken in one order or another;  record, options: as of `replayed`.
    Runs themselves drift apart, since an extended filter that takes landmarks one by one linearises in other places.
    """

    def __init__(self, rights: Sequence[type], record: Any, options: dict[str, Any]) -> None:
        self._fields, self._gated = record.fields, "gate" in options
        self._filters = [make_filter(KF, record, **options) for KF in rights]
        self._kept: list[bool] = []
        self._watch = make_filter(_watched(rights[0], self._kept), record, **options)

    def starts(self, x: Array, P: Array) -> bool:
        """Whether a mean x (n,) and its covariance P (n, n) are those with which a run should start."""
        return all(gap_of(*pair) <= 1 for pair in zip((x, P), self._of(self._filters[0])))

    def judge(self, mine: History, record: Any) -> tuple[bool, bool]:
        """(whether a run starts where it should and all of its steps are right, whether the first that is not may be
        so for a gate of the filter's own).
        """
        ends = list(zip(mine.x, mine.P))
        if not self.starts(*ends[0]):
            return False, False
        for before, u, y, after in zip(ends, record.controls, record.measurements(), ends[1:]):
            if not self.follows(before, u, y, after):
                return False, self.is_far(before, u, y)
        return True, False

    def is_far(self, before: tuple[Array, Array], u: Array, y: list) -> bool:
        """Whether a gate might leave out something seen after u (m,), from a mean (n,) and covariance (n, n)."""
        if self._gated or not isinstance(y, list):
            return False
        self._kept.clear()
        self._step(self._watch, before, u, y)
        return not all(self._kept)

    def follows(self, before: tuple[Array, Array], u: Array, y: list, after: tuple[Array, Array]) -> bool:
        """Whether u (m,), and what is seen after it, lead from one mean (n,) and covariance (n, n) to others."""
        found = []
        for kf in self._filters:
            self._step(kf, before, u, y)
            found.append(self._of(kf))
            if _near(before, after, found[:1] + found[-1:], 0):
                return True
        return len(y) > ALL_ORDERS and len(found) > 2 and _near(before, after, found, SPREAD)

    def _step(self, kf, before, u, y):
        for field, value in zip(self._fields, before):
            setattr(kf, field, value.copy())
        kf.predict(u)
        kf.update(y)

    def _of(self, kf):
        return [np.array(getattr(kf, field), dtype=float) for field in self._fields]


def _near(before, after, rights, spread):
    """Whether an estimate is the last of the right ones; or with a spread, so many times as far off as they are."""
    (start, _), (x, P) = before, after
    for came, size, right in ((x, x - start, [r[0] for r in rights]), (P, P, [r[1] for r in rights])):
        limit = TOLERANCE * np.abs(size).max() + STEP + spread * np.ptp(right, axis=0).max()
        if not np.abs(came - right[0 if spread else -1]).max() <= limit:
            return False
    return True


def believable_log(KF: type, record: Any, options: dict[str, Any]) -> Any:
    """A log whose measurements are all near what the right filter expects: none that a gate of 3 sigma leaves out.

    KF: the right filter;  options: as of `replayed`. What is far is measured without noise, or if that is no nearer,
    left out. Logs whose filters are told a gate stay as they are.
    """
    if not isinstance(record, Log) or not len(record.seen) or "gate" in options:
        return record
    if not (fits := _fits(KF, record, options)).all() and record.truth is not None:
        offsets = places(record.map, record.seen_id) - record.truth[record.seen_step + 1, :2]
        exact = sensed(offsets, record.sensor)
        record = replace(record, seen=np.where(fits[:, None], record.seen, exact))
        fits = _fits(KF, record, options)
    return record if fits.all() else replace(record, **{name: getattr(record, name)[fits] for name in SEEN})


class Believable:
    """`believable_log`, which remembers the log that it was asked for last."""

    def __init__(self) -> None:
        self._last: tuple[list, tuple] = [], ()  # the filter and the options; the log, and what of it is believable

    def __call__(self, KF: type, record: Any, options: dict[str, Any]) -> Any:
        """As `believable_log`."""
        asked, (before, logs) = [KF, *options, *options.values()], self._last
        if not any(record is log for log in logs) or any(a is not b for a, b in zip_longest(asked, before)):
            logs = record, believable_log(KF, record, options)
            self._last = asked, logs
        return logs[-1]


SEEN = ("seen_step", "seen_id", "seen")


def _fits(KF, record, options):
    kept: list[bool] = []
    replayed(_watched(KF, kept), record, options)
    return np.array(kept, dtype=bool)


def believable_calls(KF: type, scenario: dict[str, Any]) -> dict[str, Any]:
    """A stored drive, as `believable_log`; what has few calls is there for its measurements, and stays."""
    if "at" not in scenario or "make" not in scenario or "gate" in scenario["make"][1]:
        return scenario
    kept: list[bool] = []
    if run(_watched(KF, kept), "filter", scenario).stop:
        return scenario
    calls = []
    for method, *args in scenario["calls"]:
        if method == "update":
            ((kind, entries),) = args[0].items()
            args = [{kind: [entry for entry in entries if kept.pop(0)]}]
        calls.append([method, *args])
    return {**scenario, "calls": calls}


def _watched(KF, kept):
    """A filter that takes one landmark after the other, and notes for each whether it is where it may be expected."""

    class Watched(KF):
        def update(self, y):
            if hasattr(self, "d2") or not y:
                kept.extend([True] * len(y))
                super().update(y)
                return
            before = start = self.xk_k, self.Pk_k
            fits = []
            for lm in y:  # whether it is looked at alone, or after those before it
                fits.append(self._surprise(lm, *start) < BELIEVABLE and self._surprise(lm, *before) < BELIEVABLE)
                before = (self.xk_k, self.Pk_k) if fits[-1] else before
            self.xk_k, self.Pk_k = start
            super().update([lm for lm, so in zip(y, fits) if so])
            kept.extend(fits)

        def _surprise(self, lm, x, P):
            """The d2 of one landmark, read off what an update with it alone does."""
            self.xk_k, self.Pk_k = x.copy(), P.copy()
            super().update([lm])
            moved = self.xk_k - x
            return moved @ np.linalg.pinv(P - self.Pk_k) @ moved

    return Watched
