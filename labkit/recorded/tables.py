"""CSV files with a unit in each header: written so that nothing is rounded, read so that each fault has its line."""

import csv
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isnan, pi, radians
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..geometry import Array
from . import DataError, text_of

UNITS = {  # {a Log's unit: {another: how much of the first it is}}
    "s": {"s": 1, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "m": {"m": 1, "cm": 1e-2, "mm": 1e-3},
    "rad": {"rad": 1, "deg": radians(1)},
    "m/s": {"m/s": 1, "cm/s": 1e-2, "mm/s": 1e-3},
    "rad/s": {"rad/s": 1, "deg/s": radians(1)},
    "": {"": 1},  # of an id
}
LIMITS = {  # {unit: (what no robot of a course reaches, the unit that such numbers may be in, what else to do)}
    "m/s": (50.0, "mm/s", ""),
    "rad": (2 * pi + 1e-9, "deg", "; or does it count on from turn to turn? Then wrap it"),
    "rad/s": (4 * pi, "deg/s", ""),
}
UNKNOWN = ("x [m]", "y [m]", "heading [rad]")  # may be empty or nan: the truth has gaps


@dataclass(frozen=True)
class Table:
    """A file as it was read: `rows` (n, columns) has its numbers, `ids` (n,) its ids, `lines` (n,) says where."""

    path: Path
    columns: tuple[str, ...]
    lines: list[int]
    ids: list[int | str]
    rows: Array

    def wrong(self, k: int, what: str) -> DataError:
        """The error to raise for row k."""
        return DataError(f"{self.path}, line {self.lines[k]}: {what}")

    def check(self, bad: NDArray[np.bool_], what: str) -> None:
        """Raise DataError for the first row k of which bad (n,) is true: `what`, with {0}, {1} ... for its numbers."""
        if len(bad) and bad.any():
            k = int(np.argmax(bad))
            raise self.wrong(k, what.format(*self.rows[k].tolist()))


def as_id(text: str) -> int | str:
    """An id as it stands in a file: a whole number, or else a name."""
    return int(text) if re.fullmatch(r"-?\d{1,18}", text) else text


def read(path: Path, choices: Iterable[Sequence[str]]) -> Table:
    """Read the columns of the first of `choices` that the header has, such as ('id', 'x [m]'), in a Log's units.

    Other columns are left out.  DataError names the file and the line: no such columns, an unknown unit, a cell that
    is no number, a number that its unit makes impossible.
    """
    text = text_of(path)
    semicolons = ";" in text.split("\n", 1)[0]  # a spreadsheet's export where a comma is the decimal point
    reader = csv.reader(text.splitlines(), delimiter=";" if semicolons else ",")
    try:
        lines = [(reader.line_num, [cell.strip() for cell in cells]) for cells in reader if any(map(str.strip, cells))]
    except csv.Error as error:
        raise DataError(f"{path}, line {reader.line_num}: this is no CSV: {error}") from None
    number, header = lines[0] if lines else (1, [])
    columns, spots = _columns(path, number, header, [tuple(choice) for choice in choices])
    ids: list[int | str] = []
    rows: list[list[float]] = []
    for number, cells in lines[1:]:
        rows.append([])
        for column, at, factor in spots:
            cell = cells[at] if at < len(cells) else ""
            if column == "id":
                ids.append(as_id(cell))
                continue
            try:
                value = float((cell.replace(",", ".") if semicolons else cell) or "nan")
            except ValueError:
                value = np.inf
            if abs(value) == np.inf or (isnan(value) and column not in UNKNOWN):
                raise DataError(f"{path}, line {number}: {column} must be a finite number, but it is '{cell}'")
            rows[-1].append(value * factor)
    numbers = [column for column in columns if column != "id"]
    table = Table(path, columns, [n for n, _ in lines[1:]], ids, np.array(rows, float).reshape(-1, len(numbers)))
    for k, column in enumerate(numbers):
        limit, other, more = LIMITS.get(_words(column)[1], (np.inf, "", ""))
        over = np.abs(table.rows[:, k]) > limit
        table.check(over, f"{column} is {{{k}:.6g}}: is it in {other}? Then say so in the header, as [{other}]{more}")
    return table


def _columns(path, number, header, ways):
    """The first of `ways` whose columns the header has: (columns, [(column, its place, its unit's factor)])."""
    names, units = [_words(cell)[0] for cell in header], [_words(cell)[1] for cell in header]
    columns = next((way for way in ways if {_words(column)[0] for column in way} <= set(names)), None)
    if columns is None:
        due = ", or ".join(f"'{','.join(way)}'" for way in ways)
        raise DataError(f"{path}, line {number}: this line should name the columns, {due}; it is '{','.join(header)}'")
    spots = []
    for column in columns:
        name, unit = _words(column)
        at, known = names.index(name), UNITS[unit]
        if units[at] not in known:
            known = "], [".join(known)
            raise DataError(f"{path}, line {number}: the column '{header[at]}' must have one of the units [{known}]")
        spots.append((column, at, known[units[at]]))
    return columns, spots


def _words(column):
    """('range', 'm') of 'Range [m]'."""
    name, _, unit = column.partition("[")
    return " ".join(name.lower().split()), unit.strip(" ]")


def write(path: Path, columns: Sequence[str], rows: Iterable[Sequence]) -> None:
    """Write rows of as many numbers and ids, each number so that it is read back to the last bit."""
    with open(path, "w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([columns, *rows])
