"""Whether a filter keeps more from one update to the next than its estimate and covariance."""

from collections.abc import Callable, Mapping
from typing import Any

from .findings import close
from .hints import fold
from .trace import run

SURPRISE, NEXT = "bent", "other"  # probes of the same landmark or reading: the first moves the estimate far


def keeps(data: Mapping[str, Any], subject: Callable) -> list[str]:
    """The line about a filter whose second update is not that of a new filter which starts where the first led; []."""
    probes = {probe["id"]: probe for probe in data.get("probing", {}).get("probes", ())}
    if not {SURPRISE, NEXT} <= probes.keys():
        return []
    then, now = (probes[id]["calls"][-1] for id in (SURPRISE, NEXT))
    scenario = {"make": probes[NEXT]["make"], "look": probes[NEXT]["look"][:2]}
    first = run(subject, data["kind"], {**scenario, "calls": [then, now]})
    given, options = scenario["make"]
    if first.stop or any(isinstance(part, str) for step in first.steps for part in step):
        return []
    start = dict(zip(("x0", "P0"), (part.tolist() for part in first.steps[1])))
    anew = run(subject, data["kind"], {**scenario, "make": [{**given, **start}, options], "calls": [now]})
    if (
        anew.stop
        or not all(map(close, anew.steps[0], first.steps[1]))
        or all(map(close, anew.steps[1], first.steps[2]))
    ):
        return []
    return fold(
        "A second `update` gives something else than that of a new filter which starts where the first one led: "
        "something besides the estimate and its covariance is kept from one update to the next. "
        "Make it anew in each."
    )
