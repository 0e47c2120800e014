"""`labkit export nbgrader`: a course folder of nbgrader, with a source assignment for each lab."""

import secrets
from collections.abc import Sequence
from pathlib import Path

import nbformat
from nbformat import NotebookNode

from ..authoring import build, percent
from ..authoring.release import Kit
from ..exam.paper import read
from ..records import STUB
from ..report.texts import counted

CONFIG = "nbgrader_config.py"
TEMPLATE = Path(__file__).with_name("templates") / "nbgrader_config.txt"
END = "### END SOLUTION"
# nbgrader shows students these lines in their feedback, so they name the check and no more. They run only where
# the configuration was left at home: then nobody gets points by mistake.
GUARD = f"""\
### BEGIN HIDDEN TESTS
raise SystemError("labkit marks this cell, where the course has its {CONFIG}.")
### END HIDDEN TESTS"""


def files(labs: Sequence[str], allowed: Sequence[str]) -> Kit:
    """What a course folder gets. allowed: see `ALLOWED`. Raises CommandError for what is no lab with points.

    Where nbgrader's configuration is there already it stays: it holds what the students' inputs are drawn from.
    """
    words = {"STUB": repr(STUB), "SEED": str(secrets.randbelow(2**31)), "ALLOWED": repr([*allowed])}
    config = TEMPLATE.read_text(encoding="utf-8")
    for word, text in words.items():
        config = config.replace(word, text)
    kit: Kit = {CONFIG: (config.encode(), 0o644)}
    for lab in labs:
        kit[f"source/{lab}/{lab}.ipynb"] = (nbformat.writes(source(lab)) + "\n").encode(), 0o644
    return kit


def source(lab: str) -> NotebookNode:
    """The source notebook of a lab, from which nbgrader makes the students'. Raises CommandError."""
    read(lab)
    made = build.notebook_of(build.ROOT / "solutions" / f"{lab}.py")
    rubrics = {cell.id: cell.source for cell in made.cells if cell.id.startswith("rubric-")}
    made.cells = [cell for cell in made.cells if not _is_hidden(cell) or _points(cell) is not None]
    for cell in made.cells:
        cell.source = _source(cell, rubrics)
        cell.metadata = _metadata(cell)
    nbformat.validate(made)
    return made


def _source(cell, rubrics):
    if _is_hidden(cell):
        return f"# Graded later: {cell.metadata.get('title', cell.id)} ({counted(_points(cell), 'point')})\n{GUARD}"
    if cell.cell_type == "code" and _points(cell) is not None:
        return f"{GUARD}\n{cell.source}"
    if cell.metadata.labkit == "guess":
        return percent.unmade(cell.id, cell.source)
    if rubric := rubrics.get(cell.id.replace("answer", "rubric")):
        return cell.source.replace(END, f"\n{rubric}\n{END}")
    return cell.source


def _metadata(cell):
    """As students' notebooks have it; a hidden check looks like any other."""
    kept = {key: value for key, value in cell.metadata.items() if key not in ("tags", "parts")}
    tags = [] if _is_hidden(cell) else cell.metadata.get("tags", [])
    role = "check" if _is_hidden(cell) else cell.metadata.labkit
    return nbformat.from_dict({**kept, "labkit": role, **({"tags": tags} if tags else {})})


def _is_hidden(cell):
    return "hidden" in cell.metadata.get("tags", [])


def _points(cell):
    marks = cell.metadata.get("nbgrader", {})
    return marks["points"] if marks.get("grade") else None
