"""Numbers of students' own: the same for the same student and course, in the notebook and when it is graded."""

import csv
import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

from labkit import variant
from labkit.instructor.authoring import new
from labkit.instructor.exam.paper import read as read_paper
from labkit.instructor.policy import read, roster, variants
from labkit.instructor.records import CommandError

from helpers.reference import ROOT

COURSE = "Robótica 2026"
PUPILS = "name;number\nAda Lovelace;17\nBob Łukasz;4\n"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def draw():
    return variant.rng("map").uniform(size=3).tolist()


def test_a_lab_with_variants_of_something_else_asks_for_no_numbers():
    assert not variants.uses(read_paper("05_fuzzy_hybrid"))


def test_without_a_file_all_have_the_same_numbers(folder):
    assert draw() == draw() and variant.whose() == ("", "")
    assert draw() != variant.rng("other").uniform(size=3).tolist()


def test_numbers_go_by_course_student_and_what_they_are_for(folder):
    seen = []
    for of in (("a", "1"), ("a", "2"), ("b", "1"), ("a\n", "1")):
        (folder / variant.FILE).write_text(variant.text(*of), encoding="utf-8")
        assert variant.whose() == of and draw() == draw()
        seen.append(draw())
    assert len({tuple(one) for one in seen}) == 4


def test_a_kit_for_all_asks_once(folder, monkeypatch):
    (folder / variant.FILE).write_text(variant.text(COURSE, ""), encoding="utf-8")
    asked = []
    monkeypatch.setattr("builtins.input", lambda text: asked.append(text) or " 17 ")
    first = draw()
    assert draw() == first and len(asked) == 1 and variant.whose() == (COURSE, "17")
    (folder / variant.FILE).write_text(variant.text(COURSE, "17"), encoding="utf-8")
    assert draw() == first


@pytest.mark.parametrize("text", ["", "course = 3", "course", 'course = "a"\nstudent = 17', "\x00"])
def test_a_damaged_file_is_told(folder, text):
    (folder / variant.FILE).write_text(text, encoding="utf-8")
    with pytest.raises(variant.VariantError, match="put the one that you were given in its place"):
        variant.rng()


def test_where_nobody_can_answer_it_says_where_one_can(folder, monkeypatch):
    (folder / variant.FILE).write_text(variant.text(COURSE, ""), encoding="utf-8")
    monkeypatch.setattr("builtins.input", lambda text: (_ for _ in ()).throw(EOFError))
    with pytest.raises(variant.VariantError, match="Run this cell in JupyterLab"):
        variant.rng()


@pytest.mark.parametrize(
    "table, says",
    [
        ("student\nAda\n", "should name a column 'name'"),
        ("name\n", "names nobody"),
        ("name,number\nAda,1\n,2\n", "line 3: there is no name"),
        ("name,number\nAda,1\nBob,1\n", "'1' stands there twice"),
        ("name\nAda Lovelace\nLOVELACE, Ada\n", "stands there twice; who has the same name needs a number each"),
        ("name,number\nAda,1\nAda,\n", "'Ada' stands there twice"),
    ],
)
def test_a_roster_that_cannot_be_used_is_told(tmp_path, table, says):
    path = tmp_path / "roster.csv"
    path.write_text(table.replace("LOVELACE, Ada", '"LOVELACE, Ada"'), encoding="utf-8")
    with pytest.raises(CommandError, match=says):
        roster.read(path)


def test_who_handed_in_is_found_by_number_or_by_name(tmp_path):
    pupils = [roster.Pupil("Ada Lovelace", "17"), roster.Pupil("Ada Lovelace", "18"), roster.Pupil("Bob")]
    people = [("lovelace, ada", "Participant 17"), ("Somebody", "18"), ("BOB", "99")]
    assert list(roster.keys(pupils, people, "r.csv").values()) == ["17", "18", "Bob"]
    with pytest.raises(CommandError, match=r"which of its students Ada Lovelace, Eve is"):
        roster.keys(pupils, [("Ada Lovelace", ""), ("Eve", "")], "r.csv")


@pytest.mark.parametrize("table", ['course = "a"', 'roster = "r.csv"', 'course = ""\nroster = "r.csv"'])
def test_half_of_what_variants_need_is_told(tmp_path, table):
    path = tmp_path / "course.toml"
    path.write_text(f"[variants]\n{table}\n", encoding="utf-8")
    with pytest.raises(CommandError, match=r"\[variants\] \w+: it is missing"):
        read(path)


# From release to marks ------------------------------------------------------------------------

