"""What a filter answers when it is probed: short calls whose numbers tell what stands in it, whatever the mistake.

A probe is a scenario of which only what holds before its last call and after it is kept. One with a `step` is
asked again with each number of its measurements a little larger and smaller: how the estimate follows is the gain.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..geometry import Array, wrap
from .trace import Scenario, Stop, Trace, run


def _none():
    return np.zeros((0, 0))


@dataclass(frozen=True)
class Answer:
    """What one probe showed: of a filter with n states, asked with m numbers of measurements.

    x (n,), P (n, n): the estimate and its covariance before;  moved (n,), after (n, n): how far the estimate moved,
    and its covariance after;  gain (n, m): how the estimate follows the measurement, or (0, 0);  H (m, n): of a right
    answer;  fields: what else is kept, by name (before, or where the probe says so after);  matrix: 'column' or
    'entries' where an estimate (n,) has become one by a column added to it or by a product of entries.
    """

    x: Array
    P: Array
    moved: Array
    after: Array
    gain: Array = field(default_factory=_none)
    H: Array = field(default_factory=_none)
    fields: Mapping[str, Array] = field(default_factory=dict)
    matrix: str = ""


def expanded(probes: Sequence[Scenario]) -> list[Scenario]:
    """All that is asked: the probes themselves, and those with a step also with each measured number moved."""
    asked = []
    for probe in probes:
        last = len(probe["calls"])
        common = {key: probe[key] for key in ("make", "look", "begin") if key in probe} | {
            "title": probe["id"],
            "at": sorted({max(last - 1, 0), last}),
        }
        asked_first = _name(probe["id"])
        asked.append({**common, "id": asked_first, "calls": probe["calls"]})
        for place in range(_measured(probe)):
            for sign in (1, -1):
                calls = json.loads(json.dumps(probe["calls"]))
                ((seen,),) = [list(calls[-1][1].values())]
                entry, number = divmod(place, 2)
                seen[entry][probe["first"] + number] += sign * probe["step"]
                asked.append({**common, "id": _name(probe["id"], place, sign), "calls": calls, "of": asked_first})
    return asked


def ask(subject: Callable, kind: str, probes: Sequence[Scenario]) -> dict[str, Trace]:
    """{id: Trace} of all that is asked of a filter; what it prints is left aside, and so are long texts."""
    traces: dict[str, Trace] = {}
    for probe in expanded(probes):
        first = traces.get(probe.get("of", ""))
        if first and first.stop:  # it would stop again, and a grader need not be sent each text
            trace = Trace([], Stop([0, "", [], ""], ""))
        else:
            trace = run(subject, kind, probe)
        text = trace.stop and Stop(trace.stop.key, trace.stop.text[:200])
        traces[probe["id"]] = Trace(trace.steps, text)
    return traces


def _name(id, place=None, sign=1):
    """The name of a trace, which is that of no scenario."""
    return f"probe {id}" if place is None else f"probe {id}{'+' if sign > 0 else '-'}{place}"


def _measured(probe):
    """How many numbers of measurements a probe moves: two for each landmark or reading."""
    return 2 * len(next(iter(probe["calls"][-1][1].values()))) if "step" in probe else 0


def answers(probes: Sequence[Scenario], traces: Mapping[str, Trace]) -> dict[str, Answer]:
    """{id: Answer} of the probes that were answered with finite numbers of the right shapes."""
    found = {probe["id"]: _answer(probe, traces) for probe in probes}
    return {id: answer for id, answer in found.items() if answer}


def stops(probes: Sequence[Scenario], traces: Mapping[str, Trace]) -> dict[str, str]:
    """{id: 'stops: ...' or 'leaves ...'} of the probes that gave nothing that can be read."""
    told = {}
    for probe in probes:
        trace = traces.get(_name(probe["id"]))
        if trace and trace.stop:
            if trace.stop.call < len(probe["calls"]):
                continue  # what was asked did not begin
            told[probe["id"]] = f"stops: {trace.stop.text.splitlines()[0].rstrip('.')}."
        elif trace and trace.steps and _ends(trace, len(probe["look"])) is None:
            for name, before, after in zip(probe["look"][:2], trace.steps[0], trace.steps[-1]):
                if not isinstance(after, str) and np.shape(before) != after.shape:
                    told[probe["id"]] = f"leaves {name} with the shape {after.shape} instead of {np.shape(before)}."
                    break
            else:
                told[probe["id"]] = "leaves something that is no finite number."
    return told


def _answer(probe, traces):
    ends = _ends(traces.get(_name(probe["id"])), len(probe["look"]), flat=True)
    if not ends:
        return None
    (x, P, *fields), (x1, P1, *later) = ends
    fields = later if probe.get("after") else fields
    came = traces[_name(probe["id"])].steps[-1][0]
    matrix = "" if came.size == x.size else "column" if _by_column(x, came) else "entries"
    moved = (x1 - x).ravel()
    moved[probe.get("angles", [])] = wrap(moved[probe.get("angles", [])])
    gain = []
    for place in range(_measured(probe)):
        both = [_ends(traces.get(_name(probe["id"], place, sign)), len(probe["look"]), flat=True) for sign in (1, -1)]
        if not all(both) or both[0][1][0].shape != x.shape or both[1][1][0].shape != x.shape:
            return None
        gain.append((both[0][1][0] - both[1][1][0]).ravel() / (2 * probe["step"]))
    return Answer(
        x.ravel(),
        P,
        moved,
        P1,
        np.array(gain).T if gain else _none(),
        _none(),
        dict(zip(probe["look"][2:], fields)),
        matrix,
    )


def _ends(trace, looked, flat=False):
    """What is looked at before the last call and after it, if these are finite numbers of unchanged shapes.

    flat: also where an estimate (n,) has become a matrix, as by a column (n, 1) added to it or by `*` for `@`.
    """
    if trace is None or trace.stop or not trace.steps or any(len(step) != looked for step in trace.steps):
        return None
    before, after = trace.steps[-2:] if len(trace.steps) > 1 else trace.steps * 2
    if any(isinstance(v, str) or not np.isfinite(v).all() for v in (*before[:2], *after[:2])):
        return None
    x, P = before[:2]
    if flat and x.ndim == 1 and after[0].ndim == 2 and after[0].size > len(x) in after[0].shape:
        after = [_row(x, after[0]), *after[1:]]
    fits = x.size and P.shape == (x.size, x.size) and after[0].shape == x.shape and after[1].shape == P.shape
    return (before, after) if fits else None


def _row(x, matrix):
    """What an estimate (n,) would have become, had no matrix come of it: (n,)."""
    if matrix.size == x.size:
        return matrix.ravel()
    moved = matrix - x
    return x + (moved[:, 0] if _by_column(x, matrix) else moved.sum(axis=1))


def _by_column(x, matrix):
    return np.allclose(matrix - x, (matrix - x)[:, :1], rtol=1e-9, atol=1e-12)


def unpacked(stored: Mapping[str, Any]) -> Answer:
    """The Answer of what `labkit build` stores of one: its arrays, by their names."""
    arrays: dict[str, Any] = {name: np.array(part, dtype=float) for name, part in stored.items() if name != "fields"}
    return Answer(**arrays, fields={name: np.array(part, dtype=float) for name, part in stored["fields"].items()})


def with_noise(right: Answer, R: Array) -> Answer:
    """A right answer to an update, as it would be with another covariance R (2, 2) of one landmark's measurement."""
    if not right.H.size:
        return right
    H, P = right.H, right.P
    S = H @ P @ H.T + np.kron(np.eye(len(H) // len(R)), R)
    gain = P @ H.T @ np.linalg.inv(S)
    return replace(right, gain=gain, after=P - gain @ S @ gain.T, moved=gain @ np.linalg.pinv(right.gain) @ right.moved)
