"""The examination paper of a lab: its check cells and questions, read from the solution notebook."""

import ast
import hashlib
import json
import re
from dataclasses import dataclass
from pathlib import Path

from ...notebook.read import read as read_notebook
from ..authoring.spec import imports
from ..records import Check, CommandError
from .exam import ROOT


@dataclass(frozen=True)
class CheckCell:
    """A cell that every student's code meets: a check, or (without points) the figure's."""

    id: str
    title: str
    points: float | None
    hidden: bool
    source: str
    printed: str
    uses: tuple


@dataclass(frozen=True)
class Paper:
    """lab: its name;  title: of the notebook;  setup: the code that runs first;  cells: of the checks;
    checks: all that gives points, in order;  released: the cells of the students' notebook;
    subjects: the names that students define;  digest: of all that decides about marks.
    """

    lab: str
    title: str
    setup: str
    exam: str
    cells: list
    checks: list
    released: list
    subjects: list
    digest: str


def read(lab, root=ROOT):
    """The Paper of a lab. Raises CommandError if there is none or if it cannot be used."""
    solution, student = Path(root) / "solutions" / f"{lab}.ipynb", Path(root) / "notebooks" / f"{lab}.ipynb"
    if not solution.is_file() or not student.is_file():
        known = ", ".join(sorted(p.stem for p in (Path(root) / "solutions").glob("[0-9]*.ipynb")))
        raise CommandError(
            f"There is no lab {lab!r} with a solution; there are: {known or 'none (is this the full kit?)'}."
        )
    book, released = read_notebook(solution), read_notebook(student)
    shown = {cell.id for cell in released}
    subjects = _defined([cell.source for cell in book if cell.role == "answer" and cell.code])
    setup, cells, checks = [], [], []
    needed = {word for cell in book if cell.code and "hidden" in cell.tags for word in re.findall(r"\w+", cell.source)}
    for cell in book:
        marks = cell.metadata.get("nbgrader", {})
        hidden = "hidden" in cell.tags
        if cell.code and "setup" in cell.tags:
            setup.append(cell.source if hidden else imports(cell.source, needed))
        elif cell.code and hidden or marks.get("grade") and cell.code:
            points = float(marks["points"]) if marks.get("grade") else None
            title = cell.metadata.get("title", cell.id)
            if points is not None and not cell.printed:
                raise CommandError(
                    f"{solution.name}: the check '{cell.id}' has no output to compare with: run `labkit build`."
                )
            uses = _uses(cell.source, subjects)
            cells.append(CheckCell(cell.id, title, points, hidden, cell.source, cell.printed, uses))
            if points is not None:
                checks.append(Check(cell.id, title, points, hidden=hidden))
        elif marks.get("grade"):
            rubric = next((c.source for c in book if c.id == cell.id.replace("answer", "rubric")), "")
            title = cell.metadata.get("title", cell.id)
            question = _question(book, cell.id)
            checks.append(Check(cell.id, title, float(marks["points"]), True, False, question, rubric))
    if not any(not check.hand for check in checks):
        raise CommandError(f"{solution.name} has no check with points.")
    cells.sort(key=lambda cell: cell.points is not None)  # figures first, before anything secret is asked
    title = next((c.source.lstrip("# ").splitlines()[0] for c in book if c.source.startswith("# ")), lab)
    parts = [setup, [(c.id, c.source, c.printed, c.points) for c in cells], [c.source for c in released]]
    digest = hashlib.sha256(json.dumps(parts).encode()).hexdigest()
    missing = [c.id for c in checks if not c.hidden and c.id not in shown]
    if missing:
        raise CommandError(f"notebooks/{lab}.ipynb lacks {missing[0]}: run `labkit build`.")
    return Paper(lab, title, "\n".join(setup), "exam", cells, checks, released, subjects, digest)


def _defined(sources):
    nodes = [node for source in sources for node in ast.parse(source).body]
    return [node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.ClassDef)]


def _uses(source, subjects):
    """Which of the students' names a check cell uses."""
    names = {node.id for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Name)}
    return tuple(name for name in subjects if name in names)


def _question(cells, id):
    """The text before an answer cell: the question."""
    at = next(i for i, cell in enumerate(cells) if cell.id == id)
    texts = [c.source for c in cells[:at] if not c.code and "Question" in c.source]
    return texts[-1] if texts else ""
