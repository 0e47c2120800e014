"""Labs for other graders: what is written, what must not be in it, and that the marks are those of `labkit grade`."""

import io
import json
import re
import subprocess
import zipfile

import nbformat
import pytest

from labkit import cli
from labkit.instructor.authoring import build
from labkit.instructor.exam.paper import read
from labkit.instructor.export import command, container, course, harness, repository, single
from labkit.instructor.records import FAILED, PARTLY, CommandError, Mark, Result

from helpers import exports
from helpers.classroom import LAB, filled, mistaken
from helpers.reference import GRADED, ROOT, ci_only


def hidden(lab):
    """The lines that only the hidden checks of a lab have."""
    book = json.loads((ROOT / "solutions" / f"{lab}.ipynb").read_text(encoding="utf-8"))
    secret = [c for c in book["cells"] if "hidden" in c["metadata"].get("tags", []) and c["cell_type"] == "code"]
    given = (ROOT / "notebooks" / f"{lab}.ipynb").read_text(encoding="utf-8")
    lines = {line.strip() for cell in secret for line in "".join(cell["source"]).splitlines()}
    return {line for line in lines if len(line) > 24 and json.dumps(line)[1:-1] not in given}


# nbgrader ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("lab", GRADED)
def test_the_source_of_nbgrader_has_all_points_and_no_hidden_check(lab):
    """It shows students the locked cells as they were in the source, hidden tests too, in its feedback."""
    source = course.source(lab)
    marks = {c.metadata.nbgrader["grade_id"]: c for c in source.cells if c.metadata.get("nbgrader", {}).get("grade")}
    assert {id: float(c.metadata.nbgrader["points"]) for id, c in marks.items()} == {
        check.id: check.points for check in read(lab).checks
    }
    graded = [cell for cell in marks.values() if cell.cell_type == "code"]
    assert all(cell.source.count(course.GUARD) == 1 and cell.metadata.nbgrader["locked"] for cell in graded)
    shown = "\n".join(cell.source for cell in source.cells)
    assert not [line for line in hidden(lab) if line in shown]
    assert '"hidden"' not in json.dumps([cell.metadata for cell in source.cells])


def test_what_nbgrader_takes_out_leaves_the_students_notebook_and_the_names_of_hidden_checks():
    source, titles = course.source(LAB), []
    for cell in source.cells:
        cell.metadata.labkit = cell.metadata.labkit.replace("guess", "show")  # they are to be made already
        assert bool(re.search("BEGIN SOLUTION", cell.source)) == bool(cell.metadata.get("nbgrader", {}).get("solution"))
        titles += [cell.source.splitlines()[0]] * cell.id.startswith("grade-")
    source.cells = [cell for cell in source.cells if not cell.id.startswith("grade-")]
    given = nbformat.read(ROOT / "notebooks" / f"{LAB}.ipynb", as_version=4)
    assert [(c.id, c.source.strip()) for c in build.student(source).cells] == [
        (c.id, c.source.strip()) for c in given.cells
    ]
    assert "# Graded later: KF: a single landmark (1 point)" in titles and len(titles) == 8


def test_the_model_answer_stands_with_its_rubric_where_nbgrader_takes_both_out():
    (cell,) = [cell for cell in course.source(LAB).cells if cell.id == "answer-q1"]
    assert re.search(r"### BEGIN SOLUTION\n.*\*\*Q1, 2 points.*- 1 point: .*\n### END SOLUTION$", cell.source, re.S)


def test_a_mark_is_what_nbgrader_reads_as_one():
    utils = pytest.importorskip("nbgrader.utils")
    from labkit.instructor.export import autograde

    book = course.source(LAB)
    partly = Mark("check-kf", 2.4, 3.0, PARTLY, "Not right.", parts=("motion", "H"))
    others = [Mark(check.id, 0, check.points, FAILED, "It differs.") for check in read(LAB).checks if not check.hand]
    autograde.fill(book, Result("Ada", marks=[partly, *(mark for mark in others if mark.check != "check-kf")]))
    cells = {cell.id: cell for cell in book.cells}
    assert utils.determine_grade(cells["check-kf"]) == (2.4, 3.0)
    assert "Right all the same:" in cells["check-kf"].outputs[0].text
    assert utils.determine_grade(cells["grade-stack"]) == (0, 1)
    book.cells = [cell for cell in book.cells if cell.id not in ("check-kf", "answer-kf")]  # as a student may do
    autograde.fill(book, Result("Ada", marks=[partly, *(mark for mark in others if mark.check != "check-kf")]))
    assert utils.determine_grade(book.cells[-1]) == (2.4, 3.0)
    with pytest.raises(CommandError, match="no check 'check-stack'"):
        autograde.fill(book, Result("Ada", marks=[partly]))
    autograde.fill(book, Result("Ada", problem="It is the notebook of another lab."))
    assert utils.determine_grade(cells["check-stack"]) == (0, 1)
    assert cells["check-stack"].outputs[0].text == "It is the notebook of another lab.\n"


