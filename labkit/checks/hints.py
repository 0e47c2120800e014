"""Say in plain words what was asked, what came, and how the two differ."""

from textwrap import wrap
from typing import Any

import numpy as np

from . import kinds
from .compare import gap_of, values
from .feedback import LEFT_OVER
from .kinds import number_text
from .trace import ODD, Scenario, Stop, Trace

WIDTH = 100


def fold(text: str, indent: str = "") -> list[str]:
    """Lines of at most WIDTH characters."""
    return [line for part in text.splitlines() for line in wrap(part, WIDTH, subsequent_indent=indent)]


def evidence(scenario: Scenario, trace: Trace, expected: Any, known: str = "") -> tuple[str, list[str]]:
    """(summary, lines): what is wrong, then the call, what was expected and what came.

    known: what to say about a known mistake; else the summary is what the numbers tell.
    """
    steps = [values(step) for step in expected[0]]
    wrong = next((i for i, (c, r) in enumerate(zip(trace.steps, steps)) if max(map(gap_of, c, r)) > 1), None)
    summary, lines = _stopped(scenario, trace.stop, steps) if wrong is None else _off(scenario, trace, steps, wrong)
    printed = [line[:WIDTH] for line in trace.printed.strip().splitlines()[-3:]]
    return known or summary, lines + _column("printed", printed)


def _stopped(scenario, stop, steps):
    """For a scenario that ended early."""
    told, own = stop.text.splitlines(), [stop.line] * bool(stop.line)
    if stop.kind == "NotImplementedError":
        return todo(stop), [f"  {line}" for line in own]
    call = _column("call", fold(call_text(scenario, stop.call)))
    if stop.kind in ODD:
        return stop.text, call
    at = _calls(scenario, steps)
    asked = _values(scenario["look"], steps[at.index(stop.call)]) if stop.call in at else []
    summary = " ".join([f"Not yet right: {scenario['title']}.", *told[1:]])
    return summary, call + _column("expected", asked) + _column("came", fold(told[0]) + own)


def todo(stop: Stop) -> str:
    """The text of an unfilled stub, as a sentence."""
    text = stop.text.partition("\n")[0]
    return text if text == LEFT_OVER or "still to be written" in text else f"Still to be written: {text}"


def _off(scenario, trace, steps, i):
    """For a scenario whose i-th stored step came out with other values."""
    names, came, right = scenario["look"], trace.steps[i], steps[i]
    before = steps[i - 1] if i and "make" in scenario and "at" not in scenario else None
    which = [j for j in range(len(names)) if gap_of(came[j], right[j]) > 1]
    call = call_text(scenario, _calls(scenario, steps)[i])
    method = call.split("(")[0]
    hint = _hint(which, came, right, before, names, method)
    shown = [names[j] for j in which]
    return f"Not yet right: {scenario['title']}. {hint}".strip(), [
        *_column("before", _values(names[:2], before) + noise_text(scenario, method) if before else []),
        *_column("call", fold(call)),
        *_column("expected", _values(shown, [right[j] for j in which], [came[j] for j in which])),
        *_column("came", _values(shown, [came[j] for j in which], [right[j] for j in which])),
    ]


def _calls(scenario, steps):
    """The number of the call that each stored step belongs to."""
    return list(scenario.get("at", range(len(steps))))


def _column(title, lines):
    return [f"  {title if i == 0 else '':9} {line}" for i, line in enumerate(lines)]


def _values(names, arrays, others=None):
    """others: the arrays that these are to be compared with, where there are such."""
    texts = [_value(name, v, w) for name, v, w in zip(names, arrays, others or [None] * len(arrays))]
    return [line for text in texts for line in fold(text)]


def _value(name, v, other=None):
    if name.endswith("?"):
        return f"{bool(v)}"
    if np.ndim(v) == 2 and v.shape[0] == v.shape[1] > 4:  # too many numbers to read
        if np.shape(other) == v.shape and gap_of(np.diag(v), np.diag(other)) <= 1:
            i, j = np.unravel_index(np.abs(v - other).argmax(), v.shape)
            return f"{name}[{i}, {j}] = {number_text(v[i, j])} (the diagonal is right)"
        return f"diagonal of {name} = {number_text(np.diag(v))}"
    size = 0.0 if other is None or isinstance(other, str) else np.nanmax(np.abs([0, *np.ravel(other)]))
    return (f"{name} = " if name else "") + number_text(v, size=size)


