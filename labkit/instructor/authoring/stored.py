"""How the numbers of checks are stored: rounded, and as JSON that shows a change as a small diff."""

import json

import numpy as np

from ...checks.trace import Trace
from ...geometry import Array


def pack(trace: Trace, digits: int = 7) -> list:
    """A Trace as JSON: [steps, stop], numbers with seven digits, null for not-a-number."""
    return [[[short(v, digits) for v in step] for step in trace.steps], trace.stop and trace.stop.key]


def short(value: str | Array, digits: int = 7) -> str | float | list | None:
    """A text, or an array (...,) as lists of numbers with so many digits, null for not-a-number."""
    if isinstance(value, str):
        return value
    # What is zero but for rounding comes out differently on another processor.
    size = np.abs(value[np.isfinite(value)]).max(initial=0.0)
    value = np.where(np.abs(value) < max(1e-9 * size, 1e-12), 0.0, value)
    return _digits(value.tolist(), digits)


def _digits(value, digits):
    if isinstance(value, list):
        return [_digits(v, digits) for v in value]
    return None if np.isnan(value) else float(f"{value:.{digits}g}")


def as_text(data: dict) -> str:
    """JSON with a line for each scenario and each form of a mistake, so that a change shows as a small diff."""

    def line(value):
        return json.dumps(value, ensure_ascii=False)

    scenarios = ",\n".join(line(s) for s in data["scenarios"])
    mistakes = ",\n".join(
        f'{{"id": {line(m["id"])}, "say": {line(m["say"])}, "forms": [\n' + ",\n".join(map(line, m["forms"])) + "]}"
        for m in data["mistakes"]
    )
    head = "".join(
        f'"{key}": {line(data[key])},\n' for key in ("name", "lab", "subject", "kind", "args", "parts") if key in data
    )
    probing = "".join(f',\n"{key}": {{\n{_lines(data[key])}}}' for key in ("probing",) if key in data)
    if data.get("pairs"):
        probing += ',\n"pairs": [\n' + ",\n".join(map(line, data["pairs"])) + "]"
    return f'{{{head}"scenarios": [\n{scenarios}\n],\n"mistakes": [\n{mistakes}\n]{probing}}}\n'


def _lines(probing):
    """The probes one a line, and what else belongs to them."""
    one = json.dumps
    probes = ",\n".join(one(probe, ensure_ascii=False) for probe in probing["probes"])
    others = (
        f'"{key}": {{\n' + ",\n".join(f"{one(id)}: {one(v)}" for id, v in probing[key].items()) + "}"
        for key in ("right", "known")
    )
    return f'"rows": {one(probing["rows"])},\n"probes": [\n{probes}],\n' + ",\n".join(others)