@ci_only
@pytest.mark.slow
def test_nbgrader_and_labkit_give_the_same(tmp_path):
    if subprocess.run([exports.NBGRADER, "-c", "import nbgrader"], capture_output=True).returncode:
        pytest.skip("nbgrader is not installed, and LABKIT_NBGRADER names no Python that has it")
    books = {"ada": filled(), "bela": filled(answer_kf=None, answer_q1=None), "chloe": mistaken(1)[1]}
    books["dmitri"] = filled(own=["import os\nKF.predict = lambda self, u: os._exit(0)"])
    books["emine"] = filled(answer_kf=filled_kf().replace("def update", "def upate"))
    theirs = exports.nbgrader(tmp_path / "a course", books)
    assert theirs == exports.labkit(tmp_path, books)
    assert len({points for (student, check), points in theirs.items() if check == "check-kf"}) > 2
    exports.run([exports.NBGRADER, "-m", "nbgrader", "generate_feedback", LAB], tmp_path / "a course")
    page = (tmp_path / "a course" / "feedback" / "chloe" / LAB / f"{LAB}.html").read_text(encoding="utf-8")
    assert "Right all the same" in page and not [line for line in hidden(LAB) if line in page]


def filled_kf():
    return next(cell["source"] for cell in filled()["cells"] if cell["id"] == "answer-kf")


# Gradescope -------------------------------------------------------------------------------------


def test_the_autograder_holds_what_grading_needs_at_the_top_of_the_zip(tmp_path):
    with zipfile.ZipFile(io.BytesIO(container.autograder(LAB, ["weak_sandbox"]))) as archive:
        names = set(archive.namelist())
        assert {"setup.sh", "run_autograder", "kit/lab.py", f"kit/solutions/{LAB}.ipynb"} <= names
        assert not any("pycache" in name or "/02_noise_mismatch.ipynb" in name for name in names)
        modes = {name: archive.getinfo(name).external_attr >> 16 & 0o777 for name in container.SCRIPTS}
        assert set(modes.values()) == {0o755} and b"\r" not in archive.read("setup.sh")
        assert json.loads(archive.read("labkit.json"))["allowed"] == ["weak_sandbox"]


def test_results_show_hidden_checks_only_when_grades_are_published():
    checks = read(LAB).checks
    marks = [Mark(check.id, None if check.hand else 0.5, check.points, PARTLY, "Not yet right: x") for check in checks]
    found = harness.results(Result("x", marks=marks, answers={"answer-q1": "It is\nso."}), checks)
    seen = {test["name"]: test["visibility"] for test in found["tests"]}
    assert seen == {c.title: "after_published" if c.hidden else "visible" for c in checks if not c.hand}
    assert {test["score"] for test in found["tests"]} == {0.5} and found["tests"][0]["output"] == "Not right: x"
    assert "Question Q1 (2 points, read by a person)\nIt is\nso.\n" in found["output"]
    assert found["output"].endswith("No answer was found.")


def test_who_hands_in_together_gets_the_same_inputs_whoever_comes_first(tmp_path):
    path = tmp_path / "submission_metadata.json"
    assert harness.student(path) == ""
    for users in ([{"id": 7}, {"id": 12}], [{"id": 12}, {"id": 7}]):
        path.write_text(json.dumps({"users": users}))
        assert harness.student(path) == "12 7"


@pytest.mark.parametrize("name", ["notes.txt", "02_noise_mismatch.ipynb"])
def test_who_hands_in_no_notebook_of_the_lab_is_told_so_and_gets_nothing(tmp_path, name):
    book = filled("02_noise_mismatch") if name.endswith("ipynb") else "x"
    exports.as_file(tmp_path / name, book)
    found = harness.results(single.graded(LAB, tmp_path, "x", 1), read(LAB).checks)
    assert found["score"] == 0 and found["output"].endswith(".") and "notebook" in found["output"]


