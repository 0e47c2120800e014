"""One mistake costs its own part: a wrong filter keeps the points of those parts that are shown to be right."""

import ast
import json
from types import SimpleNamespace

import numpy as np
import pytest

from labkit.checks import DATA
from labkit.checks.findings import Finding
from labkit.checks.probing import ask
from labkit.instructor.exam import parts as exam_parts
from labkit.instructor.exam.jobs import given
from labkit.instructor.exam.paper import read
from labkit.instructor.exam.parts import ALONE, OF, right_parts
from labkit.instructor.exam.recorder import FILE, Recorder
from labkit.instructor.intake.submission import assemble
from labkit.instructor.records import FAILED, PARTLY, PARTS, PASSED, points_of
from labkit.instructor.sandbox.channel import WorkerLostError
from labkit.instructor.sandbox.proxy import Notebook, Stand
from labkit.notebook.read import cells_of

from helpers.classroom import filled
from helpers.inside import Pupil, room
from helpers.parts import CHECKS, drawn, here, mistaken, mistakes
from helpers.reference import ROOT

NOBODY_KNOWS = ["motion", "spread", "empty"]  # all is right but for something that no question shows
SAMPLE = {  # what a known mistake costs, beside the part of whole runs
    "cartesian-kf": {
        "expected-reversed": {"expected"},
        "minus-u": {"motion"},
        "dt-forgotten": {"motion"},
        "q-not-added": {"spread"},
        "by-place-in-y": {"expected"},
        "r-squared": {"R"},
        "r-not-repeated": {"R"},
        "p-not-updated": {"gain"},
        "sign": {"gain"},
        "empty-crash": {"empty"},
        "update-empty": {"expected", "H", "R", "gain", "empty"},
    },
    "range-bearing-kf": {
        "bearing-row-one-sign": {"H"},
        "not-wrapped": {"expected"},
        "id-as-place": {"expected", "H"},
        "x-not-moved": {"motion"},
        "s-without-r": {"R"},
        "p-plus": {"gain"},
        "star-for-at": {"R", "gain"},
    },
    "legged-ekf": {
        "x-not-corrected": {"gain"},
        "heading-not-wrapped": {"gain"},
        "no-gate": {"gate"},
        "gate-reversed": {"gain", "gate"},
        "d2-not-kept": {"gate"},
        "s-without-r": {"R"},
        "empty-crash": {"empty"},
    },
    "team-paper": {
        "heading-stays": {"motion"},
        "no-inflate": {"spread"},
        "not-wrapped": {"expected"},
        "update-not-wrapped": {"gain"},
        "d2-grows": {"gate"},
    },
    "team-ekf": {"x-not-moved": {"motion"}, "f-transposed": {"spread"}, "q-not-squared": {"spread"}},
}
HALF = 50  # per cent that one mistake leaves at least, but where `update` does nothing at all


def lost(check, form, student="Ada"):
    right = here(check, mistaken(check, form), student)
    return {part for part in check.divided.weights if part not in right} - {"runs"}


def form_of(check, id):
    return next(form for name, form in mistakes(check).items() if name.endswith(f": {id} 1"))


@pytest.mark.parametrize("name", CHECKS)
def test_one_mistake_costs_its_own_part_and_leaves_half(name):
    check, weights = CHECKS[name], CHECKS[name].divided.weights
    assert sum(weights.values()) == 100 and weights.keys() <= PARTS.keys()
    assert {id: lost(check, form_of(check, id)) for id in SAMPLE[name]} == SAMPLE[name]
    for id, of in SAMPLE[name].items():
        assert id == "update-empty" or 100 - weights["runs"] - sum(weights[part] for part in of) >= HALF, id


@pytest.mark.parametrize("name", CHECKS)
def test_nothing_is_found_wrong_in_a_right_filter_and_a_mistake_that_nobody_finds_is_not_for_free(name):
    check = CHECKS[name]
    for form in ((), *(right.form for right in check.right)):
        found = here(check, mistaken(check, form), "Ada")
        assert found == [part for part in NOBODY_KNOWS if "motion" in check.divided.weights], form


