"""The house: who imports whom, what is long, what every public function says, and what ruff and mypy find."""

import ast
import re
import subprocess
import sys
import tomllib

import pytest

from helpers.reference import ROOT, ci_only

sys.path.insert(0, str(ROOT / "docs"))

import count
import house
import index


@pytest.fixture(scope="module")
def figures():
    return count.figures()


def test_no_import_runs_back_up_and_the_rooms_can_be_counted(figures):
    assert figures["arrows that run back up"] == []
    assert figures["rooms"] <= 23


def test_nothing_that_students_get_imports_the_instructors_wing():
    arrows, _ = house.plan()
    both = {(room, other) for room, others in arrows.items() for other in others}
    assert [(a, b) for a, b in both if b.startswith("instructor/") and not a.startswith("instructor/")] == []


def test_what_students_get_is_small(figures):
    """The aim was 6500 lines, which the kit had before its public API got types, docstrings and one form.

    These took about 350 lines (a signature with types is often one line a parameter), the table of input kinds 200.
    Another 500 read and run a notebook as Jupyter would, which is one piece of code for `load_answer`, `labkit check`
    and the graders: the students' side has what both need. What is here is no longer said twice anywhere.
    Finding the wrong line of a filter by probing it (`labkit.checks.identify`) took 1140: no list of mistakes is in it.
    Finding the number, row or input where a function is off (`labkit.checks.functions`) took 540, as general.
    Telling two mistakes in one update apart, by the simplest of all readings of a gain, took 180.
    Another 230 answer wrong use: whatever measures, records, reads or draws a student's data says in a sentence what
    it cannot use, where numpy would fail somewhere inside or, worse, give a number. What nobody should read in a lab,
    the drawing above all, was moved here from the notebooks' cells, which have at most 15 lines.
    Another 30 keep the verdict where a diagnosis fails.
    Another 175 came from lab 8's cells, and tell its open filters step by step from the one that they should be like.
    Another 155 tell where a filter linearises and which landmark it takes, and what only d2 can show of S.
    Numbers of a student's own (`labkit.notebook.variant`) took 75.
    Another 60 tell R at a measured range, an array outside a function that it changes, and an angle a turn on.
    Another 35 say less where two mistakes look alike, and find a list that a function keeps from one call to the next.
    Runs as files took 600 (`labkit.recorded`): a form for one's own robot, those of two courses, a sentence for each
    fault with its file and line, which is half of it.
    Another 50 find an answer of an earlier lab that a cell wrote, let one callback of a widget wait for the other, and
    give sliders, buttons and pictures names for those who cannot see them.
    Another 80 read what other programs write for a notebook, and keep right work right where a name is used again or
    another one is checked; 130 find what a filter keeps between updates, a gain from the new covariance, and what is
    left out, and are silent on what only follows from another mistake.
    """
    assert figures["lines, students' side"] <= 13060


def test_modules_and_functions_are_short(figures):
    assert figures["modules over 250 lines"] == figures["functions over 40 lines"] == []


@pytest.mark.parametrize("what", ["without types", "without a docstring", "arrays without a shape"])
def test_every_public_function_says_what_it_takes_and_gives(figures, what):
    assert figures[what] == []


def test_picture_and_index_of_the_house_are_up_to_date():
    assert house.PICTURE.read_text(encoding="utf-8") == house.drawing(), "python docs/house.py draws it anew"
    assert house.PAGE.read_text(encoding="utf-8") == index.page(), "python docs/index.py writes it anew"


def test_what_the_page_says_is_somewhere_is_there():
    rows = [row.split("|")[2:4] for row in house.PAGE.read_text(encoding="utf-8").splitlines() if row.startswith("| ")]
    found = 0
    for files, names in rows:
        paths = [ROOT / name for name in re.findall(r"`([\w/.]+\.\w+)`", files)]
        text = "\n".join(path.read_text(encoding="utf-8") for path in paths)
        for name in re.findall(r"`(\w+)`", names) if paths else ():
            found += 1
            assert re.search(rf"\b(def|class) {name}\b|^from .*\b{name}\b", text, re.M), f"{name} is not in {files}"
    assert found > 40


def test_a_circle_of_imports_would_be_seen(tmp_path):
    for name, text in {"a": "from . import b", "b": "def f():\n    from .a import x", "c": "from .b import f"}.items():
        (tmp_path / "labkit").mkdir(exist_ok=True)
        (tmp_path / "labkit" / f"{name}.py").write_text(text)
    arrows, _ = house.plan(tmp_path)
    assert house.back(arrows) == [("a", "b"), ("b", "a")]


# mypy takes half a minute; it runs before each commit too.
COMMANDS = [("ruff", "check"), ("ruff", "format", "--check"), pytest.param(("mypy",), marks=ci_only)]


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_ruff_and_mypy_find_nothing(command):
    done = subprocess.run([sys.executable, "-m", *command], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_before_a_commit_the_same_versions_run_as_in_the_tests():
    locked = dict(re.findall(r"^([\w-]+)==([\w.]+)", (ROOT / "tests/requirements.txt").read_text(), re.M))
    used = re.findall(r'"([\w-]+)==([\w.]+)"', (ROOT / ".pre-commit-config.yaml").read_text())
    assert len(used) >= 3
    assert dict(used) == {name: locked[name] for name, _ in used}


def test_every_dependency_and_every_rule_left_out_has_its_reason():
    """A sentence above each dependency, and beside each rule of ruff's that is on or off."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    project = tomllib.loads(text)["project"]
    needs = [*project["dependencies"], *(n for extra in project["optional-dependencies"].values() for n in extra)]
    for line in [f'    "{need}",' for need in needs if "[" not in need and f'    "{need}",' in text]:
        assert text.split(line)[0].rstrip().splitlines()[-1].lstrip().startswith("#"), f"{line} has no reason"
    rules = re.search(r"\[tool\.ruff\.lint\]\n(.*?)\n\n", text, re.S)[1].splitlines()
    assert all("#" in line for line in rules if line.startswith("    ")), "a rule has no reason"


def test_the_library_does_not_hold_a_path_that_only_tests_use():
    """Starting from the labs, the documents, the benchmarks and what modules do when they are loaded."""
    words = re.compile(r"\w+").findall
    reached = set(words((ROOT / "lab.py").read_text(encoding="utf-8")) + words((ROOT / "pyproject.toml").read_text()))
    for pattern in ("solutions/**/*.py", "docs/*.md", "tests/benchmarks/*.py"):
        reached.update(*(words(path.read_text(encoding="utf-8")) for path in ROOT.glob(pattern)))
    uses = {}  # {name: the words of its definition}; names of several modules count as one
    for path in house.modules().values():
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                uses.setdefault(node.name, set()).update(words(ast.unparse(node)[len(node.name) + 6 :]))
            elif not isinstance(node, ast.ImportFrom | ast.Import):
                reached.update(words(ast.unparse(node)))
    todo = [name for name in uses if name in reached]
    while todo:
        more = {word for word in uses[todo.pop()] if word in uses and word not in reached}
        reached |= more
        todo += more
    assert sorted(name for name in set(uses) - reached if not name.startswith("__")) == []
