"""One notebook that was handed in, strictly read."""

import re
from dataclasses import replace

from ...notebook.read import Cell, NotebookError, cells_of, parse
from ..records import HandInError
from .names import shorten

MAX_PARTS = 1_000_000  # lists and tables in one notebook: as many of '[[],[],' would fill 500 MB
MAX_CELLS = 2_000
MAX_TEXT = 1_000_000  # characters of code and text in one notebook: a lab has some ten thousand


def read_cells(raw: bytes, name: str) -> list[Cell]:
    """The cells of a notebook's bytes, strictly read; raises HandInError."""
    if raw.count(b"[") + raw.count(b"{") > MAX_PARTS and _parts(raw) > MAX_PARTS:
        raise HandInError(f"{name} holds too much data: clear the outputs, save it and hand it in again.")
    try:
        cells = [_plain(cell) for cell in cells_of(parse(raw, name), name)]
    except NotebookError as error:
        raise HandInError(shorten(str(error), 400)) from None
    if len(cells) > MAX_CELLS:
        raise HandInError(f"{name} has {len(cells)} cells, and {MAX_CELLS} is the most: merge or delete some.")
    if sum(len(cell.source) for cell in cells) > MAX_TEXT:
        raise HandInError(f"{name} has more than {MAX_TEXT} characters of code and text: delete what is no answer.")
    return cells


def _parts(raw):
    """How many brackets stand outside of texts: what was printed, arrays say, has many."""
    return sum(not match[0].startswith(b'"') for match in re.finditer(rb'[\[{]|"(?:[^"\\]|\\.)*+"', raw, re.DOTALL))


def _plain(cell):
    """The cell with text that can be written as UTF-8, unlike half an emoji, and with an id that is one.

    A picture that Colab or an editor wrote into the text becomes one that is attached, as Jupyter keeps it.
    """
    id = cell.id if re.fullmatch(r"[A-Za-z0-9_-]{1,64}", cell.id) else ""
    source = cell.source.encode("utf-8", "replace").decode("utf-8")
    if cell.code or "](data:image/" not in source:
        return replace(cell, id=id, source=source)
    given = cell.stored.get("attachments")
    attached = dict(given) if isinstance(given, dict) else {}

    def attach(match):
        name = f"in-the-text-{len(attached)}"
        attached[name] = {match[1]: match[2]}
        return f"](attachment:{name})"

    source = re.sub(r"\]\(data:(image/\w+);base64,([A-Za-z0-9+/=\s]*+)\)", attach, source)
    return replace(cell, id=id, source=source, stored={**cell.stored, "attachments": attached})
