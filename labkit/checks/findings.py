"""What the probing of a filter found: one wrong quantity each, and the words for how it is wrong."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..geometry import Array
from .kinds import number_text
from .probing import Answer
from .trace import Scenario

CLOSE = 5e-3  # of the largest entry: what is read off differences of results in single precision is no better

MOST = 4  # columns of a matrix that is shown whole


@dataclass(frozen=True, eq=False)
class Finding:
    """One wrong quantity: its name, the sentence about it, and numbers by which a known mistake is known again."""

    part: str
    text: str
    value: list[Any] = field(default_factory=list)


@dataclass(frozen=True)
class Probed:
    """Probes by their names, the student's answers to them, the right ones, and what rows of a measurement are."""

    probes: Mapping[str, Scenario]
    mine: Mapping[str, Answer]
    right: Mapping[str, Answer]
    rows: Sequence[str]
    x: str
    P: str
    stops: Mapping[str, str]  # what a probe was ended by, in a sentence
    known: Mapping[str, list] = field(default_factory=dict)  # by part: the numbers that known mistakes show there
    fine: list[str] = field(default_factory=list)  # what of `update` was found right

    def both(self, start: str) -> dict[str, tuple[Answer, Answer]]:
        """{id: (the student's answer, the right one)} of the probes whose names begin so and that were answered."""
        return {id: (self.mine[id], self.right[id]) for id in self.right if id.startswith(start) and id in self.mine}


def close(a: Any, b: Any, limit: float = CLOSE) -> bool:
    """Whether two arrays (...,) are the same, but for a part of the second's largest entry."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    return a.shape == b.shape and bool(np.abs(a - b).max(initial=0.0) <= limit * np.abs(b).max(initial=0.0) + 1e-6)


def alike(a: Sequence[Any], b: Sequence[Any]) -> bool:
    """Whether all of these arrays (...,) are close to those."""
    return len(a) == len(b) and all(close(one, other, 2e-3) for one, other in zip(a, b))


def acts(came: Array, right: Array, trait: str = "") -> str:
    """'acts as [1, 2], right is [3, 4]', arrays (...,), with what else is known of the two."""
    size = 1e4 * max(np.abs(came).max(initial=0.0), np.abs(right).max(initial=0.0))  # it is read off differences
    told = beside(came, right, size)
    alike = len(set(told.split(", right is "))) == 1  # what differs is left out of the middle
    if np.ndim(came) == 2 and came.shape == right.shape and (alike or came.shape[1] > MOST):
        i = int(np.abs(came - right).max(axis=1).argmax())
        told = f"{beside(came[i], right[i], size)}, in row {i + 1}"
    return f"acts as {told}" + (f" ({trait})" if trait else "")


def beside(came: Array, right: Array, size: float = 0.0) -> str:
    """'[1, 2], right is [3, 4]', arrays (...,); of what is nothing beside the largest of both, or this size, 0."""
    size = np.nanmax(np.abs([size, *np.ravel(came), *np.ravel(right)]))
    return f"{number_text(came, size=size)}, right is {number_text(right, size=size)}"


def trait(
    came: Sequence[Array], right: Sequence[Array], seconds: Sequence[float] = (), ranges: Sequence[float] = ()
) -> str:
    """How arrays (...,) differ from the right ones, in the same way each time: 'the other sign', 'times dt'; or ''.

    seconds: the length of a step dt at each of them;  ranges: that of a landmark [m].
    """
    factors = [_factor(c, r) for c, r in zip(came, right)]
    if not factors:
        return ""
    if all(f is not None for f in factors):
        for values, name in ((seconds, "dt"), (ranges, "the range")):
            for power, words in _POWERS.items():
                if len(set(values)) > 1 and close(factors, [value**power for value in values]):
                    return words.format(name)
        if close(factors, [factors[0]] * len(factors)):
            return _times(factors[0])
    for words, change in _CHANGES.items():
        if all(close(c, change(np.asarray(r))) and not close(c, r) for c, r in zip(came, right)):
            return words
    return ""


def _square(change):
    return lambda r: change(r) if r.ndim == 2 and r.shape[0] == r.shape[1] else np.full(0, np.nan)


def _pair(*signs):
    return lambda r: r * signs if r.shape == (2,) else np.full(0, np.nan)


_POWERS = {1: "times {}", -1: "divided by {}", 2: "times {} twice", -2: "divided by {} twice"}
_CHANGES = {
    "transposed": _square(lambda r: r.T),
    "its diagonal only": _square(lambda r: np.diag(np.diag(r))),
    "squared": _square(lambda r: r @ r),
    "its rows are exchanged": _square(lambda r: r[::-1]),
    "its columns are exchanged": _square(lambda r: r[:, ::-1]),
    "its two numbers are exchanged": lambda r: r[::-1] if r.shape == (2,) else np.full(0, np.nan),
    "its first number has the other sign": _pair(-1, 1),
    "its second number has the other sign": _pair(1, -1),
}


def _factor(came, right):
    """F where came is f times right in two numbers or more, else None."""
    came, right = np.ravel(came), np.ravel(right)
    big = np.abs(right) > 1e-3 * np.abs(right).max(initial=0.0)
    if came.shape != right.shape or big.sum() < 2:
        return None
    f = float(came @ right / (right @ right))
    return f if close(came, f * right) else None


def _times(f):
    if abs(f) < 1e-3:
        return "nothing at all"
    if abs(f + 1) < 1e-3:
        return "the other sign"
    return f"{f:.3g} times as much"
