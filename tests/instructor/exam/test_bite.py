"""Hidden checks bite whatever they draw: a wrong answer gets the same mark from each draw, and so does a right one."""

import dataclasses
import json

import numpy as np
import pytest

from labkit import Landmark, Map, Robot, simulate
from labkit.instructor.authoring.build import ROOT
from labkit.instructor.exam import bite, paper
from labkit.instructor.exam.exam import Exam
from labkit.instructor.exam.record import FILE, recorded
from labkit.instructor.exam.rehearsal import caught, settle
from labkit.instructor.records import CommandError

from helpers.reference import LABS

LAB = LABS[0]
SIGN = "cartesian-kf: sign 1"
Q, R = 0.25**2 * np.eye(2), 0.2**2 * np.eye(2)
PASS = "rng = exam.rng()\nexam.same_run(KF, drive(rng), 'on a close pass')\nprint('passed')"


def close_pass(rng):
    """A single landmark that never comes into view in about a fifth of the draws."""
    world = Map([Landmark((2, rng.uniform(-1, 1)), 0)])
    return simulate(Robot(rng.uniform(-2, 2, 2), Q, R, range=2.5, rng=rng), world, 160)


@pytest.fixture
def exam():
    made = Exam(LAB)
    made.current = "grade-close-pass"
    return made


def sees(exam, student, source=PASS):
    exam.student = student
    return SIGN in caught(exam, source, {"exam": exam, "drive": close_pass}, ["KF"], [SIGN])


def test_what_shows_no_mistake_is_drawn_again_and_the_same_is_drawn_each_time(exam):
    students = [f"s{n}" for n in range(12)]
    plain = {student: sees(exam, student) for student in students}
    assert not all(plain.values()) and any(plain.values())  # the fault: the same filter, other marks
    for student in students:
        exam.student, again = student, set()
        for _ in range(2):
            exam.attempt = 0
            settle(exam, PASS, {"exam": exam, "drive": close_pass}, ["KF"], [SIGN])
            again.add(exam.attempt)
            assert sees(exam, student)
        assert len(again) == 1 and (again == {0}) == plain[student]


def test_a_check_that_can_show_nothing_says_so_and_does_not_go_on_for_ever(exam):
    names = {"exam": exam, "drive": lambda rng: simulate(Robot((0, 0), Q, R, rng=rng), Map([]), 3)}
    with pytest.raises(CommandError, match=r"grade-close-pass.*sign 1.*labkit build"):
        settle(exam, PASS, names, ["KF"], [SIGN])


def test_a_cell_that_judges_by_itself_is_tried_on_one_mistake_after_the_other(exam):
    source = f"history = exam.history(KF, drive(exam.rng()))\n{PASS}"
    assert sees(exam, "s0", source) == sees(exam, "s0")


def made(monkeypatch, source):
    """bite.measure of a cell with this source."""
    cell = dataclasses.replace(paper.read(LAB).cells[-1], id="grade-close-pass", source=source)
    names = {"exam": Exam(LAB), "drive": close_pass}
    forms = {SIGN: names["exam"].wrong("KF")[SIGN]}
    names["exam"]._wrong["KF"] = forms  # one is enough here
    monkeypatch.setattr(bite, "_hidden", lambda lab: [cell])
    monkeypatch.setattr(bite, "room", lambda lab: names)
    return bite.measure(LAB, cell.id, draws=12)


def test_a_mistake_that_is_missed_now_and_then_must_be_seen(monkeypatch):
    found = made(monkeypatch, PASS)
    assert found["must"] == [SIGN] and found["chance"] == {} and found["always"] == 1 and found["enough"] < 1
    assert list(bite._told(LAB, "grade-close-pass", found)) == []


def test_a_mistake_that_is_seen_now_and_then_is_a_fault_of_the_check(monkeypatch, capsys):
    rarely = "if exam.rng('now and then').random() < 0.2:\n    exam.same_run(KF, drive(exam.rng()))\n"
    found = made(monkeypatch, rarely)
    assert 0 < found["chance"][SIGN] < 0.4 and found["must"] == []
    (problem,) = [text for text in bite._told(LAB, "grade-close-pass", found) if "different marks" in text]
    assert "grade-close-pass" in problem and SIGN in problem and "%" in problem and "Let it draw" in problem
    assert "catches   0 of   1" in capsys.readouterr().out


def test_every_hidden_check_has_met_every_known_mistake_as_it_is_now():
    """By what `labkit build` kept: measuring takes minutes."""
    known = recorded(ROOT)
    for lab in known:
        cells = {cell.id: cell for cell in paper.read(lab).cells if cell.hidden and cell.points is not None}
        assert known[lab].keys() == cells.keys(), lab
        for id, found in known[lab].items():
            assert found["digest"] == bite.digest(lab, cells[id]), f"{FILE}: {lab}: {id}; run `labkit build`"
            assert found["always"] and found["always"] + found["never"] == found["known"], (lab, id)
            assert found["enough"] > bite.ENOUGH and found["chance"] == {}
            assert list(cells[id].must) == found["must"]


@pytest.mark.parametrize("lab", sorted(recorded(ROOT)))
def test_what_was_kept_of_a_cheap_check_is_what_comes_of_it_today(lab):
    id = {"01": "grade-stack", "02": "grade-dark-edges", "03": "grade-jacobian", "04": "grade-fuse"}.get(
        lab[:2], "grade-jacobians"
    )
    kept = recorded(ROOT)[lab][id]
    found = bite.measure(lab, id, draws=5)
    assert {key: found[key] for key in ("known", "always", "never", "must")} == {
        key: kept[key] for key in ("known", "always", "never", "must")
    }


def test_a_hidden_check_that_changed_is_out_of_date(tmp_path, monkeypatch, capsys):
    (tmp_path / "solutions" / "checks").mkdir(parents=True)
    known = {lab: dict(checks) for lab, checks in recorded(ROOT).items()}
    lab, id = LABS[1], "grade-dark-edges"
    known[lab][id] = {**known[lab][id], "digest": "another"}
    (tmp_path / "solutions" / "checks" / FILE).write_text(json.dumps(known), encoding="utf-8")
    assert bite.main(tmp_path, [lab], check=True) == 1
    told = capsys.readouterr().out.splitlines()
    assert len(told) == 1 and id in told[0] and "labkit build" in told[0]


def test_a_variant_on_which_the_solution_stops_is_drawn_again(exam):
    data = {"name": "halves", "kind": "function", "subject": "half"}
    stored = {"id": "one", "look": ["half"], "calls": [["half", 1.0]]}
    tried = []

    def half(x):
        tried.append(x)
        if len(tried) < 3:
            raise ZeroDivisionError
        return x / 2

    exam._accepted["half"] = [half]
    drawn = exam._drawn(data, stored)
    assert len(set(tried)) == 3 and drawn["calls"] == [["half", tried[-1]]]
    np.testing.assert_allclose(drawn["right"][0][0][0][0], tried[-1] / 2)
    exam._accepted["half"] = [lambda x: 1 / 0]
    with pytest.raises(CommandError, match=r"one.*halves"):
        exam._drawn(data, stored)
