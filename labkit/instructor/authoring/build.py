"""Make the notebooks from their one source, `solutions/NN_name.py` (for maintainers: `labkit build`).

From each script come `solutions/NN_name.ipynb`, run, with its outputs: the reference that nbval
compares with; and `notebooks/NN_name.ipynb`, the student's: solutions replaced by stubs, hidden
parts and outputs gone.  The markers are nbgrader's.
"""

import os
import re
import sys
from pathlib import Path

import jupytext
import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from nbconvert.preprocessors import ClearOutputPreprocessor, TagRemovePreprocessor
from traitlets.config import Config

from .. import files
from ..records import CommandError
from . import numbers

ROOT = Path(__file__).resolve().parents[3]
WIDGET = "application/vnd.jupyter.widget-view+json"
ROLES = ("setup", "answer", "check")

_SOLUTION = re.compile(r"^([ \t]*)### BEGIN SOLUTION\n(.*?)^[ \t]*### END SOLUTION\n?", re.M | re.S)
_HIDDEN = re.compile(r"^[ \t]*### BEGIN HIDDEN TESTS\n.*?^[ \t]*### END HIDDEN TESTS\n?", re.M | re.S)
_MARKER = re.compile(r"^[ \t]*### (BEGIN|END) SOLUTION\n?", re.M)


class DriftError(CommandError):
    """A source that cannot be built, or a built file that no longer agrees with its source."""


def main(names=(), check=False, run=True):
    """Build (or with `check` only compare) the labs called `names`, by default all; exit status."""
    scripts = [p for p in sorted((ROOT / "solutions").glob("[0-9]*_*.py")) if not names or p.stem in names]
    if missing := set(names) - {p.stem for p in scripts}:
        print(f"There is no solutions/{min(missing)}.py.", file=sys.stderr)
        return 2
    problems = []
    try:
        if check:
            problems += [f"labkit/checks/data/{name}.json is out of date" for name in numbers.stale(ROOT)]
        else:
            numbers.write(ROOT)
        for script in scripts:
            problems += compare(script, run) if check else write(script, run)
    except CommandError as error:
        problems.append(str(error))
    for problem in problems:
        print(problem, file=sys.stderr)
    if problems and check:
        print("Run `labkit build` and commit what it writes.", file=sys.stderr)
    elif not problems:
        print(f"{len(scripts)} labs {'are up to date' if check else 'built'}.")
    return 1 if problems else 0


