"""The gradebook of the platform Canvas, filled in."""

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from ..records import CommandError, Result
from .lms import Row, decimal_comma, fill, fold, name_key, one_lab, only, put_grade
from .sheet import Sheet
from .texts import listed, number


def fill_canvas(
    gradebook: Path | str,
    out: Path,
    results: Sequence[Result],
    lab_title: str | None = None,
    column: str | None = None,
    partial: bool = False,
) -> list[str]:
    """Write `gradebook`, as Canvas exported it, to `out` with the grades of `results`.

    column: title or number of the assignment; without it, the only one whose title holds `lab_title`, the
    lab's number ('Lab 1') or its name ('Cartesian'). A row is its student's by the ID, else by the name
    where that is unique. Points are scaled to Points Possible. 'EX' and 'N/A' stay, and so does the
    test student. A student with written answers still to be marked is left out, unless `partial`.

    Returns a report, a list of sentences. Raises CommandError: a file cannot be read or written, the column
    is not found or not the only one, or `results` are of several labs.
    """
    lab = one_lab(results)
    sheet = Sheet(gradebook)
    ids, top = _layout(sheet)
    points = {
        c: most
        for c, text in enumerate(sheet.header)
        if c > ids and re.search(r"\(\d+\)$", text.strip()) and (most := number(sheet.cell(top, c))) is not None
    }
    chosen = _assignment(sheet, list(points), lab, lab_title, column)
    if not points[chosen]:
        raise CommandError(
            f"{sheet.path}: {sheet.header[chosen]!r} gives no points (Points Possible is "
            f"{sheet.cell(top, chosen)}); set its points in Canvas and export again."
        )
    comma = decimal_comma(sheet, points)

    def put(index: int, result: Result) -> list[str]:
        return put_grade(sheet, index, chosen, result, points[chosen], comma)

    report = fill(_rows(sheet, ids, top, chosen), results, put, partial)
    sheet.save(out)
    return [f"Grades go to the column {sheet.header[chosen]!r}.", *report]


def names_of(gradebook: Path | str, identifiers: Iterable[str]) -> dict[str, str]:
    """{identifier: 'Ada Lovelace'} of those of `identifiers` whose row the gradebook has.

    Raises CommandError: the file cannot be read or is no gradebook of Canvas.
    """
    names = {number: name for name, number in people(gradebook)}
    return {number: names[number] for number in identifiers if names.get(number)}


def people(gradebook: Path | str) -> list[tuple[str, str]]:
    """('Ada Lovelace', identifier) of each row of the gradebook. Raises CommandError as `names_of` does."""
    sheet = Sheet(gradebook)
    ids, top = _layout(sheet)
    rows = _rows(sheet, ids, top, ids).values()
    return [(" ".join(row.name.split(", ")[::-1]), row.identifier) for row in rows]


def _layout(sheet: Sheet) -> tuple[int, int]:
    """(column of the students' ids, row of the points possible)."""
    header = [fold(text) for text in sheet.header]
    top = only(i for i in sheet.body() if fold(sheet.row(i)[0]) == "points possible")
    if "id" not in header or top is None:
        raise CommandError(
            f"{sheet.path} is not a gradebook as Canvas exports it, with a column ID and a row Points "
            f"Possible; its columns are {listed(sheet.header)}. Export it from Canvas's Gradebook again."
        )
    return header.index("id"), top


def _rows(sheet: Sheet, ids: int, top: int, chosen: int) -> dict[int, Row]:
    """The students' rows, without that of the test student."""
    rows = {}
    for i in sheet.body():
        name = ", ".join(sheet.cell(i, c) for c in range(ids))  # from Student, or LastName and FirstName
        now = sheet.cell(i, chosen)
        if i > top and name_key(name) != ("student", "test"):
            rows[i] = Row(sheet.cell(i, ids), name, now if now.upper() in ("EX", "N/A") else "")
    return rows


def _assignment(sheet: Sheet, columns: Sequence[int], lab: str, lab_title: str | None, wanted: str | None) -> int:
    """The one of the assignments' `columns` that is meant; CommandError when there is none or several."""
    titles = {c: sheet.header[c].strip() for c in columns}
    if wanted is not None:
        ways = [{c for c, title in titles.items() if fold(wanted) in _called(title)}]
    else:
        ways = _ways({c: _called(title)[1] for c, title in titles.items()}, lab, lab_title)
    found: set[int] = next((way for way in ways if way), set())
    if len(found) == 1:
        return min(found)
    meant = f"{wanted!r}" if wanted is not None else f"the lab {lab}"
    says = "more than one of its assignments may be" if found else "none of its assignments is"
    raise CommandError(
        f"{sheet.path}: {says} {meant}: {listed(titles[c] for c in sorted(found) or columns)}; name "
        "one with --column, by its title or the number behind it."
    )


def _called(title: str) -> tuple[str, str, str]:
    """(all of it, the title, the number) of 'Lab 1 (5001)'."""
    plainly, _, number = title.rpartition("(")
    return fold(title), fold(plainly), number.rstrip(")")


def _ways(plainly: dict[int, str], lab: str, lab_title: str | None) -> list[set[int]]:
    """The columns that may be meant, the surest way to tell first. plainly: {column: its title}."""

    def having(pattern: str) -> set[int]:
        return {c for c, title in plainly.items() if re.search(pattern, title)}

    name = fold(lab).lstrip("0123456789")
    digits = fold(lab)[: len(fold(lab)) - len(name)].lstrip("0")
    words = re.findall(r"[^\W_]+", name)
    named = having(rf"(?<!\w){words[0]}(?!\w)") if words else set()
    numbered = having(rf"(?<!\w)lab[^\W\d]*\W*0*{digits}(?!\d)") if digits else set()
    return [
        having(re.escape(fold(lab_title))) if lab_title else set(),
        named | numbered,
        having(rf"(?<!\d)0*{digits}(?!\d)") if digits else set(),
    ]
