"""`check(name, subject)`: compare a student's function or filter with stored numbers, and teach.

The numbers (inputs, right outputs, outputs of typical mistakes) are made from the solutions by
`labkit build` and shipped in `labkit/checks/data`, so that no right code is shipped.
"""

import inspect
import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

from .causes import first_to_mend, more_told, used
from .compare import gap, likeliest, nearest
from .feedback import STOPPED, LabError, own_line, safely
from .hints import fold
from .memory import keeps
from .probing import ask
from .source import newest_is_broken, notes_on
from .trace import Scenario, Trace, run

Data: TypeAlias = dict[str, Any]  # of one check: its name, subject, kind, scenarios and mistakes
DATA = Path(__file__).parent / "data"
NEWEST_IS_BROKEN = (
    "The last version of your answer cannot be read by Python (see the error above); this check still sees "
    "the one before it."
)


class CheckError(LabError):
    """A check that did not pass: its text is the report, `summary` the sentence that matters most."""

    def __init__(
        self, name: str, summary: str, details: Iterable[str] = (), passed: str = "", mistake: str = ""
    ) -> None:
        self.name, self.summary, self.details = name, summary, list(details)
        self.mistake = mistake  # the known mistake that was recognised for sure, or ''
        super().__init__("\n".join([f"{name}: {passed or 'not passed.'}", *fold(summary), *self.details]))

    def add(self, lines: Sequence[str]) -> None:
        """Put lines behind the summary, before the numbers."""
        if lines:
            self.details = [*lines, *self.details]
            head, *rest = str(self).split("\n")
            summary = fold(self.summary)
            self.args = ("\n".join([head, *summary, *lines, *rest[len(summary) :]]),)

    @property
    def lines(self) -> list[str]:
        """The first sentence of the summary, then the rest."""
        first, *rest = re.split(r"(?<=[.?!]) ", self.summary, maxsplit=1)
        return [first, *fold("".join(rest)), *self.details]


def check(name: str, subject: Any) -> None:
    """Compare `subject` with the stored numbers of the check `name`; print what passed, or raise CheckError."""
    data = stored(str(name))
    if newest_is_broken(data["subject"]):
        raise CheckError(name, NEWEST_IS_BROKEN)
    passed, notes = judge(data, subject)
    print(success(name, passed))
    for s in notes:
        print("\n".join(fold(f"Note: {s['advice']}")))


def success(name: str, passed: Sequence[Scenario]) -> str:
    """What is printed when all of these scenarios passed."""
    first = f"{name}: all {len(passed)} checks passed." if len(passed) > 1 else f"{name}: passed."
    return "\n".join([first, *(f"  ok  {s['title']}" for s in passed)])


def judge(data: Data, subject: Any) -> tuple[list[Scenario], list[Scenario]]:
    """The scenarios that `subject` passed, and those whose advice it needs; raises CheckError."""
    besides: list[str] = []
    try:
        traces = observe(data, subject)
        if wrong(data, traces):
            traces |= safely(lambda: probe(data, subject), dict[str, Trace]())
            besides = safely(lambda: _in_time(data["name"], lambda: _besides(data, subject)), besides)
        return decide(data, traces)
    except CheckError as error:
        error.add(safely(lambda: [*(_first_to_mend(data, subject) or besides), *notes_on(subject)], []))
        raise


def _first_to_mend(data, subject):
    functions = used(subject)
    beside = _beside(data)

    def fails(name):
        return any(_fails(other, functions[name]) for other in beside if is_of(other, name))

    return first_to_mend(functions, fails, lambda name: used(functions[name]))


def _besides(data, subject):
    """Lines about a filter that fails: where it is looked at closer, and what it keeps from one update to the next."""
    if data["kind"] == "function" or "probing" in data:
        return keeps(data, subject)
    closer = [
        other["name"]
        for other in _beside(data)
        if "probing" in other and other["subject"] == data["subject"] and _fails(other, subject)
    ]
    return more_told(closer)


def _beside(data):
    return [stored(path.stem) for path in sorted(DATA.glob(f"{data['name'].split('-')[0]}-*.json"))]


def _fails(data, subject):
    try:
        return bool(wrong(data, observe(data, subject)))
    except CheckError:
        return True


def is_of(data: Data, name: str) -> bool:
    """Whether these are the data of the check of a function of that name."""
    return data["kind"] == "function" and data["subject"] == name


def observe(data: Data, subject: Any) -> dict[str, Trace]:
    """{scenario id: Trace} of `subject`; needs only the inputs in `data`. Raises CheckError if there is none."""
    name, problem = data["name"], unfit(data, subject)
    if problem:
        raise CheckError(name, problem)
    return _in_time(name, lambda: steady_traces(data, subject))


def probe(data: Data, subject: Any) -> dict[str, Trace]:
    """{id: Trace} of what a filter is asked besides, so that it shows which line is wrong; as `observe`."""
    probes = data.get("probing", {}).get("probes", [])
    return _in_time(data["name"], lambda: ask(subject, data["kind"], probes))


