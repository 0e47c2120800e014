"""`labkit release`: what students get is whole, works by itself, and holds no answer."""

import ast
import json
import os
import re
import shutil
import stat
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import packages_distributions

import nbformat
import pytest

from labkit import cli
from labkit.instructor.authoring import build, percent, release
from labkit.instructor.records import CommandError

from helpers.reference import LABS, ROOT


@pytest.fixture(scope="module")
def kit(tmp_path_factory):
    """A released folder, its name with a space and letters beyond ASCII."""
    folder = tmp_path_factory.mktemp("release") / "new" / "Kurs für Łukasz"
    assert release.release(ROOT, folder) == files(folder)
    return folder


@pytest.fixture
def project(tmp_path):
    """A copy of the project that can be spoilt."""
    skip = {"solutions": ("checks", "*_*.ipynb"), "labkit": (), "docs": ()}
    for name, patterns in skip.items():
        ignore = shutil.ignore_patterns("__pycache__", *patterns)
        shutil.copytree(ROOT / name, tmp_path / "project" / name, ignore=ignore)
    shutil.copytree(ROOT / "notebooks", tmp_path / "project" / "notebooks")
    for target in (tmp_path / "project" / name for name in release.FILES + release.ELSEWHERE):
        if not target.exists():
            target.parent.mkdir(exist_ok=True)
            shutil.copy(ROOT / target.relative_to(tmp_path / "project"), target)
    return tmp_path / "project"


def files(folder):
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def notebook(folder, lab):
    return nbformat.read(folder / "notebooks" / f"{lab}.ipynb", as_version=4)


