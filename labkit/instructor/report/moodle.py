"""Moodle's grading worksheet, filled in."""

import re
from collections.abc import Sequence
from pathlib import Path

from ..records import BLANK, BY_HAND, CommandError, Result
from .lms import Row, decimal_comma, fill, fold, name_key, one_lab, only, put_grade
from .sheet import Sheet
from .texts import clean, cut, final, guard_html, listed, number, plain

LONGEST = 500  # characters of a feedback comment
NO = {"no", "nein", "non", "nao", "нет"}
YES = {"yes", "si", "ja", "oui", "sim", "да"}
# Moodle's headers in English, Spanish, German, French, Italian, Portuguese, Russian and Catalan, as `fold`
# gives them.
HEADERS = {
    name: set(words.split(" | "))
    for name, words in {
        "identifier": "identifier | identificador | id | identifiant | identificativo | идентификатор",
        "name": "full name | nombre completo | nombre | vollstandiger name | nom complet | nome completo | nome | "
        "полное имя",
        "grade": "grade | calificacion | bewertung | note | valutazione | voto | nota | avaliacao | оценка | "
        "qualificacio",
        "maximum": "maximum grade | calificacion maxima | bestwertung | note maximale | valutazione massima | "
        "nota maxima | avaliacao maxima | максимальная оценка | qualificacio maxima",
        "changeable": "grade can be changed | la calificacion puede ser cambiada | la calificacion puede cambiarse | "
        "bewertung kann geandert werden | la note peut etre modifiee | la valutazione puo essere cambiata | "
        "nota pode ser alterada | a nota pode ser alterada | оценка может быть изменена | "
        "es pot canviar la qualificacio | la qualificacio es pot canviar",
        "feedback": "feedback comments | comentarios de retroalimentacion | feedback als kommentar | "
        "feedback par commentaires | commenti | commenti di feedback | comentarios de feedback | "
        "отзыв в виде комментария | comentaris de retroalimentacio | comentaris de retroaccio",
    }.items()
}
Columns = dict[str, int | None]  # {name in HEADERS: column, or None if the sheet has none}


def fill_moodle(
    worksheet: Path | str,
    out: Path,
    results: Sequence[Result],
    grade_column: str | None = None,
    feedback_column: str | None = None,
    partial: bool = False,
) -> list[str]:
    """Write `worksheet`, as Moodle gave it, to `out` with the grades and comments of `results`.

    A row is its student's by the number in its identifier, else by the full name where that is unique.
    Points are scaled to the row's maximum grade. A student with written answers still to be marked is
    left out, unless `partial`. The columns are known by Moodle's own headers in eight languages or by what
    they hold; grade_column and feedback_column name them otherwise (with a grade_column and no maximum
    grade to be found, points are not scaled).

    Returns a report, a list of sentences. Raises CommandError: a file cannot be read or written, a column is not
    found, or `results` are of several labs.
    """
    one_lab(results)
    table = _Worksheet(Sheet(worksheet), grade_column, feedback_column)
    report = fill(table.rows(), results, table.put, partial)
    if table.column["feedback"] is None:
        report.append(
            f"No comments were written, since {table.sheet.path.name} has no known column for them; switch on "
            "feedback comments in Moodle's assignment, or name the column with --feedback-column."
        )
    table.sheet.save(out)
    return report


def rows_of(sheet: Sheet) -> dict[int, Row]:
    """{index: whose it is} of the rows of a worksheet. Raises CommandError if its columns cannot be told."""
    return _rows(sheet, _columns(sheet, None, None))


def _rows(sheet: Sheet, column: Columns) -> dict[int, Row]:
    known = [place for place in column.values() if place is not None]
    known += [1] * (column["name"] is None)  # names come second: two students of one name are no group
    rows = {}
    for i in sheet.body():
        number, name = (sheet.cell(i, c) if (c := column[of]) is not None else "" for of in ("identifier", "name"))
        others = (name_key(sheet.cell(i, c)) for c in range(len(sheet.header)) if c not in known)
        rows[i] = Row(number, name, "", frozenset(key for key in others if key))
    return rows


