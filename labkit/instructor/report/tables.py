"""The class's tables: grades.csv, which an instructor may edit and hand back, and summary.csv."""

import csv
import io
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

from .. import files
from ..records import ERROR, CommandError, Result
from .names import labels
from .sheet import Sheet
from .texts import counted, guard, plain

GRADES = ("student", "lab", "check", "points", "max_points", "status", "reason")
SUMMARY = (
    *("student", "identifier", "lab", "points", "max_points", "percent", "open", "late", "handed_in", "source"),
    *("sandbox_level", "notes", "blank", "raw_points", "rules"),
)


def write_grades(path: Path, results: Sequence[Result], excel: bool = False) -> None:
    """Write one row a mark of `results`; an instructor may fill it in for `hand_marks.read_hand_marks`.

    A student who could not be graded has one row, with status 'error'; points that are not known are empty. excel:
    semicolons between cells and decimal commas, as a spreadsheet of most of Europe and Latin America expects. Raises
    CommandError: it cannot be written.
    """
    rows = []
    for name, result in zip(labels(results), results):
        if result.problem:
            rows.append((name, result.lab, "", "", "", ERROR, result.problem))
            continue
        for mark in result.marks:
            points, status = ("" if mark.points is None else plain(mark.points)), mark.status
            rows.append((name, result.lab, mark.check, points, plain(mark.max_points), status, mark.reason))
    write_rows(path, GRADES, rows, excel)


def written_for_excel(path: Path) -> bool:
    """Whether there is a table in `path` with semicolons, of `write_grades` or of a spreadsheet."""
    try:
        return path.exists() and Sheet(path).comma == ";"
    except CommandError:  # it is written anew
        return False


def write_summary(path: Path, results: Sequence[Result], excel: bool = False) -> None:
    """Write one row a student of `results`, after the course's rules and, as raw_points, before them.

    excel: see `write_grades`. Raises CommandError: it cannot be written.
    """
    rows = []
    for name, result in zip(labels(results), results):
        points = percent = raw = ""
        if not result.problem and not result.ungraded:
            points, raw = plain(result.points), plain(result.raw)
            percent = f"{100 * result.points / result.max_points:.1f}" if result.max_points else ""
        when = result.when.astimezone().isoformat(timespec="seconds") if result.when else ""
        missing = f"{counted(result.ungraded, 'check')} could not be run." if result.ungraded else ""
        notes = " ".join([result.problem, missing, *result.notes])
        marks = (result.lab, points, plain(result.max_points), percent, result.open)
        origin = ("yes" if result.late else "", when, result.source, result.level)
        rows.append((name, result.identifier, *marks, *origin, notes, result.blank, raw, " ".join(result.ruling.told)))
    write_rows(path, SUMMARY, rows, excel)


def write_rows(
    path: Path,
    header: Sequence[str],
    rows: Iterable[Sequence[object]],
    excel: bool,
    numbers: Collection[str] = ("points", "max_points", "percent", "raw_points"),
) -> None:
    """Write a table of which no cell is a formula; numbers: columns that get decimal commas if `excel`.

    Raises CommandError: it cannot be written.
    """
    text = io.StringIO()
    comma = ";" if excel else ","
    table = csv.writer(text, delimiter=comma)
    table.writerow(header)
    places = {at for at, name in enumerate(header) if excel and name in numbers}
    for row in rows:
        cells = [guard(cell, comma) for cell in row]
        table.writerow([cell.replace(".", ",") if at in places else cell for at, cell in enumerate(cells)])
    files.write(path, text.getvalue().encode("utf-8-sig"))  # with the mark, Excel takes it for UTF-8