def run(kit, *command):
    """A program in the kit, as a student's: labkit is the kit's own."""
    env = {**os.environ, "PYTHONPATH": str(kit), "PYTHONUTF8": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run(
        [sys.executable, *command], cwd=kit, env=env, capture_output=True, encoding="utf-8", check=False
    )


# What is in it --------------------------------------------------------------------------------


def test_the_files_are_those_that_students_need(kit):
    named = {
        name
        for lab in LABS
        for cell in notebook(kit, lab).cells
        for name in re.findall(r'^check\("([\w-]+)"', cell.source)
    }
    files_of_labkit = [path for path in (ROOT / "labkit").rglob("*") if path.suffix in (".py", ".toml")]
    modules = [path.relative_to(ROOT).as_posix() for path in files_of_labkit]
    modules = [path for path in modules if not path.startswith("labkit/instructor/")]
    assert len(named) >= 3 * len(LABS)
    assert set(files(kit)) == {
        ".binder/postBuild",
        ".binder/requirements.txt",
        ".binder/runtime.txt",
        ".devcontainer/devcontainer.json",
        ".gitignore",
        ".vscode/extensions.json",
        "LICENSE",
        "README.md",
        "docs/pictures/lab1-explore.png",
        "docs/students.md",
        "environment.yml",
        "lab.py",
        "notebooks/glossary.md",
        "labkit/jupyter/overrides.json",
        "labkit/notebook/given.json",
        "pyproject.toml",
        "requirements.txt",
        *modules,
        *(f"labkit/checks/data/{name}.json" for name in named),
        *(f"notebooks/{lab}.ipynb" for lab in LABS),
    }
    for path in files(kit):
        if path != "README.md":
            assert (kit / path).read_bytes() == (ROOT / path).read_bytes(), path


@pytest.mark.parametrize("lab", LABS)
def test_the_notebooks_are_unanswered_and_were_never_run(kit, lab):
    content = notebook(kit, lab)
    nbformat.validate(content)
    assert not any("hidden" in cell.metadata.get("tags", []) for cell in content.cells)
    code = [cell for cell in content.cells if cell.cell_type == "code"]
    for cell in code:
        ast.parse(cell.source)
        assert not cell.outputs and cell.execution_count is None
    answers = [cell for cell in code if cell.metadata.labkit == "answer"]
    assert answers and all("raise NotImplementedError" in cell.source for cell in answers)


def secrets(lab):
    """Lines of solutions, hidden tests and hidden cells, with the build's own reading of the source."""
    for cell in percent.notebook(ROOT / "solutions" / f"{lab}.py").cells:
        inside = hidden = "hidden" in cell.metadata.get("tags", [])
        for line in cell.source.splitlines():
            if "### " in line and ("SOLUTION" in line or "HIDDEN TESTS" in line):
                inside = hidden or "BEGIN" in line
            elif inside and len(line.strip()) >= 25:
                yield line.strip()


def test_no_solution_and_no_hidden_cell_is_in_it(kit):
    shown = "\n".join(
        cell.source for lab in LABS for cell in build.student(percent.notebook(ROOT / "solutions" / f"{lab}.py")).cells
    )
    texts = {}
    for path in files(kit):
        if path.endswith(".ipynb"):
            cells = nbformat.read(kit / path, as_version=4).cells
            texts[path] = "\n".join(cell.source for cell in cells)
        elif not path.endswith(".png"):
            texts[path] = (kit / path).read_text(encoding="utf-8").replace(r"\"", '"')
    for lab in LABS:
        lines = list(secrets(lab))
        assert lines
        also_told = [line for line in lines if line in shown]
        assert len(also_told) <= 3, also_told  # a hint says it in so many words
        for line in set(lines) - set(also_told):
            assert [path for path, text in texts.items() if line in text] == [], line


def test_links_and_pictures_lead_somewhere(kit):
    texts = {path: (kit / path).read_text(encoding="utf-8") for path in ("README.md", "docs/students.md")}
    for lab in LABS:
        cells = notebook(kit, lab).cells
        texts[f"notebooks/{lab}.ipynb"] = "\n".join(c.source for c in cells if c.cell_type == "markdown")
    found = 0
    for path, text in texts.items():
        for target in re.findall(r"\[[^\]]*\]\(([^)\s]+)\)", text):
            if "://" not in target:
                assert ((kit / path).parent / target.partition("#")[0]).is_file(), (path, target)
                found += 1
    assert found >= 5 and "{" not in texts["README.md"]


# It works by itself ---------------------------------------------------------------------------


LOAD_ALL = """
import importlib, importlib.abc, pkgutil, sys

class Blocked(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in blocked:
            raise ModuleNotFoundError(f"students do not have {name}")

blocked = set(sys.argv[1:])
assert not blocked & sys.modules.keys()
sys.meta_path.insert(0, Blocked())
import labkit
names = [module.name for module in pkgutil.walk_packages(labkit.__path__, "labkit.")]
for name in set(names) - {"labkit.__main__"}:
    importlib.import_module(name)
print(labkit.__path__[0], len(names))
"""


def not_the_students():
    """The modules that tests and instructors have installed, and students do not."""
    lab, tests = (
        {line.partition("==")[0] for line in (ROOT / name).read_text().splitlines() if "==" in line}
        for name in ("requirements.txt", "tests/requirements.txt")
    )
    found = {
        module: {name.lower().replace("_", "-").replace(".", "-") for name in names}
        for module, names in packages_distributions().items()
    }
    return sorted(module for module, names in found.items() if names <= tests - lab)


def test_every_module_loads_with_what_students_have_installed(kit):
    blocked = not_the_students()
    assert {"pytest", "nbval", "jupytext", "playwright", "distributed"} <= set(blocked)
    assert not {"numpy", "labkit", "jinja2", "nbformat"} & set(blocked)
    done = run(kit, "-c", LOAD_ALL, *blocked)
    assert done.returncode == 0, done.stderr
    modules = [path for path in files(kit) if path.endswith(".py") and path.startswith("labkit/")]
    assert done.stdout.strip() == f"{kit / 'labkit'} {len(modules) - 1}"


def test_help_names_only_what_is_in_it(kit):
    for command, there, absent in [
        (["lab.py", "--help"], ["setup", "check|data"], ["test [", "grade", "release", "sandbox", "build"]),
        (["-m", "labkit", "--help"], ["check", "data"], ["grade", "release", "sandbox", "build"]),
    ]:
        said = run(kit, *command).stdout
        assert all(word in said for word in there) and not any(word in said for word in absent), said
    for command in (["lab.py", "--help"], ["-m", "labkit", "--help"]):
        said = run(ROOT, *command).stdout
        assert all(word in said for word in ("check", "data", "grade", "release", "sandbox", "build")), said


def test_its_commands_run_or_say_that_this_is_the_students_kit(kit):
    done = run(kit, "-m", "labkit", "check", f"notebooks/{LABS[0]}.ipynb")
    assert done.returncode == 1, done.stderr
    assert "still to be written" in done.stdout and "0 of 3 checks passed." in done.stdout
    for command in (["-m", "labkit", "grade"], ["-m", "labkit", "build", "--check"], ["lab.py", "test"]):
        done = run(kit, *command)
        assert done.returncode == 2
        assert "students' kit" in done.stderr and done.stderr.count("\n") == 1


def test_what_the_installation_needs_is_there(kit):
    project = tomllib.loads((kit / "pyproject.toml").read_text(encoding="utf-8"))
    wheel = project["tool"]["hatch"]["build"]["targets"]["wheel"]
    needed = [project["tool"]["hatch"]["version"]["path"], *project["project"]["license-files"]]
    needed += [*wheel["packages"], *wheel["shared-data"]]
    assert [path for path in needed if not (kit / path).exists()] == []


# The zip --------------------------------------------------------------------------------------


def test_a_zip_holds_the_same_and_always_has_the_same_bytes(kit, project, tmp_path):
    first, second = tmp_path / "Übung 1.zip", tmp_path / "b.ZIP"
    assert release.release(ROOT, first) == files(kit)
    for path in project.rglob("*"):  # another checkout, by someone with other habits
        if path.is_file():
            path.chmod(0o700 if path.stat().st_mode & 0o100 else 0o600)
            os.utime(path, (1, 1))
    release.release(project, second)
    assert first.read_bytes() == second.read_bytes()
    with zipfile.ZipFile(first) as archive:
        modes = {item.filename: stat.S_IMODE(item.external_attr >> 16) for item in archive.infolist()}
        archive.extractall(tmp_path / "out")
    unpacked = tmp_path / "out" / "localization-labs"
    assert list(modes) == [f"localization-labs/{path}" for path in files(kit)]
    run = {name for name, mode in modes.items() if mode == 0o755}
    assert run == {f"localization-labs/{name}" for name in ("lab.py", ".binder/postBuild")}
    assert set(modes.values()) == {0o755, 0o644}
    assert all((unpacked / path).read_bytes() == (kit / path).read_bytes() for path in files(kit))
    assert os.name == "nt" or os.access(kit / "lab.py", os.X_OK)


# What is refused ------------------------------------------------------------------------------


def test_nothing_is_deleted_and_a_zip_is_replaced_only_by_force(tmp_path, capsys):
    (tmp_path / "thesis.txt").write_text("three years")
    old = tmp_path / "old.zip"
    old.write_text("handed out last year")
    (tmp_path / "folder.zip").mkdir()
    for out, told in [
        (tmp_path, "is not empty"),
        (tmp_path / "thesis.txt", "is a file"),
        (old, "is there already"),
        (tmp_path / "folder.zip", "is a folder"),
        (tmp_path / "thesis.txt" / "a", "cannot be"),
    ]:
        assert cli.main(["release", str(out)]) == 2
        assert told in capsys.readouterr().err
    assert cli.main(["release", str(tmp_path), "--force"]) == 2
    assert old.read_text() == "handed out last year"
    assert cli.main(["release", "--force", str(old)]) == 0
    assert zipfile.is_zipfile(old)
    assert files(tmp_path) == ["old.zip", "thesis.txt"]
    (tmp_path / "empty").mkdir()
    assert release.main(tmp_path / "empty") == 0


def edit(path, change):
    path.write_text(change(path.read_text(encoding="utf-8")), encoding="utf-8")


def add(path, text):
    return lambda project: edit(project / path, lambda old: f"{old}\n{text}\n")


def in_notebook(lab, change):
    """Spoil a notebook: `change` gets its cells by id."""

    def spoil(project):
        path = project / "notebooks" / f"{lab}.ipynb"
        content = json.loads(path.read_text(encoding="utf-8"))
        change({cell["id"]: cell for cell in content["cells"]})
        path.write_text(json.dumps(content), encoding="utf-8")

    return spoil


def own_answer(cells):
    cells["answer-repeat"]["source"] = "def repeat_R(R, p):\n    return my_own(R, p)"


def ran(cells):
    cells["setup"]["execution_count"] = 1


def in_metadata(cells):
    # In JSON its quotes are escaped.
    cells["setup"]["metadata"]["note"] = 'exam.same(stack, calls, "many landmarks")'


def in_checkdata(project):
    path = project / "labkit/checks/data/cartesian-stack.json"
    data = json.loads(path.read_text(encoding="utf-8"))
    data["mistakes"][0]["say"] = "    x = other(m, y)\n    return x"
    path.write_text(json.dumps(data), encoding="utf-8")


LAB1 = f"solutions/{LABS[0]}.py"
LEAKS = {
    "a solution in a document": (
        add("docs/students.md", "> K = np.linalg.solve(S, H @ self.Pk_k).T"),
        "docs/students.md holds `K = np.linalg.solve(S, H @ self.Pk_k).T`, which is secret in " + LAB1,
    ),
    "a wrapped solution in the README": (
        add("labkit/instructor/authoring/student_readme.md", "return np.kron(\n    np.eye( p ), R)"),
        "README.md holds `return np.kron(np.eye(p), R)`, which is secret in " + LAB1,
    ),
    "a model answer, wrapped anew": (
        add("labkit/robot.py", "# Being inside is cheap\n when the ellipse is large; and so on"),
        "which is secret in " + LAB1 + ", cell 'answer-q1'",
    ),
    "a graded check": (
        add("labkit/world.py", 'exam.same_run(KF, drive(exam.rng(), Map([]), steps=40), "without any landmark")'),
        "which is secret in " + LAB1 + ", cell 'grade-no-landmark'",
    ),
    "a rubric": (
        add("lab.py", "# inside is not enough, the ellipse must also be small; "),
        "which is secret in " + LAB1 + ", cell 'rubric-q1'",
    ),
    "a graded check in metadata": (in_notebook(LABS[0], in_metadata), "cell 'grade-stack'"),
    "an answer tried out": (
        in_notebook(LABS[0], own_answer),
        f"notebooks/{LABS[0]}.ipynb, cell 'answer-repeat' is not what " + LAB1 + " leaves for students",
    ),
    "a cell that was run": (
        in_notebook(LABS[1], ran),
        f"notebooks/{LABS[1]}.ipynb, cell 'setup' was run and holds outputs",
    ),
    "code in a check's numbers": (in_checkdata, "labkit/checks/data/cartesian-stack.json holds code"),
    "a marker without its partner": (
        lambda project: edit(project / LAB1, lambda old: old.replace("### END SOLUTION", "", 1)),
        "lacks its partner",
    ),
    "a file that is gone": (lambda project: (project / "lab.py").unlink(), "lab.py cannot be read"),
    "no notebook": (add(f"notebooks/{LABS[2]}.ipynb", "<<<<<<<"), "is not a notebook"),
}


@pytest.mark.slow
@pytest.mark.parametrize("spoil, told", LEAKS.values(), ids=LEAKS)
def test_what_gives_answers_away_is_refused(project, tmp_path, spoil, told):
    spoil(project)
    for out in (tmp_path / "out", tmp_path / "out.zip"):
        with pytest.raises(CommandError, match=re.escape(told)):
            release.release(project, out)
        assert not out.exists()


def test_a_lab_that_was_begun_and_not_built_is_told(project, tmp_path):
    (project / "notebooks" / f"{LABS[1]}.ipynb").unlink()
    with pytest.raises(CommandError, match=f"^{LABS[1]} has no notebook yet: run `labkit build {LABS[1]}` first"):
        release.release(project, tmp_path / "kit.zip")


def test_without_solutions_there_is_nothing_to_release(kit, tmp_path):
    with pytest.raises(CommandError, match="a release is made from the full kit"):
        release.release(kit, tmp_path / "out")


def test_a_stray_file_stays_at_home(project, tmp_path):
    strays = ["notebooks/01_cartesian_ekf-Copy1.ipynb", "docs/exam.md", "labkit/checks/data/exam.json", ".env"]
    for stray in strays:
        (project / stray).write_text("secret")
    assert release.release(project, tmp_path / "out") == release.release(ROOT, tmp_path / "other")


def test_a_new_module_is_the_students_or_the_instructors_by_its_folder(project, tmp_path):
    """The one rule: everything in labkit is handed out, except labkit/instructor."""
    for name in ("labkit/lab9.py", "labkit/ninth/__init__.py", "labkit/instructor/lab9.py"):
        (project / name).parent.mkdir(exist_ok=True)
        (project / name).write_text("")
    added = set(release.release(project, tmp_path / "out")) - set(release.release(ROOT, tmp_path / "other"))
    assert added == {"labkit/lab9.py", "labkit/ninth/__init__.py"}