class _Worksheet:
    """A sheet whose columns are known. Raises CommandError if they cannot be told."""

    def __init__(self, sheet: Sheet, grade_column: str | None, feedback_column: str | None):
        self.sheet, self.column = sheet, _columns(sheet, grade_column, feedback_column)
        self.grade = _grade(sheet, self.column, scaled=grade_column is None)
        self.comma = decimal_comma(sheet, [self.grade, self.column["maximum"]])

    def rows(self) -> dict[int, Row]:
        """Whose each row is; locked ones must stay."""
        return {i: row._replace(stay=self._locked(i)) for i, row in _rows(self.sheet, self.column).items()}

    def cell(self, index: int, name: str) -> str:
        """The text in a row's column `name`, '' if the sheet has none."""
        place = self.column[name]
        return "" if place is None else self.sheet.cell(index, place)

    def put(self, index: int, result: Result) -> list[str]:
        """Set a row's grade and comment; returns what was replaced."""
        most, feedback = number(self.cell(index, "maximum")), self.column["feedback"]
        most = result.max_points if most is None else most
        old = put_grade(self.sheet, index, self.grade, result, most, self.comma)
        if feedback is not None:
            # Moodle stores comments as HTML, in which '<' would begin a tag.
            text = guard_html(_comment(result), self.sheet.comma)
            old += ["a comment"] * (self.cell(index, "feedback") not in ("", text))
            self.sheet.put(index, feedback, text)
        return old

    def _locked(self, index: int) -> str:
        return "grade cannot be changed" if fold(self.cell(index, "changeable")) in NO else ""


def _columns(sheet: Sheet, grade_column: str | None, feedback_column: str | None) -> Columns:
    """The columns as their headers or what they hold tell, or as the instructor names them."""
    header = [fold(text) for text in sheet.header]
    column = {name: only(i for i, text in enumerate(header) if text in HEADERS[name]) for name in HEADERS}
    if sheet.body():
        _guess(sheet, column)
    for name, wanted in (("grade", grade_column), ("feedback", feedback_column)):
        if wanted is not None:
            column[name] = only(i for i, text in enumerate(header) if text == fold(wanted))
            if column[name] is None:
                columns = listed(sheet.header)
                raise CommandError(f"{sheet.path}: --{name}-column {wanted!r} is not one of its columns, {columns}.")
    if column["identifier"] is None and column["name"] is None:
        raise CommandError(
            f"{sheet.path} has no column that tells its students, as Moodle's Identifier does; its columns "
            f"are {listed(sheet.header)}. Download the grading worksheet from the assignment's page."
        )
    return column


def _guess(sheet: Sheet, column: Columns) -> None:
    """Find the columns whose headers are of no known language by what they hold."""
    columns = range(len(sheet.header))
    cells = [[sheet.cell(i, c) for i in sheet.body()] for c in columns]
    if column["identifier"] is None and all(re.search(r"\D\d+$", text) for text in cells[0]):
        column["identifier"] = 0
    if column["name"] is None and column["identifier"] == 0 and len(columns) > 1:
        # Names come next, or a status where names are hidden, and that is the same in many rows.
        column["name"] = 1 if len(set(cells[1])) == len(cells[1]) else None
    if column["maximum"] is None:  # one number, the same in all rows, behind the grades
        same = [c for c in columns[1:] if len(set(cells[c])) == 1 and number(cells[c][0])]
        column["maximum"] = only(c for c in same if all(not t or number(t) is not None for t in cells[c - 1]))
    if column["changeable"] is None:
        column["changeable"] = only(c for c in columns if {fold(text) for text in cells[c]} <= NO | YES)
    if column["grade"] is None and column["maximum"]:
        column["grade"] = column["maximum"] - 1
    if column["feedback"] is None and columns[-1] not in column.values() and "" in cells[-1]:
        # Comments come last; what else can come last, times of changes, is never empty ('-').
        column["feedback"] = columns[-1]


def _grade(sheet: Sheet, column: Columns, scaled: bool) -> int:
    """The column of the grades; scaled: there must be one of the maximum grade too."""
    if column["grade"] is None or column["maximum"] is None and scaled:
        raise CommandError(
            f"{sheet.path}: its columns are {listed(sheet.header)}; which is for the grades, and which one "
            "holds the maximum grade, cannot be told; name the first with --grade-column. (An assignment "
            "graded on a scale of words has no maximum grade; give it points in Moodle.)"
        )
    return column["grade"]


def _comment(result: Result) -> str:
    """What the table tells the student on one line: the points, then why each check that lacks some does."""
    text = " ".join([f"Points: {plain(result.points, 2)} of {plain(result.max_points, 2)}.", *result.ruling.told])
    text = cut(clean(text), LONGEST // 2)
    why: dict[str, list[str]] = {}  # the same reason is told once
    for mark in result.marks:
        if mark.points is None:
            why.setdefault("not marked yet.", []).append(mark.check)
        elif mark.status == BLANK:
            why.setdefault("no answer.", []).append(mark.check)
        elif mark.reason and (mark.points < mark.max_points or mark.status == BY_HAND):
            why.setdefault(final(clean(mark.reason)), []).append(mark.check)
    end = " … See your feedback page."
    for reason, checks in why.items():
        more = f" {checks[0]}{f' and {len(checks) - 1} more' if len(checks) > 1 else ''}: {reason}"
        room = LONGEST - len(end) - len(text)
        if len(more) > room:
            return text + (more[:room].rsplit(" ", 1)[0] if room > 60 else "") + end
        text += more
    return text
