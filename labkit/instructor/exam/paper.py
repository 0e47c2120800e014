"""The examination paper of a lab: its check cells and questions, read from the solution notebook."""

import ast
import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ...notebook.read import Cell, NotebookError, read as read_notebook
from ..authoring.spec import defined, imports
from ..records import Check, CommandError
from .exam import ROOT
from .record import recorded


@dataclass(frozen=True)
class CheckCell:
    """A cell that every student's code meets: a check, or (without points) the figure's.

    printed: what it prints when it passes;  uses: those of the students' names that stand in it;
    draws: the good ones, see `labkit.instructor.exam.bite`;  divided: the filter whose `parts` get the points,
    {part: per cent}, if any.
    """

    id: str
    title: str
    points: float | None
    hidden: bool
    source: str
    printed: str
    uses: tuple[str, ...]
    draws: tuple[int, ...] = ()
    divided: str = ""
    parts: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Paper:
    """lab: its name;  title: of the notebook;  setup: the code that runs first;  cells: of the checks;
    checks: all that gives points, in order;  released: the cells of the students' notebook;
    subjects: the names that students define;  digest: of all that decides about marks.
    """

    lab: str
    title: str
    setup: str
    cells: list[CheckCell]
    checks: list[Check]
    released: list[Cell]
    subjects: list[str]
    digest: str


def read(lab: str, root: Path = ROOT) -> Paper:
    """The Paper of a lab. Raises CommandError if there is none or if it cannot be used."""
    book, released = _books(lab, root)
    subjects = defined(book)
    setup = _setup(book)
    found = recorded(root).get(lab, {})
    cells = [_check_cell(cell, subjects, found.get(cell.id, {})) for cell in book if _is_check_cell(cell)]
    checks = [_check(cell, book) for cell in book if _points(cell) is not None]
    if not any(not check.hand for check in checks):
        raise CommandError(f"solutions/{lab}.ipynb has no check with points.")
    shown = {cell.id for cell in released}
    if missing := [check.id for check in checks if not check.hidden and check.id not in shown]:
        raise CommandError(f"notebooks/{lab}.ipynb lacks {missing[0]}: run `labkit build`.")
    if silent := [cell.id for cell in cells if cell.points is not None and not cell.printed]:
        raise CommandError(
            f"solutions/{lab}.ipynb: the check '{silent[0]}' has no output to compare with: run `labkit build`."
        )
    cells.sort(key=lambda cell: cell.points is not None)  # figures first, before anything secret is asked
    title = next((c.source.lstrip("# ").splitlines()[0] for c in book if c.source.startswith("# ")), lab)
    digest = _digest(setup, cells, released)
    return Paper(lab, title, "\n".join(setup), cells, checks, released, subjects, digest)


def gives_points(lab: str, root: Path = ROOT) -> bool:
    """Whether anything in a lab counts: open explorations do not. Raises CommandError as `read` does."""
    return any(_points(cell) is not None for cell in _books(lab, root)[0])


def _books(lab, root):
    """The cells of the solution and of the students' notebook."""
    paths = root / "solutions" / f"{lab}.ipynb", root / "notebooks" / f"{lab}.ipynb"
    if not all(path.is_file() for path in paths):
        known = ", ".join(sorted(path.stem for path in (root / "solutions").glob("[0-9]*.ipynb")))
        raise CommandError(
            f"There is no lab {lab!r} with a solution; there are: {known or 'none (is this the full kit?)'}."
        )
    try:
        return [read_notebook(path) for path in paths]
    except NotebookError as error:
        raise CommandError(f"{error} `labkit build` makes it anew.") from None


def _points(cell):
    """What a cell counts, or None if it gives no points."""
    marks = cell.metadata.get("nbgrader", {})
    return float(marks["points"]) if marks.get("grade") else None


def _parts(cell):
    """(the filter, {part: per cent}) of a cell whose points are divided, or ('', {})."""
    return next(iter(cell.metadata.get("parts", {}).items()), ("", {}))


def _is_hidden(cell):
    return "hidden" in cell.tags


def _is_setup(cell):
    return cell.code and "setup" in cell.tags


def _is_check_cell(cell):
    return cell.code and not _is_setup(cell) and (_is_hidden(cell) or _points(cell) is not None)


def _setup(book):
    """The sources that run first; of what students see, only the imports that hidden cells need."""
    hidden = [cell.source for cell in book if cell.code and _is_hidden(cell)]
    needed = {word for source in hidden for word in re.findall(r"\w+", source)}
    return [cell.source if _is_hidden(cell) else imports(cell.source, needed) for cell in book if _is_setup(cell)]


def _check_cell(cell, subjects, found):
    names = {node.id for node in ast.walk(ast.parse(cell.source)) if isinstance(node, ast.Name)}
    uses = tuple(name for name in subjects if name in names)
    draws = tuple(found.get("draws", ()))
    about = cell.id, _title(cell), _points(cell), _is_hidden(cell)
    return CheckCell(*about, cell.source, cell.printed, uses, draws, *_parts(cell))


def _check(cell, book):
    """The Check of a cell with points: a check cell, or the answer to a written question."""
    if cell.code:
        subject, parts = _parts(cell)
        return Check(cell.id, _title(cell), _points(cell), hidden=_is_hidden(cell), subject=subject, parts=parts)
    rubric = next((other.source for other in book if other.id == cell.id.replace("answer", "rubric")), "")
    question = _question(book, cell.id)
    return Check(cell.id, _title(cell), _points(cell), True, False, question, rubric, model=cell.source)


def _title(cell):
    return cell.metadata.get("title", cell.id)


def _question(book: Sequence[Cell], id: str) -> str:
    """The question that an answer cell answers: what stands under the last heading 'Question' before it.

    Where no heading says so, it is the last text before the answer; nothing from before the answer that came last.
    """
    texts: list[str] = []
    for cell in book:
        if cell.id == id:
            break
        if cell.role == "answer":
            texts.clear()
        elif not cell.code and not _is_hidden(cell):
            texts.append(cell.source)
    for text in reversed(texts):
        headings = list(re.finditer(r"^(#+ |\*\*).*$", text, re.M))
        for number, heading in reversed(list(enumerate(headings))):
            if "question" in heading[0].lower():
                after = [other.start() for other in headings[number + 1 :] if other[0].startswith("#")]
                return text[heading.start() : min(after, default=None)].strip()
    return texts[-1].strip() if texts else ""


def _digest(setup, cells, released):
    parts = [
        setup,
        [(c.id, c.source, c.printed, c.points, c.draws, c.parts) for c in cells],
        [c.source for c in released],
    ]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()
