"""Run any localizers over the same logs, and compare how well, how soon and how cheaply they find the robot."""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry import Array, wrap
from ..history import made, replay
from ..metrics import errors as errors_of
from .robot import FieldLog

SETTLED = 100  # steps after which a localizer that started from nothing should know where it is


@dataclass(frozen=True)
class Result:
    """What came of one localizer in a race of `runs` logs of N steps.

    distance, turned (runs, N+1): error of the position [m] and, without sign, of the heading [rad].
    sure (runs, N+1): whether the localizer's own standard deviation of the position is below a metre; what
    happens to lie near the truth without that is no estimate, and the robot not found.
    seconds: computing time per step;  kidnapped: the step at which the robot was carried away, or None.
    """

    name: str
    distance: Array
    turned: Array
    sure: NDArray[np.bool_]
    seconds: float
    kidnapped: int | None

    @property
    def tracking(self) -> Array:
        """The distances (runs, steps) [m] between the settled start and the kidnapping."""
        return self.distance[:, SETTLED + 1 : None if self.kidnapped is None else self.kidnapped + 1]

    def found(self) -> Array:
        """Steps (runs,) from the start until the robot is found; NaN where it is not before it is carried away."""
        return self._found_after(0, self.kidnapped)

    def recovered(self) -> Array:
        """The same (runs,) from the kidnapping on; raises ValueError if there was none."""
        if self.kidnapped is None:
            raise ValueError("nobody was carried away in this race: give it logs recorded with a kidnapping")
        return self._found_after(self.kidnapped)

    def _found_after(self, step, end=None):
        known = np.where(self.sure, self.distance, np.inf)
        return np.array([steps_until_found(d[step + 1 : None if end is None else end + 1]) for d in known])


def steps_until_found(distance: Array, within: float = 0.3, hold: int = 10) -> float:
    """Steps until the error (N,) [m] stays below `within` for `hold` steps; NaN if it never does."""
    if len(distance) < hold:
        return np.nan
    good = np.convolve(distance < within, np.ones(hold, dtype=int), mode="valid") == hold
    return float(good.argmax() + 1) if good.any() else np.nan


def race(
    contestants: Mapping[str, Callable[[FieldLog], Any]],
    logs: Iterable[FieldLog],
    progress: Callable[[Sequence[FieldLog]], Iterable[FieldLog]] = iter,
) -> list[Result]:
    """A Result for each contestant {name: make}; make(log) gives a fresh localizer for a log.

    logs: of the same length, with the robot carried away at the same step, or in none.
    progress: wraps the logs, as `labkit.progress` does.
    """
    logs = list(logs)
    if not logs or not contestants:
        raise ValueError(f"a race needs at least one of each, but {'logs' if not logs else 'contestants'} is empty")
    lengths, kidnapped = {len(log) for log in logs}, {log.kidnapped for log in logs}
    if len(lengths) != 1 or len(kidnapped) != 1:
        raise ValueError("a race needs logs of one length, with a kidnapping at the same step or without one")
    steps = next(iter(kidnapped))
    errors: dict[str, list] = {name: [] for name in contestants}
    sure: dict[str, list] = {name: [] for name in contestants}
    seconds = dict.fromkeys(contestants, 0.0)
    for log in progress(logs):
        for name, make in contestants.items():
            start = time.perf_counter()
            history = replay(made(partial(make, log)), log)
            seconds[name] += time.perf_counter() - start
            errors[name].append(errors_of(history, log))
            sure[name].append(history.sound()[:, 0, 0] + history.P[:, 1, 1] < 1)
    total = len(logs) * len(logs[0])
    ends = steps[0] if steps else None
    return [
        Result(
            name,
            np.hypot(e[..., 0], e[..., 1]),
            abs(wrap(e[..., 2])),
            np.array(sure[name]),
            seconds[name] / total,
            ends,
        )
        for name, e in ((name, np.array(e)) for name, e in errors.items())
    ]


def table(results: Sequence[Result]) -> str:
    """The figures of a race as lines of text."""
    cost = np.array([r.seconds for r in results])
    lines = [
        "                       tracking [cm]   found from nothing [s]  after a kidnapping [s]  time per step",
        "                        mean   95 %    median  95 %   runs     median  95 %   runs     [ms]  relative",
    ]
    for r, relative in zip(results, cost / cost[0]):
        d = 100 * r.tracking
        near = f"{d.mean():6.1f} {np.percentile(d, 95, axis=1).mean():6.1f}" if d.size else "     -      -"
        start = "      (is told it)    " if r.sure[:, 0].all() else _times(r.found())
        kidnap = _times(r.recovered()) if r.kidnapped is not None else " " * 22
        lines.append(f"{r.name:21s} {near}    {start}   {kidnap}   {1e3 * r.seconds:5.3f} {relative:7.1f}")
    return "\n".join([*lines, *_BELOW])


_BELOW = (
    "tracking: the error from 10 s on, until the kidnapping.  95 %: not exceeded in 95 % of the steps, or of the runs",
    "that found the robot; these are so many of all.  found: within 30 cm for a second, and sure of it (its own",
    "standard deviation is below 1 m); from nothing: before the kidnapping.  relative: to the first line.",
)


def _times(steps):
    known = steps[np.isfinite(steps)] / 10
    share = 100 * len(known) / len(steps)
    if not len(known):
        return f"     -     - {share:5.0f} %  "
    return f"{np.median(known):6.1f}{np.percentile(known, 95):6.1f} {share:5.0f} %  "
