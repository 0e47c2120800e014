"""Compare what came with stored numbers, and recognise known mistakes by their numbers."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from ..geometry import Array
from .trace import Trace

TOLERANCE = 2e-3  # of the largest entry of an array: float32 and numerical derivatives pass
TINY = 1e-6  # and this much on top, where all entries should be zero
Value: TypeAlias = str | Array  # what is compared: a text or numbers
Mistake: TypeAlias = Mapping[str, Any]  # {"id", "say", "forms": [{scenario id: stored trace}]}
ANY = "any"  # stored where a mistake fails in a way that differs from one computer to the next


def gap(trace: Trace, stored: Any) -> float:
    """How far a Trace is from a stored one, in tolerances: up to 1 is the same, inf is another shape or ending.

    stored: [steps, key of the stop or None], or ANY; null stands for not-a-number.
    """
    return max(_gaps(trace, stored), default=0.0)


def same(trace: Trace, stored: Any) -> bool:
    """gap(trace, stored) <= 1, found sooner."""
    return all(value <= 1 for value in _gaps(trace, stored))


def _gaps(trace, stored):
    if stored == ANY:
        return
    steps, stop = stored
    if (trace.stop and trace.stop.key) != stop or len(trace.steps) != len(steps):
        yield np.inf
        return
    for mine, right in zip(trace.steps, steps):
        if len(mine) != len(right):
            yield np.inf
            return
        yield from map(gap_of, mine, values(right))


def values(step: Iterable) -> list[Value]:
    """The stored values of one step, with arrays for lists and numbers."""
    return [v if isinstance(v, str) else np.asarray(v, dtype=float) for v in step]


def gap_of(came: Value, right: Value) -> float:
    """The same for two values, each a text or an array."""
    if isinstance(came, str) or isinstance(right, str):
        same = isinstance(came, str) and isinstance(right, str) and came == right
        return 0.0 if same else np.inf
    if came.shape != right.shape or (np.isnan(came) != np.isnan(right)).any():
        return np.inf
    known = ~np.isnan(right)
    if not known.any():
        return 0.0
    limit = TOLERANCE * np.abs(right[known]).max() + TINY
    with np.errstate(over="ignore"):  # of what ran away, beside what is nearly 0
        return float(np.abs(came - right)[known].max() / limit)


def nearest(trace: Trace, accepted: Sequence) -> tuple[float, Any]:
    """The smallest gap to any of the accepted traces, and that trace."""
    gaps = [gap(trace, right) for right in accepted]
    best = int(np.argmin(gaps))
    return gaps[best], accepted[best]


def likeliest(trace: Trace, accepted: Sequence) -> tuple[float, Any]:
    """As `nearest`; where none of them came, the first, which a lab's text asks for, unless more of another's did."""
    near = nearest(trace, accepted)
    if near[0] > 1 and _same_numbers(trace, near[1]) <= _same_numbers(trace, accepted[0]):
        return gap(trace, accepted[0]), accepted[0]
    return near


def _same_numbers(trace, stored):
    pairs = [(c, r) for mine, right in zip(trace.steps, stored[0]) for c, r in zip(mine, values(right))]
    fitting = [(c, r) for c, r in pairs if not isinstance(c, str) and not isinstance(r, str) and c.shape == r.shape]
    return sum(int((np.abs(c - r) <= TOLERANCE * np.abs(r) + TINY).sum()) for c, r in fitting)


def recognise(failed: Mapping[str, Trace], mistakes: Sequence[Mistake]) -> list[tuple[Mistake, bool, set[str]]]:
    """Known mistakes that explain the failed scenarios, the first to fix first: [(mistake, sure, where it fails)].

    A mistake that explains some of them is still sure if others show that there is a second one.

    failed: {id: Trace} of the scenarios that failed, in the order of the check.
    mistakes: [{"id", "say", "forms": [{scenario id: stored trace}]}]; a form lists the scenarios
    where it fails, so a form that fails where the student passes is not the student's.
    """
    found: list[tuple[Mistake, set[str], set[str]]] = []
    for mistake in mistakes:
        for form in mistake["forms"]:
            hits = {s for s, stored in form.items() if s in failed and same(failed[s], stored)}
            if set(form) <= set(failed) and any(form[s] != ANY for s in hits):
                if len(hits) == len(failed):
                    return [(mistake, True, set(form))]
                found.append((mistake, hits, set(form)))
    named: list[tuple[Mistake, bool, set[str]]] = []
    for s in failed:
        covered = set().union(*(where for *_, where in named))
        options = [f for f in found if s in f[1]]
        if s not in covered and options:
            mistake, hits, where = max(options, key=lambda f: (len(f[1]), -len(f[2])))
            most, others = 2 * len(hits) > len(where), set(failed) > where
            if most or next(iter(failed)) in hits:
                named.append((mistake, hits == where or most and others, where))
    return named


def fits(failed: Mapping[str, Trace], form: Mapping[str, Any]) -> bool:
    """Whether just these scenarios failed, each with what is stored; arguments as in `recognise`."""
    return set(form) == set(failed) and all(same(failed[s], form[s]) for s in form)


def entire(failed: Mapping[str, Trace], mistake: Mistake) -> bool:
    """Whether all that a known mistake changes came as it does with that mistake; arguments as in `recognise`."""
    return any(set(form) <= set(failed) and all(same(failed[s], form[s]) for s in form) for form in mistake["forms"])


def exact(failed: set[str], mistake: Mistake) -> bool:
    """Whether a known mistake fails in just these scenarios, and what comes of it is stored for all of them."""
    return any(set(form) == set(failed) and ANY not in form.values() for form in mistake["forms"])