TARGET = "rng.uniform(-5, 5, (50, 2, 2))"


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A project whose lab 99 asks for a number of the student's own, released to a class of two."""
    folder = tmp_path_factory.mktemp("own")
    for part in ("labkit", "solutions", "notebooks", "docs"):
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
    for file in ("README.md", "LICENSE", "lab.py", "pyproject.toml", "requirements.txt", "environment.yml"):
        shutil.copy(ROOT / file, folder)
    script, _ = new.write(folder, "99_own")
    source = script.read_text("utf-8").replace("from labkit import check\n", "from labkit import check, variant\n")
    source = source.replace(
        'check("own-bearing"', 'place = variant.rng("place").uniform(-5, 5, 2)\ncheck("own-bearing"'
    )
    # Students answer with the direction of their own place, which the hidden check draws as they do.
    source = source.replace("    dx, dy = p - x\n", '    dx, dy = p - x - 0 * variant.rng("place").uniform(-5, 5, 2)\n')
    source = source.replace(
        "from labkit.instructor.exam.exam", "from labkit import variant\nfrom labkit.instructor.exam.exam"
    )
    source = source.replace(
        f"exam.same(bearing, list({TARGET}), ",
        'own = variant.rng("place").uniform(-5, 5, 2)\n'
        "if bearing(np.zeros(2), np.full(2, 77.0)) not in (np.arctan2(77, 77), own[0]):\n"
        '    exam.fail("These are not your numbers.")\n'
        f"exam.same(bearing, list({TARGET}), ",
    )
    script.write_text(source, encoding="utf-8")
    (folder / "roster.csv").write_text(PUPILS, encoding="utf-8")
    for command in (["build", "99_own"], ["release", "kits", "--variants", COURSE, "--class", "roster.csv"]):
        done = labkit(folder, *command)
        assert done.returncode == 0, done.stdout + done.stderr
    return folder


def labkit(folder, *command):
    env = {**os.environ, "PYTHONPATH": str(folder), "PYTHONUTF8": "1"}
    command = [sys.executable, "-m", "labkit", *command]
    return subprocess.run(command, cwd=folder, env=env, capture_output=True, encoding="utf-8", check=False)


@pytest.mark.slow
def test_each_is_graded_on_the_numbers_of_the_kit(project):
    """An answer that gives a number which only its own kit draws passes for its student and for nobody else."""
    for kit in ("Ada Lovelace 17", "Bob Łukasz 4"):
        shutil.unpack_archive(project / "kits" / f"{kit}.zip", project / kit)
    solution = json.loads((project / "solutions" / "99_own.ipynb").read_text("utf-8"))
    for student, kit in {"Ada Lovelace": "Ada Lovelace 17", "Bob Łukasz": "Ada Lovelace 17"}.items():
        text = (project / kit / "localization-labs" / "notebooks" / variant.FILE).read_text("utf-8")
        variant.tell(text)
        own = variant.rng("place").uniform(-5, 5, 2)[0]
        variant.tell(None)
        for cell in solution["cells"]:
            if cell["id"] == "answer-bearing":
                cell["source"] = (
                    "def bearing(x, p):\n    if p[0] == 77:\n"
                    f"        return {own!r}\n    dx, dy = p - x\n    return np.arctan2(dy, dx)\n"
                )
        path = project / "class" / student / "99_own.ipynb"
        path.parent.mkdir(parents=True)
        path.write_text(json.dumps(solution), encoding="utf-8")
        (path.parent / variant.FILE).write_text(text, encoding="utf-8")  # which says nothing
    (project / "out").mkdir()
    (project / "out" / "course.toml").write_text(
        f'[variants]\ncourse = "{COURSE}"\nroster = "../roster.csv"\n', encoding="utf-8"
    )
    done = labkit(project, "grade", "class", "--lab", "99_own", "--out", "out")
    assert done.returncode == 0, done.stdout + done.stderr
    with open(project / "out" / "grades.csv", encoding="utf-8-sig", newline="") as file:
        points = {(row["student"], row["check"]): row["points"] for row in csv.DictReader(file)}
    assert points["Ada Lovelace", "grade-bearing"] == "2" and points["Bob Łukasz", "grade-bearing"] == "0"
    (project / "class" / "Eve").mkdir()
    shutil.copy(project / "class" / "Ada Lovelace" / "99_own.ipynb", project / "class" / "Eve")
    done = labkit(project, "grade", "class", "--lab", "99_own", "--out", "out")
    assert done.returncode == 2 and "which of its students Eve is" in done.stderr


def test_a_class_needs_a_course(tmp_path, capsys):
    assert variants.main(tmp_path / "kits", False, "", "roster.csv") == 2
    assert "--class needs --variants" in capsys.readouterr().err


def test_names_of_kits_are_names_of_files(tmp_path):
    (tmp_path / "r.csv").write_text("name\n../../etc\nAda: Lovelace?\n", encoding="utf-8")
    found = variants.kits(COURSE, tmp_path / "r.csv")
    assert sorted(found) == ["-..-etc", "Ada- Lovelace-"]
    (tmp_path / "r.csv").write_text("name\nA/b\nA-b\n", encoding="utf-8")
    with pytest.raises(CommandError, match="would both be called"):
        variants.kits(COURSE, tmp_path / "r.csv")
    assert np.isfinite(variant.rng().uniform())


def test_grading_does_not_load_what_reads_labs_sources():
    """It takes two seconds, at the start of each command."""
    code = "import sys, labkit.instructor.command; print('jupytext' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=True, cwd=ROOT)
    assert done.stdout.strip() == "False"
