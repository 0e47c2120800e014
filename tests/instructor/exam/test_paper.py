"""The paper of a lab: a notebook that cannot be used as one is told with what to do."""

import json
import shutil

import pytest

from labkit.instructor.exam import paper
from labkit.instructor.records import CommandError
from labkit.notebook.read import Cell

from helpers.reference import GRADED, LABS, ROOT


def cut(text):
    return text[:-20]


def unrun(text):
    book = json.loads(text)
    for cell in book["cells"]:
        cell.pop("outputs", None)
    return json.dumps(book)


def unmarked(text):
    return text.replace('"grade": true', '"grade": false')


def without_checks(text):
    book = json.loads(text)
    book["cells"] = [cell for cell in book["cells"] if cell["metadata"]["labkit"] != "check"]
    return json.dumps(book)


@pytest.mark.parametrize(
    "folder, spoil, says",
    [
        ("solutions", cut, "ends in the middle.*labkit build"),
        ("solutions", unrun, "'check-stack' has no output to compare with: run `labkit build`"),
        ("solutions", unmarked, "has no check with points"),
        ("notebooks", without_checks, "lacks check-stack: run `labkit build`"),
    ],
)
def test_a_notebook_that_is_no_paper_is_told_with_what_to_do(tmp_path, folder, spoil, says):
    for name in ("solutions", "notebooks"):
        (tmp_path / name).mkdir()
        shutil.copy(ROOT / name / f"{LABS[0]}.ipynb", tmp_path / name)
    path = tmp_path / folder / f"{LABS[0]}.ipynb"
    path.write_text(spoil(path.read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(CommandError, match=says):
        paper.read(LABS[0], tmp_path)


def test_an_unknown_lab_is_told_with_those_that_there_are():
    with pytest.raises(CommandError, match=r"no lab '09_nothing'.*01_cartesian_ekf"):
        paper.read("09_nothing")


@pytest.mark.parametrize("lab", GRADED)
def test_each_written_answer_has_its_own_question_and_nothing_else(lab):
    questions = {check.title: check.question for check in paper.read(lab).checks if check.hand}
    assert len(set(questions.values())) == len(questions)
    for title, question in questions.items():
        assert question.startswith("### Question") and "Erratum" not in question and question.count("\n#") == 0
        assert title.split(":")[0].removeprefix("Question on").strip().split()[-1] in question or " on " in title


@pytest.mark.parametrize(
    "before, question",
    [
        (["> **Erratum.** A question of signs.\n\n### Question Q1\nWhy?"], "### Question Q1\nWhy?"),
        (["### Question Q1\nWhy?", "## 8. Play", "> **Erratum.** No question."], "### Question Q1\nWhy?"),
        (["**Question 1.** Why?\n\nSay more.\n\n## 9. Next\nWords."], "**Question 1.** Why?\n\nSay more."),
        (["### Frage 1\nWarum?"], "### Frage 1\nWarum?"),
        ([], ""),
    ],
)
def test_the_question_is_what_stands_under_its_heading(before, question):
    def cell(id, source, role="text"):
        return Cell(0, id, role, False, source)

    book = [cell("old", "### Question Q0\nWhat?"), cell("answer-old", "Mine.", "answer")]
    book += [cell(f"t{n}", text) for n, text in enumerate(before)] + [cell("answer", "Why not?", "answer")]
    assert paper._question(book, "answer") == question