def test_two_mistakes_keep_no_more_than_one():
    check = CHECKS["range-bearing-kf"]
    for first, second in (
        ("bearing-row-one-sign", "not-wrapped"),
        ("x-not-moved", "s-without-r"),
        ("p-plus", "q-not-added"),
    ):
        one, other = form_of(check, first), form_of(check, second)
        assert lost(check, [*one, *other]) >= lost(check, one) | lost(check, other)


def test_what_is_drawn_is_the_students_own_and_stored_answers_bring_nothing():
    """A filter that says what was right for another student, or in the notebook's own check."""
    asked = {student: drawn("cartesian-kf", student) for student in ("Ada", "Bela")}
    probes = CHECKS["cartesian-kf"].probing["probes"], *(of.probing["probes"] for of in asked.values())
    right = mistaken(CHECKS["cartesian-kf"], ())
    stored, own, others = (ask(right, "filter", some) for some in probes)
    assert right_parts(asked["Ada"], lambda data: own) == NOBODY_KNOWS
    for replies in (stored, others):
        assert right_parts(asked["Ada"], lambda data: replies) == []


def odd(**methods):
    """The right filter of lab 1 with other methods."""
    right = mistaken(CHECKS["cartesian-kf"], ())
    return type("KF", (right,), methods)


def raises(*_):
    raise NotImplementedError("`KF` is still to be written.")


def test_who_wrote_nothing_gets_nothing_and_what_cannot_be_probed_what_it_shows():
    check = CHECKS["cartesian-kf"]
    nothing = {"predict": lambda self, u: None, "update": lambda self, y: None}
    assert here(check, odd(**nothing)) == []
    assert here(check, odd(predict=raises, update=raises)) == here(check, odd(__init__=raises)) == []
    assert here(check, odd(update=raises)) == ["motion", "spread"]
    assert here(check, odd(predict=raises)) == ["expected", "H", "R", "gain", "empty"]

    def column(self, y):
        self.xk_k = np.zeros((2, 1)) if y else self.xk_k

    assert here(check, odd(update=column)) == NOBODY_KNOWS
    said = odd(update=lambda self, y: setattr(self, "Pk_k", "all right") if y else None)
    assert here(check, said) == NOBODY_KNOWS


def test_an_update_that_never_ends_leaves_what_predict_shows():
    subject = mistaken(CHECKS["team-paper"], ())

    def look(data):
        probes = data["probing"]["probes"]
        return {} if any(probe["id"] == "one" for probe in probes) else ask(subject, "filter", probes)

    assert right_parts(drawn("team-paper", "Ada"), look) == NOBODY_KNOWS


def texts(node, tree):
    """What an expression may be, where it is a text, a choice of texts or a name for one; else its source."""
    if isinstance(node, ast.Constant):
        return {node.value}
    if isinstance(node, ast.IfExp):
        return texts(node.body, tree) | texts(node.orelse, tree)
    if isinstance(node, ast.Name):
        sets = [
            one
            for one in ast.walk(tree)
            if isinstance(one, ast.Assign)
            and isinstance(one.value, ast.IfExp)
            and isinstance(one.value.body, ast.Constant)
        ]
        return set().union(*(texts(one.value, tree) for one in sets if ast.unparse(one.targets[0]) == node.id))
    return {ast.unparse(node)}


def test_every_finding_belongs_to_a_part():
    said = set()
    for path in (ROOT / "labkit" / "checks").glob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
        for call in (call for call in calls if getattr(call.func, "id", "") == Finding.__name__):
            said |= texts(call.args[0], tree)
    said |= {f"{thing} in {method}" for thing in ("heading", "position") for method in ("predict", "update")}
    said -= {"f'{name} in __init__'", "f'heading in {method}'", "f'position in {method}'"}
    assert said <= OF.keys(), said - OF.keys()
    for path in DATA.glob("*.json"):
        known = json.loads(path.read_text(encoding="utf-8")).get("probing", {}).get("known", {})
        parts = {part for forms in known.values() for form in forms for part, *_ in form}
        assert parts <= OF.keys()
    assert set(OF.values()) | {"gate", "runs"} == set(PARTS) and ALONE <= set(PARTS)


