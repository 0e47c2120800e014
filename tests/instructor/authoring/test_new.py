"""A lab of one's own: begun, built and graded at once; what is wrong in its source is told with its line."""

import csv
import os
import shutil
import subprocess
import sys
from dataclasses import replace

import pytest

from labkit.instructor.authoring import asked, new, numbers, proof, spec
from labkit.instructor.records import CommandError

from helpers.reference import LABS, ROOT

NAME = "99_my_lab"


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A copy of the project with a new lab in it, its name with a space."""
    folder = tmp_path_factory.mktemp("own") / "my course"
    for part in ("labkit", "solutions", "notebooks", "docs"):
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
    for file in ("README.md", "LICENSE", "lab.py", "pyproject.toml", "requirements.txt", "environment.yml"):
        shutil.copy(ROOT / file, folder)
    done = labkit(folder, "new", NAME)
    assert done.returncode == 0 and f"python3 lab.py build {NAME}" in done.stdout, done.stderr
    return folder


def labkit(folder, *command):
    env = {**os.environ, "PYTHONPATH": str(folder), "PYTHONUTF8": "1"}
    command = [sys.executable, "-m", "labkit", *command]
    return subprocess.run(command, cwd=folder, env=env, capture_output=True, encoding="utf-8", check=False)


def content(folder):
    """{path: bytes} of all that is not in a cache."""
    paths = (path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


@pytest.mark.slow
def test_it_builds_grades_and_is_released_at_once(project):
    before = content(project)
    done = labkit(project, "build", NAME)
    assert done.returncode == 0 and "1 lab built." in done.stdout, done.stdout + done.stderr
    assert "catches   2 of   2 known mistakes" in done.stdout
    changed = {path for path, data in content(project).items() if before.get(path) != data}
    assert changed == {
        "labkit/checks/data/my-lab-bearing.json",
        "labkit/notebook/given.json",
        f"notebooks/{NAME}.ipynb",
        "notebooks/glossary.md",
        "solutions/checks/bite.json",
        f"solutions/{NAME}.ipynb",
    }
    for student, source in {"ada": "solutions", "bob": "notebooks"}.items():
        (project / "class" / student).mkdir(parents=True)
        shutil.copy(project / source / f"{NAME}.ipynb", project / "class" / student)
    done = labkit(project, "grade", "class", "--lab", NAME, "--out", "out")
    assert done.returncode == 0, done.stdout + done.stderr
    with open(project / "out" / "grades.csv", encoding="utf-8-sig", newline="") as file:
        points = {(row["student"], row["check"]): row["points"] for row in csv.DictReader(file)}
    assert points["ada", "check-bearing"] == points["ada", "grade-bearing"] == "2"
    assert points["bob", "check-bearing"] == points["bob", "grade-bearing"] == points["bob", "answer-a"] == "0"
    done = labkit(project, "release", "kit")
    assert done.returncode == 0 and (project / "kit" / "notebooks" / f"{NAME}.ipynb").is_file(), done.stderr


@pytest.mark.parametrize(
    "name, says",
    [("my_lab", "no name of a lab"), ("9_x", "no name"), ("09_My", "no name"), ("01_mine", "Lab 1 is there already")],
)
def test_a_name_that_will_not_do_is_told(project, name, says):
    with pytest.raises(CommandError, match=says):
        new.write(project, name)


def test_a_module_of_checks_is_never_written_over(project):
    with pytest.raises(CommandError, match=r"solutions/checks/my_lab\.py is there already"):
        new.write(project, "98_my_lab")


WRONG = {  # a text in the source, what stands there instead, a text in the line that is then told, and what is told
    'tags=["answer"]\ndef': ('tags=["anser"]\ndef', '"anser"', "'anser' means nothing here: is 'answer' meant?"),
    'id="check-bearing" tags': ("tags", 'title="bearing"\n', "needs an id"),
    'points=2 title="bearing"\n': ('points="two" title="bearing"\n', '"two"', "points='two' is no number from 0 on"),
    "    ### END SOLUTION\n": ("", "return np.arctan2", "`### BEGIN SOLUTION` has no END"),
    "    ### BEGIN SOLUTION\n": ("", "    ### END SOLUTION", "`### END SOLUTION` has no partner before it"),
    "dx, dy = p - x": ("dx, dy = p - ", "dx, dy = p - ", "this is not Python: invalid syntax"),
    'check("my-lab-bearing"': ('check("my-lab-baring"', 'check("my', "no check 'my-lab-baring'. Is 'my-lab-bearing'"),
    f'exam = Exam("{NAME}")\n': ("", "rng = exam.rng()", 'a hidden check needs `exam = Exam("'),
    f'Exam("{NAME}")': (f'Exam("{LABS[0]}")', "from labkit.instructor", "is another lab's"),
    'print("passed")': ("", "rng = exam.rng()", "it prints nothing"),
    'id="rubric-a"': ('id="rubric-b"', "# ### BEGIN SOLUTION", "a hidden text cell with the id 'rubric-a'"),
    'id="rubric-a" tags=["hidden"]': ('id="rubric-a"', "# **Question A, 2", "students would get this rubric"),
    'points=2 title="Question A"': ('title="Question A"', "# **Question A, 2", "'answer-a', has no points"),
    'points=2 title="bearing: other': ('title="bearing: other', "rng = exam", "points counts nowhere"),
    'tags=["check"] points=2': ('tags=["check"] punkte=2', "punkte", "'punkte' means nothing in the head of a cell"),
    'points=2 title="bearing"\ncheck': ('points=NaN title="bearing"\ncheck', "NaN", "points=nan is no number from 0"),
    'check("my-lab-bearing", bearing)': ("pass", "pass", "it prints nothing"),
    'tags=["setup", "hidden"]': ('tags=["setup"]', "rng = exam.rng()", 'a hidden check needs `exam = Exam("'),
}


@pytest.mark.parametrize("old", WRONG)
def test_what_is_wrong_in_a_source_is_told_with_its_line(project, tmp_path, old):
    instead, told, says = WRONG[old]
    source = (project / "solutions" / f"{NAME}.py").read_text("utf-8")
    assert source.count(old) == 1
    source = source.replace(old, instead)
    script = tmp_path / f"{NAME}.py"
    script.write_text(source, "utf-8")
    (problem,) = proof.problems(script, ["my-lab-bearing"])
    line = source[: source.index(told)].count("\n") + 1
    assert problem.startswith(f"solutions/{NAME}.py, line {line}, cell '") and says in problem


UNREADABLE = {
    'id="grade-bearing"': ('id="check-bearing"', "two cells have the id 'check-bearing'"),
    'id="grade-bearing" ': ('id="grade bearing" ', "the id 'grade bearing' has to be a text in quotes, of letters"),
    'tags=["hidden"] points=2': ('tags="hidden" points=2', 'tags are a list of texts, as in tags=["check"]'),
}


@pytest.mark.parametrize("old", UNREADABLE)
def test_a_head_that_no_notebook_can_have_is_told_with_its_line(project, tmp_path, old):
    instead, says = UNREADABLE[old]
    source = (project / "solutions" / f"{NAME}.py").read_text("utf-8")
    script = tmp_path / f"{NAME}.py"
    script.write_text(source.replace(old, instead), "utf-8")
    line = source[: source.index('id="grade-bearing"')].count("\n") + 1
    with pytest.raises(CommandError, match=rf"^solutions/{NAME}\.py, line {line}: ") as told:
        proof.problems(script, ["my-lab-bearing"])
    assert says in str(told.value)


def test_a_source_is_read_with_a_byte_order_mark_and_told_in_other_letters(project, tmp_path):
    source = (project / "solutions" / f"{NAME}.py").read_text("utf-8")
    script = tmp_path / f"{NAME}.py"
    script.write_text(source, "utf-8-sig")
    assert proof.problems(script, ["my-lab-bearing"]) == []
    script.write_bytes(source.replace("# Say here", "# Für").encode("cp1252", "replace"))
    line = source[: source.index("·")].count("\n") + 1
    with pytest.raises(CommandError, match=rf"line {line}: this is no UTF-8"):
        proof.problems(script, ["my-lab-bearing"])


CASE = {"id": "ahead", "title": "ahead", "look": [""], "calls": [["bearing", [1.0, 1.0], [3.0, 2.0]]]}
MISTAKE = spec.Mistake("swapped", "dy first", [("dy", "dx")])
ODD = [
    ({"lab": "99_my_lob"}, "there is no lab '99_my_lob': is '99_my_lab' meant?"),
    ({"kind": "funktion"}, "its kind is 'funktion', and should be one of filter, function."),
    ({"scenarios": "CASES"}, "its cases should be a list of dictionaries."),
    ({"scenarios": [CASE, CASE]}, "two of its cases have the id 'ahead'."),
    ({"scenarios": [{**CASE, "calls": "bearing"}]}, "the calls of the case 'ahead' should be lists"),
    ({"scenarios": [{"id": "ahead", "title": "ahead", "calls": []}]}, "the case 'ahead' lacks look."),
    ({"mistakes": [MISTAKE, MISTAKE]}, "two of its mistakes have the id 'swapped'."),
    ({"mistakes": [spec.Mistake("swapped", " ", "")]}, "the mistake 'swapped' has no sentence"),
    (
        {"mistakes": [spec.Mistake("swapped", "dy first", ("dy", "dx"))]},
        "the mistake 'swapped' should be a list of edits",
    ),
]


@pytest.mark.parametrize("change, says", ODD)
def test_what_is_wrong_in_a_check_is_told_with_its_name(change, says):
    check = spec.Check(
        **{"name": "h", "lab": NAME, "subject": "bearing", "kind": "function", "scenarios": [CASE]} | change
    )
    (told,) = asked.problems([check], [NAME])
    assert told.startswith(f"solutions/checks, check 'h': {says}")
    assert asked.problems([replace(check, lab=NAME)] * 2, [NAME])[-1].endswith("two checks have this name.")


def test_a_solution_that_cannot_be_run_says_nothing_of_its_mistakes():
    check = spec.Check(
        "h", NAME, "bearing", "function", [CASE], mistakes=[spec.Mistake("swapped", "dy first", "x = 1")]
    )
    for source, says in [
        ("x = 1", f"solutions/{NAME}.py: it defines no 'bearing'."),
        ("import nunpy", "No module named"),
    ]:
        with pytest.raises(CommandError, match=says):
            numbers.make(check, source)
    with pytest.raises(CommandError) as told:
        numbers.make(check, "def bearing(x, p):\n    return 1 / 0")
    assert "passes" not in str(told.value) and "?." not in str(told.value)


def test_the_eight_labs_are_without_fault():
    checks = spec.definitions(ROOT)
    names = [check.name for check in checks]
    assert asked.problems(checks, LABS) == []
    assert [told for lab in LABS for told in proof.problems(ROOT / "solutions" / f"{lab}.py", names)] == []


STOPS = [
    ("x = nothing\n", "line 1: NameError"),
    ("\ndef f(:\n", "line 2: SyntaxError"),
    ("raise SystemExit(3)\n", "line 1: SystemExit"),
]


@pytest.mark.parametrize("text, says", STOPS)
def test_a_module_of_checks_that_stops_is_told_with_its_line(project, text, says):
    path = project / "solutions" / "checks" / "broken.py"
    path.write_text(text, "utf-8")
    try:
        with pytest.raises(CommandError, match=rf"^solutions/checks/broken\.py, {says}"):
            spec.definitions(project)
    finally:
        path.unlink()


@pytest.mark.slow
def test_a_solution_that_stops_is_told_with_its_line(project):
    path = project / "solutions" / f"{NAME}.py"
    source = path.read_text("utf-8")
    path.write_text(source.replace("rng = exam.rng()", "rng = 1\nrng = exam.rgn()"), "utf-8")
    try:
        done = labkit(project, "build", NAME)
    finally:
        path.write_text(source, "utf-8")
    line = source[: source.index("rng = exam.rng()")].count("\n") + 2
    assert done.returncode == 1
    assert f"solutions/{NAME}.py, line {line}, cell 'grade-bearing', stops: AttributeError: 'Exam'" in done.stderr
