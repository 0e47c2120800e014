"""The notebooks: built from their sources, runnable, and free of solutions in the student's copy."""

import ast
import builtins
import re
import shutil
import subprocess
import symtable
import sys

import nbformat
import pytest
from matplotlib import pyplot as plt

from labkit import cli
from labkit.instructor.authoring import build, percent
from labkit.instructor.records import CommandError
from labkit.notebook.shell import Nothing
from labkit.notebook.source import python

from helpers.reference import COURSE, LABS, ROOT


def script(lab):
    return ROOT / "solutions" / f"{lab}.py"


def student(lab):
    return nbformat.read(ROOT / "notebooks" / f"{lab}.ipynb", as_version=4)


def cells(notebook):
    return {cell.id: cell for cell in notebook.cells}


@pytest.fixture(scope="module")
def filled(tmp_path_factory):
    """A student's folder, its name with a space in it, with all labs filled in."""
    folder = tmp_path_factory.mktemp("filled in")
    for lab in LABS:
        notebook, answers = student(lab), cells(percent.notebook(script(lab)))
        for cell in notebook.cells:
            if cell.metadata.get("labkit") in ("answer", "guess"):
                cell.source = answers[cell.id].source
        nbformat.write(notebook, folder / f"{lab}.ipynb")
    return folder


@pytest.mark.parametrize("lab", LABS)
def test_the_notebooks_agree_with_their_source(lab):
    assert build.compare(script(lab), run=False) == []


