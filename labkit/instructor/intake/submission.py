"""From a student's notebook to what the worker runs: their answers and own cells, the rest as released."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from ...notebook.read import Cell

LONGEST = 200_000  # characters of one cell; an answer has a thousand


@dataclass
class Work:
    """cells: for the worker, as dictionaries;  sources: {label: source} of them;  answers: {id: text} of the
    written questions;  notes: sentences on what was too long.
    """

    cells: list[dict] = field(default_factory=list)
    sources: dict[str, str] = field(default_factory=dict)
    answers: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def assemble(released: Sequence[Cell], cells: Sequence[Cell]) -> Work:
    """The Work of a submission: the cells of the students' notebook as it was handed out, and of the one handed in.

    Answers are found by their id; cells that the student added keep their place behind the released cell that they
    follow; everything else is taken from the release.
    """
    work, known = Work(), {cell.id: cell for cell in released}
    answers: dict[str, Cell] = {}
    own: dict[str, list[Cell]] = {"": []}  # what follows each released cell; "" stands for the top
    last = ""
    for cell in cells:
        if cell.id in known and cell.id not in own:
            last = cell.id
            own[last] = []
            if known[last].role == "answer" and cell.code == known[last].code:
                answers[last] = cell
        elif cell.code:
            own[last].append(cell)
    for cell in released:
        if cell.role == "answer" and not cell.code:
            text = answers[cell.id].source if cell.id in answers else ""
            work.answers[cell.id] = "" if text.strip() == cell.source.strip() else text[:LONGEST]
            if len(text) > LONGEST:
                work.notes.append(f"Of {cell.label} only the first {LONGEST} characters are shown.")
    for cell in own[""]:
        _add(work, cell, "", "own", cell.source)
    for cell in released:
        if cell.code and cell.role != "check":
            source = answers[cell.id].source if cell.id in answers else cell.source
            _add(work, cell, cell.id, cell.role, source)
        for more in own.get(cell.id, []):
            _add(work, more, "", "own", more.source)
    return work


def _add(work, cell, id, role, source):
    if len(source) > LONGEST:
        work.notes.append(f"The code of {cell.label} has more than {LONGEST} characters and was left out.")
        return
    work.cells.append({"number": cell.number, "id": id, "role": role, "code": True, "source": source})
    work.sources[f"cell '{id}'" if id else f"cell {cell.number}"] = source
