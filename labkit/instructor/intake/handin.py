"""One notebook that was handed in, strictly read."""

import codecs
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

from ...notebook.read import Cell, NotebookError, cells_of, parse
from ..records import HandInError
from .names import readable, shorten

MAX_PARTS = 1_000_000  # lists and tables in one notebook: 20 MB of '[[],[],' would fill 500 MB
MAX_CELLS = 2_000


def tidy(cells: Sequence[Cell], ids: Mapping[str, bool]) -> tuple[list[Cell], list[str]]:
    """(cells, notes): each answer cell of the lab at most once, whatever the student did to it.

    ids: {id: whether it is a code cell} of the released lab's answer cells.
    Of several cells with one id the first with the role 'answer' counts; the others, and answer cells
    of unknown ids, become the student's own. Raises HandInError if no answer cell is left.
    """
    notes: list[str] = []
    chosen: dict[str, Cell] = {}
    for id in sorted(ids):
        found = [cell for cell in cells if cell.id == id]
        if not found:
            notes.append(f"The answer cell '{id}' is missing.")
            continue
        best = chosen[id] = _best(found, ids[id])
        if len({cell.source for cell in found}) > 1:
            notes.append(f"{len(found)} cells have the id '{id}': cell {best.number} counts as the answer.")
        if best.code is not ids[id]:
            kind = "a code cell" if ids[id] else "a text cell"
            notes.append(f"The answer cell '{id}' is no longer {kind}.")
    if not chosen:
        raise HandInError("It holds no answer cell of this lab: fill in the notebook that was given out.")
    return [_tidied(cell, chosen) for cell in cells], notes


def _best(found, code):
    return min(found, key=lambda cell: (cell.role != "answer", cell.code is not code, cell.number))


def _tidied(cell, chosen):
    if chosen.get(cell.id) is cell:
        return replace(cell, role="answer")
    if cell.id in chosen or cell.role == "answer":
        return replace(cell, id="", role="own")
    return cell


def read_cells(raw: bytes, name: str) -> list[Cell]:
    """The cells of a notebook's bytes, strictly read; raises HandInError."""
    raw = raw.removeprefix(codecs.BOM_UTF8)  # some editors of Windows write one
    if raw.count(b"[") + raw.count(b"{") > MAX_PARTS:
        raise HandInError(f"{name} holds too much data: clear the outputs, save it and hand it in again.")
    try:
        cells = cells_of(parse(raw, name, pairs=partial(_once, name)), name)
    except NotebookError as error:
        raise HandInError(shorten(str(error), 400)) from None
    if len(cells) > MAX_CELLS:
        raise HandInError(f"{name} has {len(cells)} cells, and {MAX_CELLS} is the most: merge or delete some.")
    return [_plain(cell) for cell in cells]


def _once(name, pairs):
    """The table of a JSON object whose keys are all different; raises NotebookError."""
    table = dict(pairs)
    if len(table) == len(pairs):
        return table
    seen = set()
    key = next(key for key, _ in pairs if key in seen or seen.add(key))
    key = shorten(readable(key))
    raise NotebookError(f'{name} says "{key}" twice in one place: save it again in Jupyter.')


def _plain(cell):
    """The cell with text that can be written as UTF-8, unlike half an emoji, and with an id that is one."""
    id = cell.id if re.fullmatch(r"[A-Za-z0-9_-]{1,64}", cell.id) else ""
    source = cell.source.encode("utf-8", "replace").decode("utf-8")
    return replace(cell, id=id, source=source)
