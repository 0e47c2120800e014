"""Run a student's function or filter over stored inputs, and keep what came of it."""

import re
import warnings
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from io import StringIO

import numpy as np

from ..world import Landmark, Map
from .feedback import own_line, sentence


@dataclass
class Stop:
    """Why a scenario ended early: a stored mistake is recognised by `key`, the student reads `text`."""

    key: list  # [number of the call, kind, numbers in the message, the message if it has no numbers]
    text: str
    line: str = ""  # the student's own line, if it raised

    @property
    def call(self):
        return self.key[0]

    @property
    def kind(self):
        return self.key[1]

    @classmethod
    def of(cls, call, error):
        message = str(error)
        numbers = [int(n) for n in re.findall(r"\d+", message)][:12]
        key = [call, type(error).__name__, numbers, "" if numbers else message[:80]]
        return cls(key, sentence(error), own_line(error))


ODD = ("none", "type", "count", "missing", "changed")


class OddResultError(Exception):
    """What came back cannot be compared with anything: one of the kinds in ODD; the text says why."""

    def __init__(self, kind, text):
        super().__init__(text)
        self.kind = kind


@dataclass
class Trace:
    """What came after each call: a list of values, one for each name that the scenario looks at."""

    steps: list = field(default_factory=list)
    stop: Stop | None = None
    printed: str = ""


def run(subject, kind, scenario):
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
    args, options = scenario["make"]
    args, marks = _inputs(args)
    kf = _call("`__init__`", KF, args, marks, **options)
    yield _fields(kf, scenario["look"])
    for method, *stored in scenario["calls"]:
        more, more_marks = _inputs(stored)
        _call(f"`{method}`", getattr(kf, method), more, more_marks)
        _unchanged(f"`{method}`", args, marks)
        yield _fields(kf, scenario["look"])


def _fields(kf, names):
    for name in names:
        if not hasattr(kf, name):
            raise OddResultError("missing", f"The filter has no field `{name}`: set `self.{name} = ...` in `__init__`.")
    return [as_value(getattr(kf, name), f"`{name}`") for name in names]


def _function_steps(function, scenario):
    names = scenario["look"]
    for _, *stored in scenario["calls"]:
        args, marks = _inputs(stored)
        answer = _call("Your function", function, args, marks)
        if len(names) > 1:
            wanted = f"{len(names)} values ({', '.join(names)})"
            if answer is None:
                raise OddResultError("none", f"It returned None instead of {wanted}: is the `return` missing?")
            if not isinstance(answer, tuple | list) and np.ndim(answer) < 2 or len(answer) != len(names):
                raise OddResultError("count", f"It should return {wanted}, as in `return {', '.join(names)}`.")
        else:
            answer = [answer]
        yield [as_value(v, f"`{n}`" if len(names) > 1 else "The result") for v, n in zip(answer, names)]


def as_value(raw, name):
    """A copy of `raw` as a text or a float array; not-a-number and infinity both count as NaN."""
    if raw is None:
        hint = "is the `return` missing?" if name == "The result" else "something without a result was assigned."
        raise OddResultError("none", f"{name} is None: {hint}")
    if isinstance(raw, str):
        return str(raw)
    try:
        array = np.array(raw, dtype=float)
    except (TypeError, ValueError):
        kind = type(raw).__name__
        raise OddResultError("type", f"{name} should be made of numbers, but it is a {kind}: {str(raw)[:60]}") from None
    array[~np.isfinite(array)] = np.nan
    return array


def decode(stored):
    """A stored input as the object that a student's code gets.

    Arrays are read-only: changing one in place raises at the student's own line.
    """
    if isinstance(stored, list):
        return _frozen(stored)
    if isinstance(stored, dict):
        ((kind, content),) = stored.items()
        return _DECODE[kind](content)
    return stored


def _frozen(numbers, dtype=float):
    array = np.array(numbers, dtype=dtype)
    array.setflags(write=False)
    return array


def _landmark(stored):
    name, *p = stored
    return Landmark._of(_frozen(p), name)


def _noise(stored):
    from ..legged.noise import Noise  # lab 4's; the other labs do without

    return Noise(**stored)


def _sights(stored):
    from ..legged.robot import Sighting

    sights = [Sighting(p, name, complete) for name, *p, complete in stored]
    for sight in sights:
        sight.p.setflags(write=False)
    return sights


def _team_noise(stored):
    from ..team.hall import TeamNoise

    return TeamNoise(**stored)


_DECODE = {
    "team_noise": _team_noise,
    "readings": lambda stored: tuple((i, j, _frozen(z)) for i, j, *z in stored),
    "noise": _noise,
    "sights": _sights,
    "landmark": _landmark,
    "landmarks": lambda stored: [_landmark(lm) for lm in stored],
    "map": lambda stored: Map(_landmark(lm) for lm in stored),
    "ints": lambda stored: _frozen(stored, int),
}


def _inputs(stored):
    args = [decode(value) for value in stored]
    return args, [_mark(arg) for arg in args]


def _mark(arg):
    """What must stay as it is in an input; the arrays need no watch, they are read-only."""
    landmarks = [arg] if isinstance(arg, Landmark) else arg if isinstance(arg, list) else []
    return [(lm, lm.p, lm.id) for lm in landmarks]


def _call(who, function, args, marks, **options):
    try:
        return function(*args, **options)
    finally:  # also after an exception, which a changed input may well explain
        _unchanged(who, args, marks)


def _unchanged(who, args, marks):
    for arg, mark in zip(args, marks):
        if isinstance(arg, list) and not (len(arg) == len(mark) and all(a is m[0] for a, m in zip(arg, mark))):
            what = f"changes the {'map' if isinstance(arg, Map) else 'list of landmarks'} that it was given"
        elif not all(lm.p is p and lm.id == name for lm, p, name in mark):
            what = "puts other values into a Landmark that it was given"
        else:
            continue
        raise OddResultError("changed", f"{who} {what}. Others still use it: make a new list or array instead.")