def source(script):
    """The notebook in a percent-format script: every cell with an id and a role."""
    notebook = jupytext.read(script, fmt="py:percent")
    ids = set()
    for number, cell in enumerate(notebook.cells, 1):
        tags = cell.metadata.get("tags", [])
        kind = "show" if cell.cell_type == "code" else "text"
        cell.id = cell.metadata.pop("id", f"{kind}-{number:02d}")
        if cell.id in ids:
            raise DriftError(f"{script.name}: two cells have the id '{cell.id}'")
        ids.add(cell.id)
        roles = [role for role in ROLES if role in tags and "hidden" not in tags]
        cell.metadata["labkit"] = role = roles[0] if roles else kind
        if role == "answer" or "points" in cell.metadata:
            cell.metadata["nbgrader"] = _graded(cell, role, cell.metadata.pop("points", None))
    notebook.nbformat, notebook.nbformat_minor = 4, 5
    notebook.metadata = nbformat.from_dict(
        {
            "kernelspec": {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"},
            "language_info": {"name": "python"},
        }
    )
    return notebook


def _graded(cell, role, points):
    """What a cell counts, in nbgrader's schema: an answer of text is marked by hand, a check by itself."""
    marks = {
        "schema_version": 3,
        "grade_id": cell.id,
        "cell_type": cell.cell_type,
        "task": False,
        "grade": points is not None,
        "solution": role == "answer",
        "locked": role != "answer",
    }
    return marks | ({"points": points} if points is not None else {})


def student(notebook):
    """The student's copy: stubs for solutions, no hidden part, no output."""
    copy = nbformat.from_dict(notebook)
    copy, _ = TagRemovePreprocessor(config=Config(TagRemovePreprocessor={"remove_cell_tags": ["hidden"]})).preprocess(
        copy, {}
    )
    copy, _ = ClearOutputPreprocessor().preprocess(copy, {})
    for cell in copy.cells:
        if cell.cell_type == "code":
            cell.source = _SOLUTION.sub(lambda m: _stub(cell, m), _HIDDEN.sub("", cell.source)).rstrip()
        else:
            cell.source = _SOLUTION.sub("*Write your answer here (double-click to edit).*\n", cell.source).rstrip()
        if "SOLUTION" in cell.source or "HIDDEN TESTS" in cell.source:
            raise DriftError(f"cell '{cell.id}' has a solution or hidden marker without its partner")
    return copy


def _stub(cell, match):
    """`raise NotImplementedError`, naming the function that is to be written."""
    names = re.findall(r"^\s*(?:def|class) (\w+)", cell.source[: match.start()], re.M)
    if not names:
        raise DriftError(f"cell '{cell.id}': a solution outside any function has no stub")
    return f'{match[1]}raise NotImplementedError("`{names[-1]}` is still to be written.")\n'


def teacher(notebook, folder, run=True):
    """The instructor's copy, run in `folder`: answers in the text without their markers."""
    copy = nbformat.from_dict(notebook)
    for cell in copy.cells:
        if cell.cell_type == "markdown":
            cell.source = _MARKER.sub("", cell.source).rstrip()
    if run:
        # Where no window can open, figures go into the notebook all the same.
        os.environ.setdefault("PYTHONUTF8", "1")
        try:
            NotebookClient(copy, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
        except CellExecutionError as error:
            raise DriftError(f"a solution stops:\n{error}") from error
    copy.metadata.pop("widgets", None)
    for cell in copy.cells:
        cell.metadata.pop("execution", None)
        if "outputs" in cell:
            cell.outputs = _joined(cell.outputs)
        for output in cell.get("outputs", []):
            # A stored widget is dead without its kernel and would hide the picture stored beside it.
            output.get("data", {}).pop(WIDGET, None)
    return copy


def write(script, run=True):
    """Write both notebooks of a script; no problems can be left, so the list is empty."""
    notebook = source(script)
    print(f"{script.stem} ...", flush=True)
    _save(student(notebook), ROOT / "notebooks" / f"{script.stem}.ipynb")
    target = script.with_suffix(".ipynb")
    made = teacher(notebook, script.parent, run)
    if not run and target.exists():  # keep the outputs of cells that did not change
        old = {cell.id: cell for cell in nbformat.read(target, as_version=4).cells}
        for cell in made.cells:
            if cell.cell_type == "code" and cell.id in old and old[cell.id].source == cell.source:
                cell.outputs, cell.execution_count = old[cell.id].outputs, old[cell.id].execution_count
    _save(made, target)
    return []


def compare(script, run=True):
    """Sentences about what differs between the built notebooks of a script and what it gives now."""
    notebook, problems = source(script), []
    pairs = [
        (ROOT / "notebooks" / f"{script.stem}.ipynb", student(notebook), False),
        (script.with_suffix(".ipynb"), teacher(notebook, script.parent, run), run),
    ]
    for path, fresh, outputs in pairs:
        where = f"{path.parent.name}/{path.name}"
        if not path.exists():
            problems.append(f"{where} is missing")
            continue
        stored = nbformat.read(path, as_version=4)
        for old, new in zip(stored.cells, fresh.cells):
            if (old.id, old.source, old.metadata) != (new.id, new.source, new.metadata):
                problems.append(f"{where}: cell '{new.id}' differs from {script.name}")
            elif outputs and "nbval-ignore-output" not in new.metadata.get("tags", []) and _texts(old) != _texts(new):
                problems.append(f"{where}: cell '{new.id}' prints something else when it is run")
        if len(stored.cells) != len(fresh.cells):
            problems.append(f"{where} has {len(stored.cells)} cells, {script.name} has {len(fresh.cells)}")
    return problems


def _texts(cell):
    return [out.get("text") or out.get("data", {}).get("text/plain") for out in _joined(cell.get("outputs", []))]


def _joined(outputs):
    """Outputs with what was printed in one go in one piece: how many messages it came in is chance."""
    joined = []
    for output in map(nbformat.from_dict, outputs):
        last = joined[-1] if joined else {}
        if output.output_type == "stream" == last.get("output_type") and output.name == last.name:
            last.text += output.text
        else:
            joined.append(output)
    return joined


def _save(notebook, path):
    nbformat.validate(notebook)
    path.parent.mkdir(exist_ok=True)
    files.write(path, nbformat.writes(notebook) + "\n")
