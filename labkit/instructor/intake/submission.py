"""From a student's notebook to what is graded: its code for the worker, its written answers for a person."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ...notebook.read import Cell, labels
from ..authoring.spec import defined
from ..records import HandInError
from .guesses import guesses
from .names import listed
from .written import written

LONGEST = 200_000  # characters of one cell; an answer has a thousand


@dataclass
class Work:
    """cells: the code, for the worker, as dictionaries;  sources: {label: source} of them;  answers: {id: Markdown}
    of the written questions, and letters of predictions;  notes: sentences on what is missing, too long or in no
    place;  files: {path: content} that were handed in beside the notebook.
    """

    cells: list[dict] = field(default_factory=list)
    sources: dict[str, str] = field(default_factory=dict)
    answers: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    files: dict[str, bytes] = field(default_factory=dict)


def assemble(released: Sequence[Cell], cells: Sequence[Cell], files: Mapping[str, bytes] | None = None) -> Work:
    """The Work of a submission: all code that the student's notebook has, in its order, and the written answers.

    released: the cells of the students' notebook as it was handed out;  cells: those that were handed in. Raises
    HandInError if they have nothing of this lab.
    """
    work = Work(files=dict(files or {}))
    label_of = labels(cells)
    _refuse_others(released, cells)
    for cell in cells:
        is_code = cell.code or re.search(r"(?m)^(class|def) \w+", cell.source)  # a session looks at such a text cell
        if is_code and cell.source.strip():
            _add(work, cell, label_of[cell.number])
    answers, notes = written(released, cells)
    work.answers = answers | guesses(cells)
    text = "\n".join(cell["source"] for cell in work.cells)
    missing = [f"`{name}`" for name in defined(released) if not _makes(text, name)]
    if missing and not (re.search(r"import \*|%run|\bexec\(|\bglobals\(", text) or _renames(text, released)):
        notes = [f"Nothing in the notebook defines {listed(missing)}.", *notes]
    work.notes += notes
    return work


def _makes(text, name):
    """Whether some line of code looks as if it made `name`; the code has not run yet."""
    ways = rf"\b(class|def) {name}\b|^\s*{name}\b[^=\n(]*=(?!=)|\b(import|as|for)\b.*\b{name}\b"
    return re.search(ways, text, re.MULTILINE) is not None


def _renames(text, released):
    """Whether a check is given something that has another name than in the lab."""
    given = set(re.findall(r"""(?m)^\s*check\(\s*["'][\w-]+["'],\s*(\w+)""", text))
    return any(_makes(text, name) for name in given - set(defined(released)))


def _refuse_others(released, cells):
    """Raise HandInError for a notebook of another lab, or of none."""
    calls = re.compile(r"""(?m)^\s*check\(\s*["']([\w-]+)["']""")
    ours = {name for cell in released for name in calls.findall(cell.source)}
    called = {name for cell in cells if cell.code for name in calls.findall(cell.source)}
    names, known = defined(released), {cell.id for cell in released}
    if called and ours and not called & ours:
        raise HandInError(f"It is the notebook of another lab: it calls check({min(called)!r}).")
    lines = {line.strip() for cell in released for line in cell.source.splitlines() if len(line.strip()) > 20}
    own = "\n".join(cell.source for cell in cells)
    has_name = any(re.search(rf"\b(class|def) {name}\b|(?m:^){name} *=", own) for name in names)
    has_line = any(line.strip() in lines for line in own.splitlines())
    if not (has_name or has_line or any(cell.id in known for cell in cells)):
        raise HandInError(
            f"Nothing of this lab is in it, neither its text nor {listed([f'`{name}`' for name in names])}: hand in "
            "the notebook that was given out, filled in and saved."
        )


def _add(work, cell, label):
    if len(cell.source) > LONGEST:
        work.notes.append(f"The code of {label} has more than {LONGEST} characters and was left out.")
        return
    work.cells.append(
        {"number": cell.number, "id": cell.id, "role": cell.role, "code": cell.code, "source": cell.source}
    )
    work.sources[label] = cell.source
