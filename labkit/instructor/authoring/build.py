"""Make the notebooks from their one source, `solutions/NN_name.py` (for maintainers: `labkit build`).

From each script come `solutions/NN_name.ipynb`, run, with its outputs: the reference that nbval
compares with; and `notebooks/NN_name.ipynb`, the student's: solutions replaced by stubs, hidden
parts and outputs gone.  The markers are nbgrader's.
"""

import ast
import re
import sys
from collections.abc import Collection
from pathlib import Path

import nbformat
from nbconvert.preprocessors import ClearOutputPreprocessor, TagRemovePreprocessor
from nbformat import NotebookNode
from traitlets.config import Config

from ...notebook.read import read
from .. import files
from ..records import STUB, CommandError
from . import asked, given, glossary, numbers, percent, proof, spec
from .executed import StoppedError, execute, joined

ROOT = Path(__file__).resolve().parents[3]

_SOLUTION = re.compile(r"^([ \t]*)### BEGIN SOLUTION\n(.*?)^[ \t]*### END SOLUTION\n?", re.M | re.S)
_HIDDEN = re.compile(r"^[ \t]*### BEGIN HIDDEN TESTS\n.*?^[ \t]*### END HIDDEN TESTS\n?", re.M | re.S)
_MARKER = re.compile(r"^[ \t]*### (BEGIN|END) SOLUTION\n?", re.M)


def main(names: Collection[str] = (), check: bool = False, run: bool = True) -> int:
    """Build (or with `check` only compare) the labs called `names`, by default all; exit status."""
    scripts = [p for p in sorted((ROOT / "solutions").glob("[0-9]*_*.py")) if not names or p.stem in names]
    if missing := set(names) - {p.stem for p in scripts}:
        print(f"There is no solutions/{min(missing)}.py.", file=sys.stderr)
        return 2
    problems = []
    try:
        checks, labs = spec.definitions(ROOT), [p.stem for p in (ROOT / "solutions").glob("[0-9]*_*.py")]
        known = {one.name for one in checks}
        problems = [problem for script in scripts for problem in proof.problems(script, known)]
        if problems := problems + asked.problems(checks, sorted(labs)):
            print("\n".join(problems), file=sys.stderr)
            return 1
        if check:
            problems += [f"labkit/checks/data/{name}.json is out of date" for name in numbers.stale(ROOT)]
            problems += ["labkit/notebook/given.json is out of date"] if given.stale(ROOT) else []
            problems += [f"{glossary.PAGE} is out of date"] if glossary.stale(ROOT) else []
        else:
            numbers.write(ROOT, labs=names)
        for script in scripts:
            if check:
                problems += compare(script, run)
            else:
                write(script, run)
        if not check:
            given.write(ROOT)
            glossary.write(ROOT)
    except CommandError as error:
        problems.append(str(error))
    for problem in problems:
        print(problem, file=sys.stderr)
    if problems and check:
        print("Run `labkit build` and commit what it writes.", file=sys.stderr)
    elif not problems:
        what = f"{len(scripts)} lab{'s' if len(scripts) != 1 else ''}"
        print(f"{what} {'up to date' if check else 'built'}.")
    return 1 if problems else 0


def notebook_of(script: Path) -> NotebookNode:
    """The notebook in a script; checks of a filter say how their points are divided among its parts."""
    notebook = percent.notebook(script)
    checks = spec.definitions(script.parents[1]) if (script.parent / "checks").is_dir() else []
    parts = {one.subject: one.divided.weights for one in checks if one.lab == script.stem and one.divided}
    for cell in notebook.cells:
        if cell.cell_type == "code" and "points" in cell.metadata.get("nbgrader", {}):
            used = {node.id for node in ast.walk(ast.parse(cell.source)) if isinstance(node, ast.Name)}
            if divided := {name: of for name, of in parts.items() if name in used}:
                cell.metadata["parts"] = divided
    return notebook


def student(notebook: NotebookNode) -> NotebookNode:
    """The student's copy: stubs for solutions, no hidden part, no output."""
    copy = nbformat.from_dict(notebook)
    hidden = Config(TagRemovePreprocessor={"remove_cell_tags": ["hidden"]})
    copy, _ = TagRemovePreprocessor(config=hidden).preprocess(copy, {})
    copy, _ = ClearOutputPreprocessor().preprocess(copy, {})
    for cell in copy.cells:
        cell.source = _unanswered(cell).rstrip()
        if cell.metadata.labkit == "guess":
            cell.source = percent.unmade(cell.id, cell.source)
        if "SOLUTION" in cell.source or "HIDDEN TESTS" in cell.source:
            raise CommandError(f"cell '{cell.id}' has a solution or hidden marker without its partner")
    return copy


