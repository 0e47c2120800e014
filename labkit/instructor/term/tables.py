"""The term as tables: term.csv, a line for each student, and term.xlsx with labs, checks and mistakes besides."""

from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

import xlsxwriter

from .. import files
from ..report.tables import write_rows
from ..report.texts import guard, plain
from .overview import Row, Term

WIDEST = 60  # letters of a column
Cells = Sequence[Sequence[object]]


def write_csv(path: Path, term: Term, excel: bool = False) -> None:
    """Write a line for each student; excel: see `labkit.instructor.report.tables.write_grades`. Raises CommandError."""
    header, *rows = _students(term)
    shown = [[plain(cell, 2) if isinstance(cell, float) else cell or "" for cell in row] for row in rows]
    write_rows(path, [str(name) for name in header], shown, excel, {"total_percent", *(lab.name for lab in term.labs)})


def write_xlsx(path: Path, term: Term) -> None:
    """Write a workbook of four sheets. Raises CommandError: it cannot be written."""
    sheets = {"Students": _students(term), "Labs": _labs(term), "Checks": _checks(term), "Mistakes": _mistakes(term)}

    def put(file: BinaryIO) -> None:
        # Whatever is a text is written as a text, and `guard` keeps it one when the sheet is saved as CSV.
        with xlsxwriter.Workbook(file, {"in_memory": True}) as workbook:
            bold = workbook.add_format({"bold": True, "text_wrap": True, "valign": "top"})
            two = workbook.add_format({"num_format": "0.##"})
            for name, cells in sheets.items():
                _sheet(workbook.add_worksheet(name), cells, bold, two)

    files.write(path, put)


def _sheet(sheet, cells, bold, two):
    sheet.freeze_panes(1, 1)
    for at, column in enumerate(zip(*cells)):
        sheet.set_column(at, at, min(WIDEST, 2 + max(len(str(cell)) for cell in column)))
        for line, cell in enumerate(column):
            if isinstance(cell, int | float):
                sheet.write_number(line, at, round(cell, 4), two)
            elif cell is not None:
                sheet.write_string(line, at, guard(cell), *[bold] * (not line))
    if len(cells) > 1:
        sheet.autofilter(0, 0, len(cells) - 1, len(cells[0]) - 1)


def _students(term: Term) -> Cells:
    labs = [lab.name for lab in term.labs]
    header = ["student", *labs, "total_percent", "missing", "not_marked_to_the_end", "not_graded", "late"]
    return [header, *(_student(row, labs) for row in term.rows)]


def _student(row: Row, labs: Sequence[str]) -> list[object]:
    points = [row.got[lab].points if lab in row.got and not row.got[lab].result.problem else None for lab in labs]
    waiting = [lab for lab, one in row.got.items() if not one.final and not one.result.problem]
    unfit = [lab for lab, one in row.got.items() if one.result.problem]
    late = [lab for lab, one in row.got.items() if one.result.late]
    total = None if row.total is None else 100.0 * row.total
    return [row.label, *points, total, *(", ".join(of) for of in (row.missing, waiting, unfit, late))]


def _labs(term: Term) -> Cells:
    header = ["lab", "percent_of_total", "handed_in", "missing", "not_marked_to_the_end", "not_graded", "late"]
    rows = [
        (lab.name, 100.0 * lab.share, lab.handed, len(lab.missing), lab.waiting, lab.unfit, lab.late, *_percents(lab))
        for lab in term.labs
    ]
    return [[*header, "mean_percent", "median_percent"], *rows]


def _percents(lab):
    return [None if share is None else 100.0 * share for share in (lab.mean, lab.median)]


def _checks(term: Term) -> Cells:
    header = ["check", "title", "lab", "percent_of_points", "without_points", "marked"]
    return [header, *((o.check.id, o.check.title, o.lab, 100.0 * o.share, o.none, o.marked) for o in term.hard)]


def _mistakes(term: Term) -> Cells:
    return [
        ["mistake", "students", "labs"],
        *((slip.mistake, slip.students, ", ".join(slip.labs)) for slip in term.slips),
    ]
