"""Run a student's function or filter over stored inputs, and keep what came of it."""

import re
import warnings
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from io import StringIO
from typing import Any, TypeAlias

import numpy as np

from ..geometry import Array, wrap
from . import kinds
from .feedback import own_line, sentence

Scenario: TypeAlias = dict[str, Any]  # as stored: an id, a title, calls, what to look at, and the right traces
# What `run` reads of one: whoever runs it elsewhere needs no more, and no less. A probe has "begin" too.
READ = ("look", "make", "calls", "at", "frozen", "turns")
MOST_AXES = 8  # of a result: what has more has grown by mistake


@dataclass
class Stop:
    """Why a scenario ended early: a stored mistake is recognised by `key`, the student reads `text`."""

    key: list  # [number of the call, kind, numbers in the message, the message if it has no numbers]
    text: str
    line: str = ""  # the student's own line, if it raised

    @property
    def call(self) -> int:
        """The number of the call that ended it."""
        return self.key[0]

    @property
    def kind(self) -> str:
        """An exception's name, or one of ODD."""
        return self.key[1]

    @classmethod
    def of(cls, call: int, error: BaseException) -> "Stop":
        """For an exception of the student's code."""
        message = str(error)
        numbers = [int(n) for n in re.findall(r"\d+", message)][:12]
        key = [call, type(error).__name__, numbers, "" if numbers else message[:80]]
        return cls(key, sentence(error), own_line(error))


ODD = ("none", "type", "axes", "count", "missing", "changed")


class OddResultError(Exception):
    """What came back cannot be compared with anything: one of the kinds in ODD; the text says why."""

    def __init__(self, kind: str, text: str) -> None:
        super().__init__(text)
        self.kind = kind


@dataclass
class Trace:
    """What came after each call: a list of values, one for each name that the scenario looks at."""

    steps: list[list] = field(default_factory=list)
    stop: Stop | None = None
    printed: str = ""


def run(subject: Callable, kind: str, scenario: Scenario) -> Trace:
    """The Trace of `subject`, a 'filter' class or a 'function', over one stored scenario.

    Calls count from 0; call 0 of a filter is its constructor.
    """
    trace, printed, call = Trace(), StringIO(), 0
    steps = _filter_steps if kind == "filter" else _function_steps
    with redirect_stdout(printed), warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            for values in steps(subject, scenario):
                if call in scenario.get("at", [call]):
                    trace.steps.append(values)
                call += 1
        except OddResultError as error:
            trace.stop = Stop([call, error.kind, [], ""], str(error))
        except (Exception, SystemExit) as error:
            trace.stop = Stop.of(call, error)
    trace.printed = printed.getvalue()
    return trace


def _filter_steps(KF, scenario):
    given, options = scenario["make"]
    args, watches = _inputs(given.values())
    if not scenario.get("frozen"):  # a filter may go on in the arrays it starts from, as the handout's does
        args = [arg.copy() if name in ("x0", "P0") else arg for name, arg in zip(given, args)]
    kf = _call("`__init__`", KF, args, watches, **options)
    _begin(kf, scenario.get("begin", {}))
    yield _fields(kf, scenario["look"])
    for method, *stored in scenario["calls"]:
        _call(f"`{method}`", getattr(kf, method), *_inputs(stored))
        _unchanged(f"`{method}`", watches)
        yield _fields(kf, scenario["look"])


def _begin(kf, fields):
    """Start a probe from a given estimate, whatever the constructor makes of it."""
    for name, stored in fields.items():
        if not np.array_equal(getattr(kf, name, None), stored):
            setattr(kf, name, np.array(stored, dtype=float))


def _fields(kf, names):
    for name in names:
        if not hasattr(kf, name):
            raise OddResultError("missing", f"The filter has no field `{name}`: set `self.{name} = ...` in `__init__`.")
    return [as_value(getattr(kf, name), f"`{name}`") for name in names]


def _function_steps(function, scenario):
    names = scenario["look"]
    for _, *stored in scenario["calls"]:
        answer = _call("Your function", function, *_inputs(stored))
        if len(names) > 1:
            wanted = f"{len(names)} values ({', '.join(names)})"
            if answer is None:
                raise OddResultError("none", f"It returned None instead of {wanted}: is the `return` missing?")
            if not isinstance(answer, tuple | list) and np.ndim(answer) < 2 or len(answer) != len(names):
                raise OddResultError("count", f"It should return {wanted}, as in `return {', '.join(names)}`.")
        else:
            answer = [answer]
        values = [as_value(v, f"`{n}`" if len(names) > 1 else "The result") for v, n in zip(answer, names)]
        for i in scenario.get("turns", ()):  # places of angles, which are the same a whole turn on
            values = [np.where(np.arange(v.size) == i, wrap(v), v) if np.ndim(v) == 1 else v for v in values]
        yield values


def as_value(raw: Any, name: str) -> str | Array:
    """A copy of `raw` as a text or a float array (...,), infinity as NaN. Raises OddResultError for what is neither."""
    if raw is None:
        hint = (
            "is the `return` missing, or does one return None?"
            if name == "The result"
            else "something without a result was assigned."
        )
        raise OddResultError("none", f"{name} is None: {hint}")
    if isinstance(raw, str):
        return str(raw)
    try:
        array = np.array(raw, dtype=float)
    except (TypeError, ValueError):
        kind = type(raw).__name__
        raise OddResultError("type", f"{name} should be made of numbers, but it is a {kind}: {str(raw)[:60]}") from None
    if array.ndim > MOST_AXES:
        raise OddResultError(
            "axes", f"{name} is an array with {array.ndim} axes: numpy adds one where shapes do not fit each other."
        )
    array[~np.isfinite(array)] = np.nan
    return array


def _inputs(stored):
    args, watches = [], []
    for _, kind, content in map(kinds.split, stored):
        args.append(kind.read(content))
        watches.append(kind.watch(args[-1]))
    return args, watches


def _call(who, function, args, watches, **options):
    try:
        return function(*args, **options)
    finally:  # also after an exception, which a changed input may well explain
        _unchanged(who, watches)


def _unchanged(who, watches):
    for changed in watches:
        if what := changed():
            raise OddResultError("changed", f"{who} {what}. Others still use it: make a new list or array instead.")
