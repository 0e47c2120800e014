"""Hidden checks bite whatever they draw: a wrong answer gets the same mark from each draw, and so does a right one."""

import dataclasses
import json

import numpy as np
import pytest

from labkit import Landmark, Map, Robot, simulate
from labkit.instructor.authoring.build import ROOT
from labkit.instructor.exam import bite, paper
from labkit.instructor.exam.exam import Exam
from labkit.instructor.exam.mistakes import caught
from labkit.instructor.exam.record import FILE, recorded
from labkit.instructor.records import CommandError

from helpers.reference import GRADED, LABS

LAB = LABS[0]
SIGN = "cartesian-kf: sign 1"
Q, R = 0.25**2 * np.eye(2), 0.2**2 * np.eye(2)
PASS = "rng = exam.rng()\nexam.same_run(KF, drive(rng), 'on a close pass')\nprint('passed')"


def close_pass(rng):
    """A single landmark that never comes into view in about a fifth of the draws."""
    world = Map([Landmark((2, rng.uniform(-1, 1)), 0)])
    return simulate(Robot(rng.uniform(-2, 2, 2), Q, R, range=3.2, rng=rng), world, 160)


@pytest.fixture
def exam():
    made = Exam(LAB)
    made.current = "grade-close-pass"
    return made


def sees(exam, place, source=PASS):
    exam.place = place
    return SIGN in caught(exam, source, {"exam": exam, "drive": close_pass}, ["KF"])


@pytest.fixture
def one(exam):
    """The exam, with one known mistake only."""
    exam.wrong("KF")
    exam._wrong["KF"] = {SIGN: exam.wrong("KF")[SIGN]}
    return exam


def test_a_cell_that_judges_by_itself_is_tried_on_one_mistake_after_the_other(one):
    source = f"history = exam.history(KF, drive(exam.rng()))\n{PASS}"
    assert [sees(one, n, source) for n in range(6)] == [sees(one, n) for n in range(6)]


def made(monkeypatch, exam, source):
    """bite.measure of a cell with this source."""
    cell = dataclasses.replace(paper.read(LAB).cells[-1], id="grade-close-pass", source=source)
    monkeypatch.setattr(bite, "_hidden", lambda lab: [cell])
    monkeypatch.setattr(bite, "room", lambda lab: {"exam": exam, "drive": close_pass})
    return bite.measure(LAB, cell.id, draws=12, most=24, enough=6)


def test_students_get_draws_that_show_the_same(monkeypatch, one):
    found = made(monkeypatch, one, PASS)
    plain = [sees(one, place) for place in range(12)]
    assert not all(plain) and any(plain)  # the fault: the same filter, other marks
    assert found["draws"] == [place for place in range(12) if plain[place]] and found["always"] == 1
    one.seed, given = 5, []
    for one.student in (f"s{n}" for n in range(40)):
        one.deal(found["draws"])
        given.append((one.place, one.rng().random()))
        one.deal(found["draws"])
        assert given[-1] == (one.place, one.rng().random())
    assert {place for place, _ in given} == set(found["draws"]) and len(set(given)) == len(found["draws"])
    assert list(bite._told(LAB, "grade-close-pass", {**found, "draws": list(range(20)), "tried": 24})) == []


def test_without_a_list_each_student_has_a_draw_of_their_own(exam):
    drawn = set()
    for exam.student in ("Ada", "Bela"):
        exam.deal(())
        drawn.add(exam.rng().random())
    assert exam.place is None and len(drawn) == 2


def test_a_check_that_leaves_it_to_chance_is_a_fault(monkeypatch, capsys, one):
    found = made(monkeypatch, one, "if exam.rng('toss').random() < 0.5:\n    exam.same_run(KF, drive(exam.rng()))\n")
    (problem,) = bite._told(LAB, "grade-close-pass", {**found, "always": 1})
    assert "grade-close-pass" in problem and SIGN in problem and "%" in problem and "Let it draw" in problem
    (problem,) = bite._told(LAB, "grade-close-pass", {**found, "always": 0})
    assert "catches none of the known mistakes" in problem
    assert "of   1 known mistakes" in capsys.readouterr().out


def test_every_hidden_check_has_met_every_known_mistake_as_it_is_now():
    """By what `labkit build` kept: measuring takes minutes."""
    known = recorded(ROOT)
    assert known.keys() == set(GRADED)
    for lab in known:
        cells = {cell.id: cell for cell in paper.read(lab).cells if cell.hidden and cell.points is not None}
        assert known[lab].keys() == cells.keys(), lab
        for id, found in known[lab].items():
            assert found["digest"] == bite.digest(lab, cells[id]), f"{FILE}: {lab}: {id}; run `labkit build`"
            assert found["always"] and found["always"] <= found["known"] and len(found["draws"]) >= bite.ENOUGH, id
            assert list(cells[id].draws) == found["draws"]


@pytest.mark.parametrize("lab", GRADED)
def test_what_was_kept_of_a_cheap_check_is_what_comes_of_it_today(lab):
    cheap = {"01": "grade-stack", "02": "grade-dark-edges", "05": "grade-fuse", "06": "grade-jacobians"}
    id = cheap.get(lab[:2], "grade-force" if lab.startswith("07") else "grade-jacobian")
    kept, found = recorded(ROOT)[lab][id], bite.measure(lab, id, draws=5, most=5)
    assert (found["known"], found["always"]) == (kept["known"], kept["always"])
    assert found["draws"] == [place for place in kept["draws"] if place < 5]


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
