"""The page of all symbols, `notebooks/glossary.md`, made from the labs' own tables of symbols."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from .. import files
from ..records import CommandError
from . import percent

PAGE = "notebooks/glossary.md"
HEAD = ["symbol", "in the code", "shape", "unit", "what it is"]
INTRO = """# All symbols of all labs

Within a lab a symbol has one meaning. Where labs differ, this page says which lab means what.

"""


class Symbol(NamedTuple):
    """A row of a lab's table of symbols, as Markdown."""

    symbol: str
    code: str
    shape: str
    unit: str
    meaning: str


def symbols(script: Path) -> list[Symbol]:
    """The rows of a lab's tables of symbols. Raises CommandError for a row that has not five columns."""
    rows, inside = [], False
    for line in (line for cell in percent.cells(script) if not cell.code for line in cell.source.splitlines()):
        parts = [part.strip() for part in line.strip().strip("|").split("|")]
        if parts == HEAD:
            inside = True
        elif not line.startswith("|"):
            inside = False
        elif inside and not set(line) <= set("|-: "):
            if len(parts) != len(HEAD):
                raise CommandError(f"{script.name}: a row of the table of symbols has {len(parts)} columns: {line}")
            rows.append(Symbol(*parts))
    return rows


def names(row: Symbol) -> list[str]:
    """What a row explains: its formulas, one by one, h(x) as h, and its names in the code."""
    formulas = [re.sub(r"(?<=\w)\([^)]*\)", "", formula) for formula in re.findall(r"\$([^$]+)\$", row.symbol)]
    parts = [part for formula in formulas for part in re.split(r"[,=]", formula.replace("(", ",").replace(")", ""))]
    return [*dict.fromkeys(part.strip() for part in parts if part.strip()), *re.findall(r"`[^`]+`", row.code)]


def page(scripts: Iterable[Path]) -> str:
    """The page's Markdown: a row for each meaning, the labs that share it named in it."""
    labs: dict[Symbol, list[str]] = {}
    for script in sorted(scripts):
        for row in symbols(script):
            labs.setdefault(row, []).append(str(int(script.name[:2])))
    order = {key: place for place, key in reversed([*enumerate(map(_key, labs))])}
    rows = sorted(labs, key=lambda row: order[_key(row)])
    lines = [[*row, ", ".join(labs[row])] for row in rows]
    table = [[*HEAD, "lab"], ["---"] * 6, *lines]
    return INTRO + "\n".join(f"| {' | '.join(line)} |" for line in table) + "\n"


def _key(row):
    """Where rows about the same symbol meet."""
    return row.symbol or row.code


def write(root: Path) -> None:
    """Write the page of the labs under `root`. Raises CommandError."""
    files.write(root / PAGE, page((root / "solutions").glob("[0-9]*_*.py")))


def stale(root: Path) -> bool:
    """Whether the page under `root` is not what the labs give now."""
    path = root / PAGE
    return not path.exists() or path.read_text("utf-8") != page((root / "solutions").glob("[0-9]*_*.py"))
