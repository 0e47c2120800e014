"""What a worker is told of a check, and what it answers, which may be anything: what was asked for gets through."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...checks import CheckError, Data
from ...checks.trace import Scenario, Stop, Trace
from ..sandbox.channel import WorkerLostError

INPUTS = ("id", "look", "make", "calls", "at")  # of a scenario: what a worker may know
TEXT = 2000  # characters of anything that is only for reading


def inputs(data: Data) -> Data:
    """A check's data without what is right and what is known to be wrong."""
    scenarios = [{key: s[key] for key in INPUTS if key in s} for s in data["scenarios"]]
    return {"name": data["name"], "subject": data["subject"], "kind": data["kind"], "scenarios": scenarios}


def traces(data: Data, answer: Mapping[str, Any]) -> dict[str, Trace]:
    """{id: Trace} from a worker's answer to `observe`. Raises CheckError, or WorkerLostError for what is no answer."""
    if "told" in answer:
        lines = answer.get("lines")
        lines = [str(line)[:TEXT] for line in lines[:9]] if isinstance(lines, list) else []
        raise CheckError(data["name"], str(answer["told"])[:TEXT], lines)
    found = answer.get("traces") or {}
    try:
        return {s["id"]: _trace(found[s["id"]], s) for s in data["scenarios"]}
    except (KeyError, TypeError, ValueError, IndexError):
        raise WorkerLostError("What came back from your code could not be understood.") from None


def _trace(sent: Mapping[str, Any], scenario: Scenario) -> Trace:
    """One scenario's: as many steps as there are to look at (fewer where it stopped), each with what is looked at."""
    steps = [[v if isinstance(v, str) else np.asarray(v, dtype=float) for v in step] for step in sent["steps"]]
    stop = None
    if sent["stop"] is not None:
        key, text, line = sent["stop"]
        call, kind, numbers, message = key
        numbers = [int(n) for n in numbers[:12]]
        stop = Stop([int(call), str(kind)[:80], numbers, str(message)[:80]], str(text)[:TEXT], str(line)[:TEXT])
    due = max(len(right[0]) for right in scenario["right"])
    if len(steps) > due or not stop and len(steps) < due or any(len(step) != len(scenario["look"]) for step in steps):
        raise ValueError("not what was asked for")
    return Trace(steps, stop, str(sent["printed"])[-TEXT:])
