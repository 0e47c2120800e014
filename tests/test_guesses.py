"""Predictions that students make before a cell is run: none is graded, each is answered."""

import re

import nbformat
import pytest

from labkit import reveal
from labkit.checks.feedback import LabError
from labkit.guesses import told
from labkit.instructor.authoring import build, percent
from labkit.instructor.intake import guesses as intake
from labkit.instructor.records import CommandError, Result
from labkit.instructor.report import feedback
from labkit.notebook.read import cells_of

from helpers.reference import LABS, ROOT

MADE = re.compile(r'^guess = "(.)"$', re.M)
ASKED = re.compile(r'\breveal\("([\w-]+)", guess\)')


def cells(lab, folder):
    return nbformat.read(ROOT / folder / f"{lab}.ipynb", as_version=4).cells


@pytest.fixture
def far(monkeypatch):
    said = {"far-landmark": {"right": "b", "a": "Tempting, <but> no.", "b": "Right: it pulls less.", "c": "No."}}
    for module in ("labkit.guesses", intake, feedback):
        monkeypatch.setattr(*((f"{module}.told",) if isinstance(module, str) else (module, "told")), lambda: said)


@pytest.mark.parametrize("lab", LABS)
def test_a_labs_predictions_are_asked_made_and_answered(lab):
    solved, given = ("\n".join(c.source for c in cells(lab, folder)) for folder in ("solutions", "notebooks"))
    asked = ASKED.findall(solved)
    assert ASKED.findall(given) == asked
    right = MADE.findall(solved)
    assert len(right) == len(asked) == len(set(asked)) and MADE.findall(given) == ["?"] * len(asked)
    file = ROOT / f"labkit/guesses/{lab}.toml"
    assert set(asked) == (set(re.findall(r"^\[(.+)\]", file.read_text("utf-8"), re.M)) if file.exists() else set())
    for name, letter in zip(asked, right):
        choices = {key for key in told()[name] if key != "right"}
        assert told()[name]["right"] == letter and choices in ({*"abc"}, {*"abcd"})
        assert all(len(told()[name][choice]) > 20 for choice in choices)


def test_no_name_is_used_in_two_labs():
    names = [
        n for f in ROOT.glob("labkit/guesses/*.toml") for n in re.findall(r"^\[(.+)\]", f.read_text("utf-8"), re.M)
    ]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("guess, says", [("b", "that is right"), ("(C) ", "(b) is right"), ("a", "<but> no.")])
def test_who_chose_hears_why(far, capsys, guess, says):
    reveal("far-landmark", guess)
    out = capsys.readouterr().out
    assert says in out and f"You chose ({guess.strip(' ()').lower()})" in out
    assert out.index("(a) ") < out.index("(b) Right")


@pytest.mark.parametrize("guess", ["?", "", "z", "right", None, 2, ["a"]])
def test_who_did_not_choose_is_asked_to(far, capsys, guess):
    reveal("far-landmark", guess)
    assert capsys.readouterr().out == 'Choose first: write guess = "a", "b" or "c", and run the cell again.\n'


def test_a_name_that_nobody_knows(far):
    with pytest.raises(LabError, match="no prediction called 'fra'"):
        reveal("fra", "a")


def test_the_students_copy_has_it_unmade(tmp_path):
    lab = tmp_path / "09_new.py"
    lab.write_text('# %% tags=["guess"]\nguess = "b"\nreveal("far-landmark", guess)\n', "utf-8")
    (cell,) = build.student(percent.notebook(lab)).cells
    assert cell.source == 'guess = "?"\nreveal("far-landmark", guess)'
    lab.write_text('# %% tags=["guess"]\nguess = x\n', "utf-8")
    with pytest.raises(CommandError, match='one line such as guess = "b"'):
        build.student(percent.notebook(lab))


def made(*sources):
    raw = [{"cell_type": "code", "source": source, "metadata": {}} for source in sources]
    return intake.guesses(cells_of({"nbformat": 4, "nbformat_minor": 5, "metadata": {}, "cells": raw}))


def test_they_are_read_from_what_is_handed_in(far):
    key, call = "guess far-landmark", 'reveal("far-landmark", guess)'
    assert made(f'guess = "a"\n{call}') == {key: "a"}
    assert made("guess = ' (B) '  # sure", f"plot()\n{call}") == {key: "b"}
    assert made('guess = "a"', 'guess = "c"', call) == {key: "c"}
    assert made(f'guess = "?"\n{call}') == made(f'guess = "z"\n{call}') == made(call) == {}
    assert made('guess = "a"\nreveal("<b>", guess)', 'reveal("other", guess)') == {}


def test_the_page_tells_them_without_points(far):
    page = feedback.feedback_page(Result("Ada", answers={"guess far-landmark": "a", "guess gone": "a"}), [], "Lab 1")
    assert "Your predictions" in page and "<b>far landmark</b>: you chose (a); (b) is right." in page
    assert "Tempting, &lt;but&gt; no." in page and "gone" not in page
    assert "Your predictions" not in feedback.feedback_page(Result("Ada"), [], "Lab 1")
