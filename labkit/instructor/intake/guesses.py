"""The predictions in a student's notebook: read as text, never run."""

import re
from collections.abc import Iterable

from ...guesses import letters, told
from ...notebook.read import Cell

PREFIX = "guess "  # of their keys among the answers; no id of a cell has a space

_MADE = re.compile(
    r"""^\s*guess\s*=\s*["'][\s(]*(\w)[\s)]*["']|\breveal\(\s*["']([\w-]{1,80})["']\s*,\s*guess\b""", re.M
)


def guesses(cells: Iterable[Cell]) -> dict[str, str]:
    """{'guess NAME': letter} of the predictions that were made, in the notebook's order."""
    made, last = {}, ""
    for cell in cells:
        for letter, name in _MADE.findall(cell.source) if cell.code else ():
            if not name:
                last = letter.lower()
            elif name in told() and last in letters(name):
                made[PREFIX + name] = last
    return made