@pytest.mark.parametrize("lab", sorted({check.lab for check in CHECKS.values()}))
def test_all_checks_of_a_filter_are_divided_and_give_what_they_gave(lab):
    subjects = {check.subject: check.divided.weights for check in CHECKS.values() if check.lab == lab}
    sheet = read(lab)
    for cell, check in (
        (cell, next(c for c in sheet.checks if c.id == cell.id)) for cell in sheet.cells if cell.points
    ):
        (subject,) = {*cell.uses} & subjects.keys() or [""]
        assert (cell.divided, cell.parts) == (check.subject, check.parts) == (subject, subjects.get(subject, {}))
        assert points_of(cell.points, cell.parts, cell.parts) == (cell.points if subject else 0)


def test_points_are_rounded_up_to_a_tenth():
    weights = CHECKS["team-paper"].divided.weights
    assert points_of(1, weights, ["gate"]) == 0.1 and points_of(3, weights, ["motion", "gate"]) == 0.8
    assert points_of(2, weights, ["motion", "H"]) == 0.6 and points_of(2, weights, []) == 0
    assert points_of(0.5, {"H": 99}, ["H"]) == 0.5


CASES = [
    ({"status": FAILED, "parts": ["H", "motion"]}, "failed", (PARTLY, 0.6, ["motion", "H"])),
    (
        {"status": FAILED, "parts": [*PARTS, "more", "H"]},
        "failed",
        (PARTLY, 1.8, [p for p in PARTS if p not in ("runs", "gate")]),
    ),
    ({"status": FAILED, "parts": []}, "failed", (FAILED, 0, [])),
    ({"status": FAILED}, "failed", (FAILED, 0, [])),
    ({"status": "error", "parts": ["H"], "reason": "No."}, "failed", ("error", 0, None)),
    ({"status": FAILED, "parts": ["H"], "points": 2}, "passed", (PARTLY, 0.2, ["H"])),
    ({"status": PASSED, "parts": ["H"]}, "failed", ("error", 0, None)),
    ({"status": PASSED}, "passed", (PASSED, 2, None)),
]


@pytest.mark.parametrize(("note", "outcome", "due"), CASES)
def test_points_come_from_the_paper_and_parts_from_the_kernel(tmp_path, note, outcome, due):
    (tmp_path / FILE).write_text(json.dumps({"number": 0, "check": "kf", **note}) + "\n", encoding="utf-8")
    marks = []
    recorder = Recorder(tmp_path, {"kf": 2.0}, marks.append, {"kf": CHECKS["cartesian-kf"].divided.weights})
    recorder._tell({"number": 0, "check": "kf"}, SimpleNamespace(outcome=outcome, longrepr="", when="call"))
    (mark,) = marks
    assert (mark["status"], mark["points"], mark.get("parts")) == due


def test_a_filter_is_probed_once_for_all_its_checks(monkeypatch):
    sheet, _, exam = room("01_cartesian_ekf")
    book = filled("01_cartesian_ekf", [("self.xk_k + self.dt * u", "self.xk_k - self.dt * u")])
    student = Pupil(None, Notebook(assemble(sheet.released, cells_of(book)).cells, given(sheet)), sheet.subjects)
    draws, draw = [], exam_parts.draw
    monkeypatch.setattr(exam_parts, "draw", lambda *of: draws.append(of) or draw(*of))
    exam.student, exam.seed = "Ada", 1
    for _ in range(2):
        assert exam_parts.of_student(exam, student.find("KF")) == ["spread", "expected", "H", "R", "gain", "empty"]
    assert len(draws) == 1 and student.tainted and student.stopped == 0


def test_what_was_ended_while_it_was_probed_may_come_out_otherwise_once_more(monkeypatch):
    sheet, _, exam = room("01_cartesian_ekf")
    student = Pupil(None, Notebook(assemble(sheet.released, cells_of(filled())).cells, given(sheet)), sheet.subjects)

    def killed(*_, **__):
        student.stopped += 1
        raise WorkerLostError("It was ended.", killed=True)

    monkeypatch.setattr(Stand, "observe", killed)
    KF = student.find("KF")
    for times in (1, 2):
        assert exam_parts.of_student(exam, KF) == [] and student.stopped == times
