"""Which parts of a wrong filter are right: they keep their points.

A filter that fails in a check is probed, on inputs drawn for its student; the right answers are those of the solution,
on this side. A part counts as right only where something shows that it is: a mistake that nobody can place leaves
`predict` and what a filter does with nothing in view, which are compared as they are.
"""

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from ...checks import CheckError, Data
from ...checks.feedback import FilterError
from ...checks.findings import Probed, close
from ...checks.identify import findings, probed
from ...checks.probing import Answer
from ...checks.single import Single
from ...checks.trace import Trace
from ..authoring.rights import rights
from ..authoring.spec import Check
from ..records import PARTS
from ..sandbox.proxy import Stand
from .traces import answer_form, probes, traces

if TYPE_CHECKING:
    from .exam import Exam

OF = {  # the part to which a finding of labkit.checks.identify belongs
    "xk_k in __init__": "motion",
    "x in __init__": "motion",
    "Pk_k in __init__": "spread",
    "P in __init__": "spread",
    "Q in __init__": "spread",
    "R in __init__": "R",
    "motion": "motion",
    "Q in predict": "spread",
    "P in predict": "spread",
    "empty": "empty",
    "h": "expected",
    "landmark": "expected",
    "wrap": "expected",
    "measured": "expected",
    "innovation": "expected",
    "H": "H",
    "R": "R",
    "several": "R",
    "H P H'": "gain",
    "gain": "gain",
    "Q in update": "gain",
    "iterated": "gain",
    "sign": "gain",
    "estimate": "gain",
    "P": "gain",
    "stops": "gain",
    "column": "gain",
    "entries": "gain",
    "heading in predict": "motion",
    "position in predict": "motion",
    "heading in update": "gain",
    "position in update": "gain",
    **dict.fromkeys(("gate", "d2", "d2 list", "d2 before", "d2 empty", "d2 of each", "d2 gated"), "gate"),
}
ALONE = {"motion", "spread", "empty"}  # parts that are seen whatever else is wrong, by probes that begin so:
FIRST = ("made", "predict", "noise", "across predict", "beyond predict", "empty")
GATE = ("d2", "gate", "honest", "lie first")  # how the probes begin that show this part
KEPT = ("d2 one", "d2 one P", "d2 one R", "d2 other")  # whose d2 come out right only of a right h, H and R
Ask = Callable[[Data], Mapping[str, Trace]]


@dataclass
class Drawn:
    """What a filter is asked, and what is right."""

    check: Check
    weights: Mapping[str, int]
    probing: dict[str, Any]

    def data(self, first: bool) -> Data:
        """The probes as a check's data: those that need no measurement, or the others."""
        asked = [probe for probe in self.probing["probes"] if probe["id"].startswith(FIRST) == first]
        about = {"name": self.check.name, "subject": self.check.subject, "kind": self.check.kind, "scenarios": []}
        return {**about, "probing": {"probes": asked}}


def draw(check: Check, right: type, seed: int, student: str) -> Drawn:
    """What a student's filter is asked; the same each time, whichever of its checks failed.

    right: the solution's;  student: what all is drawn from, beside the seed.
    """
    assert check.divided
    keys = [zlib.crc32(word.encode()) for word in (student, "parts", check.subject)]
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=keys))
    probing = check.divided.drawn(rng)
    answers = rights(right, check.kind, probing["probes"])
    kept = [field.name for field in fields(Answer) if field.name != "matrix"]
    probing["right"] = {id: {name: getattr(answer, name) for name in kept} for id, answer in answers.items()}
    probing["known"] = {}
    return Drawn(check, check.divided.weights, probing)


