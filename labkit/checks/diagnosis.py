"""What to say of a filter or a function that does not pass: what to fix first, what else is known, and the numbers."""

from collections.abc import Mapping
from typing import Any

from . import functions
from .cells import alike
from .compare import entire, exact, fits, gap_of, recognise
from .feedback import safely
from .hints import evidence, fold, todo
from .identify import told
from .trace import Scenario, Trace

LEFT_OUT = (
    "`update` changes nothing here, but with other measurements it does: is this one left out on purpose, by a gate?"
)


def diagnosis(
    data: Mapping[str, Any], failed: list[Scenario], traces: Mapping[str, Trace], right: Mapping[str, tuple[float, Any]]
) -> tuple[str, list[str], str]:
    """(summary, detail lines, known mistake or '') of the failed scenarios: what to fix first, what else is known."""
    first = failed[0]
    plain = f"Not yet right: {first['title']}.", list[str]()
    plain = safely(lambda: evidence(first, traces[first["id"]], right[first["id"]][1]), plain)
    return safely(lambda: _diagnosis(data, failed, traces, right), (*plain, ""))


def _diagnosis(data, failed, traces, right):
    came = {s["id"]: traces[s["id"]] for s in failed}
    named = recognise(came, data["mistakes"])
    first = failed[0] if data["kind"] == "filter" else _oddest(failed, traces)
    trace, (_, expected) = traces[first["id"]], right[first["id"]]
    if data["kind"] == "function":
        named = [n for n in named if n[1]]  # what is off says more than a guess
    known = [n for n in named if first["id"] in n[2]]
    whole = len(named) == 1 and named[0][1] and named[0][2] == set(came)
    if data["kind"] == "filter":  # whose probes show more than numbers that differ between computers
        whole = whole and exact(set(came), named[0][0])
    two = next((pair for pair in data.get("pairs", ()) if fits(came, pair["form"])), None)
    if two and not whole:
        say, also = (next(m["say"] for m in data["mistakes"] if m["id"] == id) for id in two["ids"])
        summary, lines = evidence(first, trace, expected, say)
        return summary, lines + fold(f"Also: {also}"), say
    sure = [mistake for mistake, *_ in named if entire(came, mistake)]
    found = [] if whole else _found(data, failed, traces, right, sure)
    if found and found[0].part.isdigit():
        first = data["scenarios"][int(found[0].part)]
        trace, (_, expected) = traces[first["id"]], right[first["id"]]
    stopped = trace.stop and not (found and found[0].part == "empty" and _in_empty(first, trace))
    if found and not stopped and (found[0].known or found[0].part != "stops"):
        mistake, others = found[0].known, [f.text for f in found[1:]]
        summary, lines = evidence(first, trace, expected, found[0].text)
    else:
        mistake = next((m["say"] for m, sure, _ in known[:1] if sure), "")
        said = _say(*known[0][:2]) if known else _left_out(data, failed, first, trace)
        summary, lines = evidence(first, trace, expected, said)
        others = (
            [_say(*n[:2]) for n in named if n not in known[:1]]
            if not found
            else [f.text for f in found if f.part != "stops"]
        )
        others = list(dict.fromkeys(other for other in others if other != summary))
    others = _with_stubs(others, [traces[s["id"]].stop for s in failed[1:]], summary)
    return summary, lines + [line for other in others[:2] for line in fold(f"Also: {other}")], mistake


def _left_out(data, failed, first, trace):
    """A sentence where only this measurement changes nothing, as by a gate of the student's own; or ''."""
    others = [s for s in data["scenarios"] if s not in failed and any(_seen(call) for call in s["calls"])]
    rests = trace.steps[-2:] if len(trace.steps) > 1 and not trace.stop and len(first["calls"]) == 1 else []
    if not (others and rests and _seen(first["calls"][0])) or any(gap_of(*pair) > 1 for pair in zip(*rests)):
        return ""
    return LEFT_OUT


def _in_empty(scenario, trace):
    """Whether an update with nothing in view is what ended early."""
    call = scenario["calls"][trace.stop.call - 1] if trace.stop.call else ["__init__"]
    return call[0] == "update" and not _seen(call)


def _seen(call):
    """Whether a call is an update with something in view."""
    return call[0] == "update" and any(call[1].values())


def _with_stubs(others, stops, summary):
    """What else is known, with the first part that is still to be written."""
    stub = next((stop for stop in stops if stop and stop.kind == "NotImplementedError"), None)
    if stub is None:
        return others
    return [other for other in others if "NotImplementedError" not in other] + [todo(stub)] * (todo(stub) != summary)


def _oddest(failed, traces):
    """The first scenario that ended early or has results of another shape, else the first."""
    odd = (s for s in failed if traces[s["id"]].stop or not alike(traces[s["id"]].steps, s["right"][0][0]))
    return next(odd, failed[0])


def _found(data, failed, traces, right, sure):
    """What is wrong, whatever the mistake: for a filter by its probes, for a function by its numbers."""
    if "probing" in data:
        return told(data, traces, sure)
    if data["kind"] == "filter":
        return []
    came = {id: (trace.steps, trace.stop and trace.stop.key) for id, trace in traces.items()}
    first = {s["id"]: s["right"][0] for s in failed}  # of several right answers
    return functions.told(data, came, {id: best for id, (_, best) in right.items()} | first, list(first))


def _say(mistake, sure):
    return mistake["say"] if sure else f"Perhaps: {mistake['say']}"
