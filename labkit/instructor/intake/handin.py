"""One notebook that was handed in, strictly read."""

import re
from dataclasses import replace
from functools import partial

from ...notebook.read import Cell, NotebookError, cells_of, parse
from ..records import HandInError
from .names import readable, shorten

MAX_PARTS = 1_000_000  # lists and tables in one notebook: 20 MB of '[[],[],' would fill 500 MB
MAX_CELLS = 2_000
MAX_TEXT = 1_000_000  # characters of code and text in one notebook: a lab has some ten thousand


def read_cells(raw: bytes, name: str) -> list[Cell]:
    """The cells of a notebook's bytes, strictly read; raises HandInError."""
    if raw.count(b"[") + raw.count(b"{") > MAX_PARTS:
        raise HandInError(f"{name} holds too much data: clear the outputs, save it and hand it in again.")
    try:
        cells = cells_of(parse(raw, name, pairs=partial(_once, name)), name)
    except NotebookError as error:
        raise HandInError(shorten(str(error), 400)) from None
    if len(cells) > MAX_CELLS:
        raise HandInError(f"{name} has {len(cells)} cells, and {MAX_CELLS} is the most: merge or delete some.")
    if sum(len(cell.source) for cell in cells) > MAX_TEXT:
        raise HandInError(f"{name} has more than {MAX_TEXT} characters of code and text: delete what is no answer.")
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