def call_text(scenario: Scenario, call: int) -> str:
    """The call as a student would type it, with its numbers: 'predict([0.4, -0.6]) with dt=0.25'."""
    options = ""
    if "make" in scenario:
        given, more = scenario["make"]
        options = ", ".join(f"{name}={value}" for name, value in more.items())
        if call == 0:
            return f"__init__({', '.join([*given, options] if options else given)})"
        call -= 1
    name, *args = scenario["calls"][call]
    told = [kind.tell(content) for _, kind, content in map(kinds.split, args)]
    return f"{name}({', '.join(told)})" + (f" with {options}" if options else "")


def noise_text(scenario: Scenario, method: str) -> list[str]:
    """The noise that `predict` or `update` uses, from the right constructor: ['R = [[0.16, ...']."""
    given, options = scenario["make"]
    told = [kind.noise(content, method) for _, kind, content in map(kinds.split, given.values())]
    if method == "predict" and "Q" in given:
        told += _values(["Q"], [np.array(given["Q"]) * options["dt"]])
    if method == "update" and "R" in given:
        told += _values(["R"], [np.array(given["R"]) / options["dt"]])
    return list(filter(None, told))


def _hint(which, came, right, before, names, method):
    """One sentence on how the values that differ do so, or ''."""
    i = which[0]
    name = names[i] or "The result"
    hint = _compare(came[i], right[i], name)
    if before is not None and gap_of(came[i], before[i]) <= 1:
        return f"`{method}` leaves {name} as it was: is the new value assigned to `self.{name}`?"
    if hint or before is None or len(which) == len(names) or len(names) != 2:
        return hint
    if i == 0:
        return f"{names[1]} is right, so look at the innovation, the gain and the line that sets {names[0]}."
    return f"{names[0]} is right, so look at the line that sets {names[1]}."


def _compare(came, right, name):
    if isinstance(came, str) or isinstance(right, str):
        if not (isinstance(came, str) and isinstance(right, str)):
            return f"{name} should be a {'text' if isinstance(right, str) else 'number'}."
        return "Only the spelling differs." if came.strip().lower() == right.lower() else ""
    if came.shape != right.shape:
        return _shapes(came, right, name)
    if np.isnan(came).any():
        return "NaN means 'not a number': look for a division by zero, or the root of a negative number."
    top = np.unravel_index(np.abs(right).argmax(), right.shape)
    factor = came[top] / right[top] if right[top] else 0
    if abs(factor) > 1e-9 and gap_of(came, factor * right) <= 1:
        if abs(factor + 1) < 1e-3:
            return f"{name} has the other sign."
        return f"{name} is {factor:.4g} times the expected value." if right.size > 1 else ""
    if right.ndim == 2 and gap_of(came, right.T) <= 1:
        return f"{name} is the transpose of what was expected."
    if right.size > 1 and gap_of(np.sort(came, axis=None), np.sort(right, axis=None)) <= 1:
        return f"The numbers of {name} are right, but in another order."
    if right.ndim == 2 and gap_of(right, right.T) <= 1 and gap_of(came, came.T) > 1:
        return f"{name} should be symmetric, as every covariance is: is there a transpose missing?"
    return ""


def _shapes(came, right, name):
    text = f"{name} should have the shape {right.shape}, but it has {came.shape}"
    if right.ndim == 0:
        return f"{name} should be a single number, but it is an array of shape {came.shape}."
    if right.ndim == 1 and came.size == right.size:
        return f"{text}: keep vectors one-dimensional (`np.concatenate` or `.ravel()`)."
    if right.ndim == 1 and came.ndim == 2:
        return f"{text}: (n,) + (n, 1) makes a matrix, and so does `*` where `@` is meant."
    return f"{text}: it lies on its side." if came.shape == right.shape[::-1] else f"{text}."