def _unanswered(cell):
    """The source of a cell with stubs for its solutions."""
    if cell.cell_type == "code":
        return _SOLUTION.sub(lambda match: _stub(cell, match), _HIDDEN.sub("", cell.source))
    return _SOLUTION.sub(f"{STUB}\n", cell.source)


def _stub(cell, match):
    """`raise NotImplementedError`, naming the function that is to be written."""
    names = re.findall(r"^\s*(?:def|class) (\w+)", cell.source[: match.start()], re.M)
    if not names:
        raise CommandError(f"cell '{cell.id}': a solution outside any function has no stub")
    return f'{match[1]}raise NotImplementedError("`{names[-1]}` is still to be written.")\n'


def teacher(notebook: NotebookNode) -> NotebookNode:
    """The instructor's copy, not yet run: answers in the text without their markers."""
    copy = nbformat.from_dict(notebook)
    for cell in copy.cells:
        if cell.cell_type == "markdown":
            cell.source = _MARKER.sub("", cell.source).rstrip()
    return copy


def write(script: Path, run: bool = True) -> None:
    """Write both notebooks of a script. Raises CommandError."""
    notebook = notebook_of(script)
    print(f"{script.stem} ...", flush=True)
    _save(student(notebook), _students(script))
    target = script.with_suffix(".ipynb")
    made = teacher(notebook)
    if target.exists():
        _keep_outputs(made, target)
    _save(made, target)  # before it runs, as the exam in it reads the answers there
    if run:
        _save(_run(script, notebook), target)


def _run(script, notebook):
    try:
        return execute(teacher(notebook), script.parent)
    except StoppedError as stop:
        number, line, says = stop.args
        id = notebook.cells[number].id
        raise CommandError(f"{percent.place(script, number, line)}, cell '{id}', stops: {says}") from None


def _students(script):
    return ROOT / "notebooks" / f"{script.stem}.ipynb"


def _keep_outputs(made, target):
    """Take over the outputs of cells that did not change."""
    old = {cell.id: cell for cell in read(target)}
    for cell in made.cells:
        if cell.cell_type == "code" and cell.id in old and old[cell.id].source == cell.source:
            cell.outputs = joined(old[cell.id].stored["outputs"])
            cell.execution_count = old[cell.id].stored["execution_count"]


def compare(script: Path, run: bool = True) -> list[str]:
    """Sentences about what differs between the built notebooks of a script and what it gives now."""
    notebook, target = notebook_of(script), script.with_suffix(".ipynb")
    problems = _drift(_students(script), student(notebook), script) + _drift(target, teacher(notebook), script)
    if problems or not run:  # run with the answers of another notebook, the exam's cells would tell nothing
        return problems
    fresh = _run(script, notebook)
    return [
        f"{_where(target)}: cell '{new.id}' prints something else when it is run"
        for old, new in zip(read(target), fresh.cells)
        if "nbval-ignore-output" not in old.tags and _texts(old.stored) != _texts(new)
    ]


def _drift(path, fresh, script):
    """Sentences about cells of a built notebook that are not those which its script gives."""
    if not path.exists():
        return [f"{_where(path)} is missing"]
    stored = read(path)
    problems = [
        f"{_where(path)}: cell '{new.id}' differs from {script.name}"
        for old, new in zip(stored, fresh.cells)
        if (old.id, old.source, old.metadata) != (new.id, new.source, new.metadata)
    ]
    if len(stored) != len(fresh.cells):
        problems.append(f"{_where(path)} has {len(stored)} cells, {script.name} has {len(fresh.cells)}")
    return problems


def _where(path):
    return f"{path.parent.name}/{path.name}"


def _texts(cell):
    outputs = joined(cell.get("outputs", []))
    return ["".join(out.get("text") or out.get("data", {}).get("text/plain") or "") for out in outputs]


def _save(notebook, path):
    nbformat.validate(notebook)
    path.parent.mkdir(exist_ok=True)
    files.write(path, nbformat.writes(notebook) + "\n")