@pytest.mark.slow
def test_gradescope_and_labkit_give_the_same(tmp_path):
    packed = exports.export("gradescope", LAB, out=tmp_path / "zips") / f"{LAB}.zip"
    root = exports.container(tmp_path, packed)
    assert (root / "source").stat().st_mode & 0o77 == 0
    book = mistaken(1)[1]
    found = exports.gradescope(root, book)
    ours = exports.labkit(tmp_path, {"ada": book})
    titles = {check.id: check.title for check in read(LAB).checks}
    assert {test["name"]: test["score"] for test in found["tests"]} == {
        titles[check]: points for (_, check), points in ours.items() if points is not None
    }


# GitHub Classroom -------------------------------------------------------------------------------


LABS = [LAB, "02_noise_mismatch"]


@pytest.fixture(scope="module")
def template():
    return repository.files(LABS, [])


def test_the_repository_has_the_visible_checks_and_no_other(template):
    assert {path for path in template if path.endswith(".ipynb")} == {f"notebooks/{lab}.ipynb" for lab in LABS}
    assert not [path for path in template if "instructor" in path or "solutions" in path]
    tests = json.loads(template[".github/classroom/autograding.json"][0])["tests"]
    visible = [check for lab in LABS for check in read(lab).checks if not check.hand and not check.hidden]
    assert [test["points"] for test in tests] == [check.points for check in visible]
    everything = b"\n".join(data for data, _ in template.values())
    assert not [line for lab in LABS for line in hidden(lab) if line.encode() in everything]


def test_the_workflow_runs_each_test_and_reports_it(template):
    text = template[".github/workflows/classroom.yml"][0].decode()
    assert b"`git push`" in template["README.md"][0] and b"hand in the file" not in template["README.md"][0]
    assert b"/.venv/" in template[".gitignore"][0]
    numbers = range(1, 8)
    assert re.findall(r"^        id: (.*)$", text, re.M) == [f"test-{number}" for number in numbers]
    assert re.findall(r"^          max-score: (.*)$", text, re.M) == ["1", "1", "3", "2", "2", "2", "2"]
    assert re.findall(r"^          (.*)_RESULTS: .*steps\.(.*)\.outputs\.result", text, re.M) == [
        (f"TEST-{number}", f"test-{number}") for number in numbers
    ]
    runners = ",".join(f"test-{number}" for number in numbers)
    assert f"runners: {runners}\n" in text and not re.search("STEPS|SETUP|RUNNERS", text)


@ci_only
@pytest.mark.slow
def test_the_commands_of_the_repository_tell_right_from_wrong(tmp_path):
    root = exports.export("github-classroom", LAB, out=tmp_path / "a repository")
    tests = json.loads((root / ".github/classroom/autograding.json").read_text(encoding="utf-8"))["tests"]
    exports.as_file(root / "notebooks" / f"{LAB}.ipynb", filled(answer_stack="def stack(y, m, x):\n    return 0, 0"))
    assert exports.passed(root, tests) == [False, True, False]


def test_the_environment_of_nbgrader_can_be_made_from_both_lists():
    """A package in both could have two versions, which pip refuses."""
    both = [(ROOT / "tests" / name).read_text(encoding="utf-8") for name in ("requirements.txt", "others.txt")]
    kit, more = (set(re.findall(r"^([\w.-]+)==", text, re.M)) for text in both)
    assert "nbgrader" in more and not kit & more


# The command ------------------------------------------------------------------------------------


def test_what_cannot_be_exported_is_told(tmp_path, capsys):
    (tmp_path / "file").write_text("mine")
    for words, said in (
        (["nbgrader", "01_no_lab", tmp_path], "There is no lab '01_no_lab'"),
        (["gradescope", "08_further", tmp_path], "has no check with points"),
        (["github-classroom", LAB, tmp_path / "file"], "is a file: name a folder"),
        (["nbgrader", LAB, tmp_path / "file" / "below"], "cannot be made"),
    ):
        assert cli.main(["export", *map(str, words)]) == 2
        assert said in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_what_is_there_is_written_over_only_if_asked_and_a_seed_never(tmp_path):
    kit = {"nbgrader_config.py": (b"seed 1", 0o644), "source/a.ipynb": (b"old", 0o644)}
    command.write(kit, tmp_path)
    newer = {"nbgrader_config.py": (b"seed 2", 0o644), "source/a.ipynb": (b"new", 0o644)}
    with pytest.raises(CommandError, match=r"a\.ipynb is there already"):
        command.write(newer, tmp_path)
    assert (tmp_path / "source/a.ipynb").read_bytes() == b"old"
    command.write(newer, tmp_path, force=True)
    assert (tmp_path / "source/a.ipynb").read_bytes() == b"new"
    assert (tmp_path / "nbgrader_config.py").read_bytes() == b"seed 1"
    command.write({"source/b.ipynb": (b"another lab", 0o644)}, tmp_path)
