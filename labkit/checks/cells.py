"""The numbers that a function gave at all inputs of its check, one by one: where each stands, and what came in."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from ..geometry import Array
from . import kinds
from .compare import TINY, TOLERANCE, values
from .hints import call_text

EACH = "each"  # in the parts of a check: the numbers of an array are results for the numbers of its arguments


@dataclass(frozen=True)
class Cell:
    """One number of a result, at one input: `place` is where it stands, (output, off the diagonal, row, column)."""

    place: tuple[str, bool, int, int]
    at: tuple[int, int, tuple[int, ...]]  # scenario, call and block, by count
    label: str  # of its input, as a student would call it
    given: Mapping[str, float] = field(compare=False)  # the single numbers of the arguments, by name: {'x[0]': 0.4}


@dataclass(frozen=True)
class Table:
    """All cells of a check, what is right (N,) and how far (N,) a number may be from it; texts are coded."""

    cells: Sequence[Cell]
    right: Array
    limits: Array
    parts: Mapping[str, Any]
    repeats: frozenset[str]  # outputs that hold several blocks at some input
    words: Mapping[float, str]  # the texts and truth values behind numbers, where results are such

    def wrong(self, came: Array, right: Array) -> NDArray[np.bool_]:
        """Which (N,) of these numbers (N,) are not the same as those (N,)."""
        near = np.isclose(came, right, rtol=TOLERANCE, atol=0, equal_nan=True)
        differ: NDArray[np.bool_] = ~(near | (np.abs(came - right) <= self.limits))
        return differ

    def rank(self, place: tuple) -> int:
        """How many axes the output has to which a place belongs: 0 where each number stands for itself."""
        names = self.parts.get(place[0], ())
        return 0 if isinstance(names, str) else len(names)


def table(data: Mapping[str, Any], right: Mapping[str, Any], came: Mapping[str, Any]) -> Table:
    """The cells of a function's check;  right, came: {scenario id: stored trace}."""
    cells: list[Cell] = []
    limits: list[float] = []
    repeats = set()
    parts = data.get("parts", {})
    for n, s in enumerate(data["scenarios"]):
        if s["id"] not in right:
            continue
        for k, step in enumerate(right[s["id"]][0]):
            given = _given(s["calls"][k], data.get("args", ()))
            title, call = f'"{s["title"]}"', call_text(s, k)
            if len(s["calls"]) > 1:
                title = f"`{call}`" if len(call) < 30 else f"{title} (call {k + 1})"
            for out, value in zip(s["look"], values(step)):
                limit = 0.5 if isinstance(value, str) else TOLERANCE * np.nanmax(np.abs([0, *value.ravel()])) + TINY
                for index in np.ndindex(np.shape(value)):
                    place, block = _place(out, index, np.shape(value), parts.get(out, ()))
                    each = parts.get(out) == EACH
                    at = _each(s["calls"][k], data.get("args", ()), index, np.shape(value)) if each else ({}, "")
                    label = f"{at[1]} in {title}" if at[1] else title
                    if any(block):
                        repeats.add(out)
                        label = f"{title} (no. {block[-1] + 1})"
                    cells.append(Cell(place, (n, k, index if each else block), label, {**given, **at[0]}))
                    limits.append(limit)
    right_numbers = numbers(right[s["id"]][0] for s in data["scenarios"] if s["id"] in right)
    steps = [v for traces in (right, came) for id in right for step in traces[id][0] for v in step]
    words = {float(crc32(v.encode())): f"'{v}'" for v in steps if isinstance(v, str)}
    if any(name.endswith("?") for s in data["scenarios"] for name in s["look"]):
        words = {0.0: "False", 1.0: "True"}
    return Table(cells, right_numbers, np.array(limits), parts, frozenset(repeats), words)


def numbers(traces: Iterable[Sequence]) -> Array:
    """All numbers (N,) of the steps of traces, in the order of `table`; a text is a number of its own."""
    found = [np.ravel(_coded(v)) for steps in traces for step in steps for v in values(step)]
    return np.concatenate(found) if found else np.zeros(0)


def alike(steps: Sequence, right: Sequence) -> bool:
    """Whether the steps of one trace have the kinds and shapes of those."""
    pairs = [(values(a), values(b)) for a, b in zip(steps, right)]
    return len(steps) == len(right) and all(
        isinstance(a, str) == isinstance(b, str) and np.shape(a) == np.shape(b) for x, y in pairs for a, b in zip(x, y)
    )


def _coded(value):
    return float(crc32(value.encode())) if isinstance(value, str) else value


def _place(out, index, shape, names):
    """Where a number stands, (output, off the diagonal, row, column), and in which of several blocks."""
    if isinstance(names, str):
        return (out, False, 0, 0), ()
    size = [len(n) for n in names] if isinstance(names, list) else shape
    block = tuple(i // n for i, n in zip(index, size))
    row, column = ([0, 0] + [i % n for i, n in zip(index, size)])[-2:]
    off = len(set(block)) > 1 and len(shape) == 2 and shape[0] == shape[1]
    return (out, off, row, column), block


def _given(call, args):
    found = {}
    for name, stored in zip(args, call[1:]):
        if isinstance(stored, float | int):
            found[name] = float(stored)
        elif isinstance(stored, list) and np.ndim(stored) == 1 and len(stored) < 5:
            found |= {f"{name}[{i}]": float(v) for i, v in enumerate(stored)}
    return found


def _each(call, args, index, shape):
    """The numbers at the same place in arguments of the same shape, and how to tell them."""
    plain = {name: np.array(v) for name, v in zip(args, call[1:]) if isinstance(v, list | float | int)}
    found = {name: float(v[index]) for name, v in plain.items() if v.shape == shape and (shape or name == args[0])}
    return found, ", ".join(f"{name} = {kinds.number_text(np.array(v))}" for name, v in found.items())