def right_parts(drawn: Drawn, ask: Ask) -> list[str]:
    """The parts of a filter that are shown to be right, in the order of PARTS.

    ask: from a check's data to the filter's traces;  where it gives none, nothing is shown.
    """
    came = ask(drawn.data(True))
    if not came:  # whose `predict` never ends, or ends Python, is asked nothing more
        return []
    asked = probed(drawn.probing, {**came, **ask(drawn.data(False))})
    found = {finding.part for finding in findings(asked)}
    wrong = {OF.get(part, "gain") for part in found}
    with np.errstate(all="ignore"):
        shown = (_alone(asked) | _of_update(asked, found)) - wrong
    if not wrong and shown >= drawn.weights.keys() - {"runs"}:  # nobody can say where it is wrong
        shown &= ALONE
    right = [part for part in PARTS if part in shown and part in drawn.weights]
    return right if right != ["empty"] else []  # which any nonsense does


def _alone(asked: Probed) -> set[str]:
    """Those of ALONE that are right, compared as they are."""
    pairs = {id: (asked.mine.get(id), right) for id, right in asked.right.items() if id.startswith(FIRST)}
    moves = [pair for id, pair in pairs.items() if not id.startswith(("noise", "empty"))]
    spreads = [pair for id, pair in pairs.items() if id.startswith(("made", "predict", "noise"))]
    one, shown = asked.mine.get("one"), set()
    if all(a and close(a.x, r.x) and close(a.moved, r.moved) for a, r in moves):
        shown.add("motion")
    if all(a and close(a.P, r.P) and close(a.after, r.after) for a, r in spreads):
        shown.add("spread")
    rests = all(a and close(a.x, r.x) and _rests(a) for id, (a, r) in pairs.items() if id == "empty")
    if rests and not (one and _rests(one) and not _by_d2(asked)):
        shown.add("empty")
    return shown


def _rests(answer):
    """Whether it changed nothing; an update that never does has not shown that it looks at what is in view."""
    return close(answer.moved, 0 * answer.moved) and close(answer.after, answer.P)


def _of_update(asked: Probed, found: set[str]) -> set[str]:
    """The parts of `update` that the probes, with these findings, do not only leave open."""
    single = Single(asked)
    shown: set[str] = set()
    if not single.steps <= single.pairs.keys():
        return shown
    explained = single.straight and not single.blind and "gain" not in found  # by H, R and S that were read off
    if single.gains or single.covariances or explained:
        shown |= {"H", "gain"}
        shown |= {"R"} if {"two", "three"} <= asked.mine.keys() else set()
    if "what is expected" in asked.fine and all(id in asked.mine for id in asked.right if id.startswith("far")):
        shown.add("expected")
    if single.blind and _by_d2(asked):
        shown |= {"expected", "H", "R"}
    gate = [asked.mine.get(id) for id in asked.right if id.startswith(GATE) and id != "d2 empty"]
    if gate and all(gate) and not all(map(_rests, gate)):
        shown.add("gate")
    return shown


def _by_d2(asked):
    """Whether all d2 are right, of a filter that keeps them."""
    pairs = [(asked.mine.get(id), asked.right.get(id)) for id in KEPT]
    return all(a and r and "d2" in a.fields and close(a.fields["d2"], r.fields["d2"], 1e-2) for a, r in pairs)


def of_student(exam: "Exam", stand: Stand) -> list[str]:
    """The right parts of a student's filter, asked for once, in time of its own: two calls. Raises NotGradedError.

    Where somebody may have ended it meanwhile, that counts as a stop each time, so that each check is tried once more.
    """
    student, name = stand.student, stand.__name__
    if name not in student.parts:
        check = next(one for one in exam.definitions if one.divided and one.subject == name)
        drawn = draw(check, exam.right(name)[0], exam.seed, exam.student)
        before, left = student.stopped, student.left
        try:
            found = right_parts(drawn, lambda data: _ask(stand, data))
        finally:
            student.left = left  # no other check is to be left out for it
        student.parts[name] = found, student.stopped == before
        return found
    found, sure = student.parts[name]
    student.stopped += not sure
    return found


def _ask(stand, data):
    sent = probes(data)
    try:
        return traces(data, stand.observe(sent, answer_form(sent), secret=True))
    except (CheckError, FilterError):  # it did not come to an end: that shows nothing
        return {}
