"""What a worker is told of a check, and what it may answer."""

from collections.abc import Callable, Mapping
from typing import Any, NoReturn

import numpy as np

from ...checks import CheckError, Data
from ...checks.probing import expanded
from ...checks.trace import READ, Stop, Trace
from ...geometry import Array
from ...history import History
from ..sandbox.forms import Form, array, either, fields, flag, optional, row, several, text, whole
from ..sandbox.wire import FrameError

INPUTS = ("id", *READ)  # of a scenario: what a worker may know


def inputs(data: Data) -> Data:
    """A check's data without what is right and what is known to be wrong."""
    scenarios = [{key: s[key] for key in INPUTS if key in s} for s in data["scenarios"]]
    return {"name": data["name"], "subject": data["subject"], "kind": data["kind"], "scenarios": scenarios}


def probes(data: Data) -> Data:
    """A check's data with its probes alone."""
    return {**inputs({**data, "scenarios": []}), "probing": {"probes": data["probing"]["probes"]}}


def answer_form(data: Data) -> Form:
    """What a worker's answer to `observe` may be, on these inputs or probes."""
    told = fields(told=text(), lines=several(text(300), 0, 6), stopped=flag)
    asked = expanded(data["probing"]["probes"]) if not data["scenarios"] else data["scenarios"]
    return either(told=told, traces=fields(traces=fields(**{scenario["id"]: _trace(scenario) for scenario in asked})))


def _trace(scenario):
    """One scenario's: as many steps as there are to look at (fewer where it stopped), each with what is looked at."""
    due = max(len(right[0]) for right in scenario["right"]) if "right" in scenario else len(scenario["at"])
    key = row(whole, text(80), several(whole, 0, 12), text(80))
    shape = fields(
        steps=several(row(*[_value] * len(scenario["look"])), 0, due),
        stop=optional(row(key, text(), text())),
        printed=text(),
    )

    def read(value):
        trace = shape(value)
        if trace["stop"] is None and len(trace["steps"]) != due:
            raise FrameError("fewer steps came back than were asked for")
        return trace

    return read


def _value(value):
    """What `as_value` makes of a student's result: a text or numbers."""
    if isinstance(value, str):
        return text()(value)
    if array(value).dtype != float:
        raise FrameError("numbers of another kind came back than were asked for")
    return value


def traces(data: Data, answer: Mapping[str, Any]) -> dict[str, Trace]:
    """{id: Trace} from an answer to `observe`. Raises CheckError if the worker says why there are none."""
    if "told" in answer:
        raise CheckError(data["name"], answer["told"], answer["lines"])
    return {id: Trace(t["steps"], t["stop"] and Stop(*t["stop"]), t["printed"]) for id, t in answer["traces"].items()}


def run_of(answer: Mapping[str, Any], times: Array, mean: tuple[int, ...], fail: Callable[[str], NoReturn]) -> History:
    """The History in an answer to `replay` over a log with these times [s] (N+1,).

    mean: the shape of the estimate;  fail: is given a sentence for the student where it is none.
    """
    size, steps = int(np.prod(mean)), len(times) - 1
    x, P = (steps, *mean), (steps, size, size)
    shapes = {"x": (steps + 1, *mean), "P": (steps + 1, size, size), "x_prior": x, "P_prior": P}
    for field, shape in shapes.items():
        array = answer.get(field)
        if not (isinstance(array, np.ndarray) and array.dtype == float and np.isfinite(array).all()):
            fail("Your filter's estimate is not made of finite numbers.")
        if array.shape != shape:
            fail(f"Your filter's estimate has another shape than {mean} and ({size}, {size}).")
    return History(times, **{field: answer[field] for field in shapes}, R=None)