def test_drift_is_noticed(tmp_path, monkeypatch):
    for folder in ("solutions", "notebooks"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    monkeypatch.setattr(build, "ROOT", tmp_path)
    copy = tmp_path / "solutions" / script(LABS[0]).name
    assert build.compare(copy, run=False) == []
    copy.write_text(copy.read_text("utf-8").replace("np.concatenate([lm.p for", "np.hstack([lm.p for"), "utf-8")
    assert any("cell 'answer-stack' differs" in problem for problem in build.compare(copy, run=False))


@pytest.mark.slow
@pytest.mark.parametrize("lab", [LABS[2], LABS[0]])
def test_the_solution_prints_in_jupyter_what_it_printed(lab):
    """By nbval, as instructors run it, in a kernel that draws; test_processors has all labs without one, which is twice
    as fast."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--rootdir=."]
    command += ["--nbval", str(ROOT / "solutions" / f"{lab}.ipynb")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def named(cells):
    """(names that these code cells set, names that they use)."""
    nodes = [node for cell in cells for node in ast.walk(ast.parse(python(cell.source)))]
    names = [node for node in nodes if isinstance(node, ast.Name)]
    made = {node.id for node in names if isinstance(node.ctx, ast.Store)}
    made |= {node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    made |= {
        (a.asname or a.name).split(".")[0] for n in nodes if isinstance(n, ast.Import | ast.ImportFrom) for a in n.names
    }
    arguments = {node.arg for node in nodes if isinstance(node, ast.arg)}
    return made, {node.id for node in names if isinstance(node.ctx, ast.Load)} - arguments


@pytest.mark.parametrize("lab", LABS)
def test_a_filled_in_lab_is_the_solution_without_what_is_hidden(filled, lab):
    """So what the solution's run shows holds for it too: no cell of it needs a hidden one."""
    given = [cell for cell in nbformat.read(filled / f"{lab}.ipynb", as_version=4).cells if cell.cell_type == "code"]
    solved = [cell for cell in percent.notebook(script(lab)).cells if cell.cell_type == "code"]
    hidden = [cell for cell in solved if "hidden" in cell.metadata.get("tags", [])]
    assert [(c.id, c.source) for c in given] == [(c.id, c.source) for c in solved if c not in hidden]
    made, used = named(given)
    assert (named(hidden)[0] - made) & used == set()


def test_filled_in_labs_pass_and_one_with_a_mistake_fails_at_its_check(filled, capsys):
    wrong = filled / "wrong.ipynb"
    notebook = nbformat.read(filled / f"{LABS[2]}.ipynb", as_version=4)
    answer = cells(notebook)["answer-kf"]
    answer.source = answer.source.replace("innovation[1::2] = wrap(innovation[1::2])", "pass")
    nbformat.write(notebook, wrong)
    assert cli.main(["check", *(str(filled / f"{lab}.ipynb") for lab in LABS), str(wrong)]) == 1
    said = [line for line in capsys.readouterr().out.splitlines() if line.startswith(("PASS", "FAIL"))]
    (failed,) = (line for line in said if line.startswith("FAIL"))
    assert failed.startswith("FAIL  wrong  range-bearing-kf") and "wrap" in failed
    checks = [cell for lab in LABS for cell in student(lab).cells if re.search(r"(?m)^check\(", cell.source)]
    assert len([line for line in said if line.startswith("PASS") and "  wrong  " not in line]) >= len(checks)


@pytest.mark.slow
@pytest.mark.parametrize("lab", LABS)
def test_an_unfilled_lab_stops_only_at_its_stubs(lab, tmp_path, monkeypatch):
    for name in LABS:
        shutil.copy(ROOT / "notebooks" / f"{name}.ipynb", tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(plt, "show", lambda: plt.close("all"))
    names, stops = {"__name__": "__main__", "display": lambda *_: None, "get_ipython": Nothing}, {}
    for cell in student(lab).cells:
        if cell.cell_type == "code":
            try:
                exec(compile(python(cell.source), f"cell '{cell.id}'", "exec"), names)
            except Exception as error:
                stops[cell.id] = str(error)
    plt.close("all")
    assert set(stops) >= {cell.id for cell in student(lab).cells if cell.metadata.labkit == "check"}
    assert {id: says for id, says in stops.items() if "still to be written" not in says} == {}


@pytest.mark.parametrize("lab", LABS)
def test_the_students_copy_gives_nothing_away(lab):
    text = (ROOT / "notebooks" / f"{lab}.ipynb").read_text("utf-8")
    assert "SOLUTION" not in text and "HIDDEN" not in text
    copy = "\n".join(cell.source for cell in student(lab).cells)
    for region in re.findall(r"### BEGIN SOLUTION\n(.*?)### END SOLUTION", script(lab).read_text("utf-8"), re.S):
        for line in region.splitlines():
            bare = line.strip().removeprefix("# ")
            assert len(bare) < 25 or bare in ALSO_TOLD or bare not in copy, bare


# What a hint says in so many words, and a solution too.
ALSO_TOLD = {"innovation[1::2] = wrap(innovation[1::2])", "low, high = chi2_bounds(dof=2, level=0.95, runs=runs)"}


def lines(cell):
    """How many lines of code there are to read in a cell."""
    return len([line for line in cell.source.splitlines() if line.strip() and not line.strip().startswith("#")])


@pytest.mark.parametrize("lab", COURSE)
def test_a_lab_is_one_sitting(lab):
    """Open exercises, which bring no marks, count too; lab 8 holds nothing else, of which one section is a sitting."""
    read = [cell for cell in student(lab).cells if cell.id != "kit"]  # which is folded, and the same in all labs
    code = [cell for cell in read if cell.cell_type == "code"]
    given = [cell for cell in code if cell.metadata.labkit != "answer"]
    if not lab.startswith("08"):
        assert 25 <= len(read) <= 45
        assert 3 <= len(code) - len(given) <= 5
        assert sum(map(lines, given)) <= 150
        assert len([cell for cell in code if cell.metadata.labkit == "guess"]) >= 3
    assert max(map(lines, given)) <= 15


def at_top(source):
    """(names that a cell sets, names of the notebook that it reads, in its functions too)."""
    top = symtable.symtable(python(source), "cell", "exec")
    tables, read = [top], set()
    for one in tables:
        tables += one.get_children()
        read |= {s.get_name() for s in one.get_symbols() if s.is_referenced() and (one is top or s.is_global())}
    return {s.get_name() for s in top.get_symbols() if s.is_assigned() or s.is_imported()}, read - set(dir(builtins))


def test_the_sections_of_lab_8_stand_by_themselves_in_any_order():
    """Each reads what the set-up cell or itself has set; what it keeps from one cell to the next, no other one sets."""
    sections, common = {}, set()
    for cell in student("08_further").cells:
        if re.search(r"(?m)^## [A-G]\.", cell.source):
            sections[cell.source.split("## ")[1][0]] = []
        if cell.cell_type == "code":
            source = cell.source.replace("raise NotImplementedError", "raise")
            common |= at_top(source)[0] if cell.id == "setup" else set()
            if sections:
                sections[max(sections)].append(at_top(source))
    assert list(sections) == list("ABCDEFG")
    for name, section in sections.items():
        made = set.union(*(made for made, _ in section))
        kept = {n for k, (_, read) in enumerate(section) for n in read if any(n in made for made, _ in section[:k])}
        assert set.union(*(read for _, read in section)) <= common | made, name
        elsewhere = set().union(*(made for other in sections if other != name for made, _ in sections[other]))
        again = {n for n in kept & elsewhere if any(n in read and n not in made for made, read in section)}
        assert not again - SHARED and not made & common, name


SHARED = {"compare", "spread"}  # imported by two sections, the same each time


@pytest.mark.parametrize("lab", LABS)
def test_the_shape_of_a_lab(lab):
    notebook = student(lab)
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in notebook.cells)
    answers = [cell for cell in notebook.cells if cell.metadata.labkit == "answer" and cell.cell_type == "code"]
    assert all("NotImplementedError" in cell.source for cell in answers)
    # What is wider than this is cut off beside JupyterLab's file list on a laptop.
    long = [
        (cell.id, line)
        for cell in notebook.cells
        if cell.cell_type == "code"
        for line in cell.source.splitlines()
        if len(line) > 94
    ]
    assert long == []
    assert "Summary" in "".join(cell.source for cell in notebook.cells[-3:])


@pytest.mark.parametrize("lab", [LABS[0], LABS[2]])
def test_the_answer_kf_is_the_handouts_class(lab):
    answer = cells(student(lab))["answer-kf"].source
    for line in (
        "class KF:",
        "def __init__(self, x0, P0, Q, R, m, dt=0.25):",
        "def predict(self, u):",
        "def update(self, y):",
    ):
        assert line in answer


def test_a_build_refuses_what_it_cannot_stub(tmp_path):
    lab = tmp_path / "09_bad.py"
    for source, message in [
        ("# %%\n### BEGIN SOLUTION\nx = 1\n### END SOLUTION\n", "outside any function"),
        ("# %%\ndef f():\n    ### BEGIN SOLUTION\n    pass\n", "without its partner"),
        ('# %% id="a"\n1\n# %% id="a"\n2\n', "two cells have the id 'a'"),
    ]:
        lab.write_text(source, "utf-8")
        with pytest.raises(CommandError, match=message):
            build.student(percent.notebook(lab))


def test_hidden_tests_and_hidden_cells_do_not_reach_the_student(tmp_path):
    lab = tmp_path / "09_hidden.py"
    lab.write_text(
        '# %%\ncheck(1)\n### BEGIN HIDDEN TESTS\ncheck("secret")\n### END HIDDEN TESTS\n'
        '# %% tags=["hidden"]\nsecret = 2\n',
        "utf-8",
    )
    notebook = percent.notebook(lab)
    assert "secret" in nbformat.writes(notebook)
    assert "secret" not in nbformat.writes(build.student(notebook)) and "check(1)" in nbformat.writes(
        build.student(notebook)
    )


def test_the_kit_holds_no_filter_and_no_jacobian():
    for path in (ROOT / "labkit").glob("*.py"):
        text = path.read_text("utf-8")
        assert not re.search(r"def (predict|update)\(self|def \w*jacobian", text), path.name
    for path in (ROOT / "labkit/team").glob("*.py"):  # rivals with small filters inside, but no joint one
        assert not re.search(r"def \w*jacobian|class \w*EKF", path.read_text("utf-8")), path.name
    for path in (ROOT / "labkit/legged").glob("*.py"):  # the rivals are filters, but none is Kalman's
        assert not re.search(r"def \w*jacobian|linalg\.(solve|inv)|\bgain\b", path.read_text("utf-8")), path.name