def _in_time(name, look):
    try:
        return look()
    except KeyboardInterrupt as error:
        raise CheckError(name, STOPPED, [f"  {own_line(error)}".rstrip()]) from None


def wrong(data: Data, traces: Mapping[str, Trace]) -> list[Scenario]:
    """The scenarios that a subject with these traces does not pass, but for those that only give advice."""
    must = [s for s in data["scenarios"] if "advice" not in s]
    return [s for s in must if nearest(traces[s["id"]], s["right"])[0] > 1]


def decide(data: Data, traces: Mapping[str, Trace]) -> tuple[list[Scenario], list[Scenario]]:
    """Compare traces with the right ones in `data`: as `judge`."""
    name = data["name"]
    right = {s["id"]: likeliest(traces[s["id"]], s["right"]) for s in data["scenarios"]}
    must = [s for s in data["scenarios"] if "advice" not in s]
    if failed := wrong(data, traces):
        from .diagnosis import diagnosis  # not before something is wrong: a grader's workers do without

        passed = f"{len(must) - len(failed)} of {len(must)} checks passed."
        summary, lines, mistake = diagnosis(data, failed, traces, right)
        raise CheckError(name, summary, lines, passed, mistake)
    return must, [s for s in data["scenarios"] if right[s["id"]][0] > 1 and _is_so(s, traces[s["id"]])]


def _is_so(scenario, trace):
    """Whether a filter that is right elsewhere does here what the advice is about."""
    return "kept" not in scenario or gap(trace, scenario["kept"]) <= 1


@cache
def stored(name: str) -> Data:
    """The data of a check, by its name; not to be changed."""
    path = DATA / f"{name}.json"
    if not path.is_file():
        near = get_close_matches(name, [p.stem for p in DATA.glob("*.json")], 1)
        raise CheckError(name, f"There is no check of that name{f'; is it {near[0]!r}?' if near else '.'}")
    return json.loads(path.read_text(encoding="utf-8"))


def unfit(data: Data, subject: Any) -> str:
    """Why `subject` cannot be checked at all, in a sentence, or ''."""
    want, kind = data["subject"], f"an object of type {type(subject).__name__}"
    call = f'`check("{data["name"]}", {want})`'
    if data["kind"] == "function":
        if inspect.isclass(subject):
            return f"This check wants the function `{want}`, but the class {subject.__name__} came."
        if not callable(subject):
            return f"This check wants the function `{want}` itself, without brackets: {call}. What came is {kind}."
        return ""
    methods = sorted({method for s in data["scenarios"] for method, *_ in s["calls"]})
    if not callable(subject):
        return f"This check wants the class `{want}` itself and makes its own filters: {call}. What came is {kind}."
    for method in methods:
        if inspect.isclass(subject) and not callable(getattr(subject, method, None)):
            return (
                f"The class {subject.__name__} has no method `{method}`: is it spelled so, "
                "and is it indented under the class?"
            )
    return ""


def steady_traces(data: Data, subject: Callable) -> dict[str, Trace]:
    """{scenario id: Trace}; all scenarios run twice, in reverse the second time.

    A filter that draws random numbers, or shares state between its objects, gives other numbers then.
    """
    before = _class_state(subject)
    first = {s["id"]: run(subject, data["kind"], s) for s in data["scenarios"]}
    for s in reversed(data["scenarios"]):
        trace = first[s["id"]]
        again = run(subject, data["kind"], s)
        if gap(again, (trace.steps, trace.stop and trace.stop.key)) > 1e-3:
            raise CheckError(data["name"], _unsteady(data, before, _class_state(subject)))
    return first


def _class_state(subject):
    if inspect.isclass(subject):
        members = vars(subject)
    else:  # of what stands outside a function, what it names
        code, outside = getattr(subject, "__code__", None), getattr(subject, "__globals__", {})
        members = {name: outside[name] for name in (code.co_names if code else ()) if name in outside}
    return {k: repr(v) for k, v in members.items() if not callable(v) and not k.startswith("__")}


def _unsteady(data, before, after):
    for name in after:
        if before.get(name) != after[name] and data["kind"] == "function":
            return (
                f"`{name}` stands outside your function, which changes it, so each call spoils the next: "
                "make a new array inside, and return that."
            )
        if before.get(name) != after[name]:
            return (
                f"`{name}` belongs to the class, so all filters share it and each spoils the next: "
                f"set it in `__init__` with `self.{name} = ...`, or make it anew where it is used."
            )
    who = data["kind"]
    place = "its own fields (`self. ...`)" if who == "filter" else "its arguments"
    return (
        f"Your {who} gives another result each time, for the same inputs: all that it may depend on is in {place}. "
        "Does it draw random numbers, use a global variable, or keep something from one call to the next?"
    )
