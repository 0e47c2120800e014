"""The paper of a lab: a notebook that cannot be used as one is told with what to do."""

import json
import shutil

import pytest

from labkit.instructor.exam import paper
from labkit.instructor.records import CommandError

from helpers.reference import LABS, ROOT


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
