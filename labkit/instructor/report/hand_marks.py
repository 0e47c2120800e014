"""What a person filled in or changed in grades.csv."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..records import CommandError, Mark, Result
from .names import labels
from .sheet import Sheet
from .tables import GRADES
from .texts import SHOWN, clean, key, number, plain, squash, unguard

SAME = 1e-3  # points closer than this are equal: a spreadsheet saves the digits that it shows
Where = tuple[str, str, str]  # (label, lab, check id) of a mark
Entry = tuple[float, str]  # (points, reason)


def read_hand_marks(path: Path, results: Sequence[Result], notes: list[str] | None = None) -> dict[Where, Entry]:
    """What a person filled in or changed in a grades.csv: {(label, lab, check id): (points, reason)}.

    `results` are those of one lab or of several, as they were written; a row that says the same gives nothing.
    The file may come back from any spreadsheet: see `Sheet`; rows and columns in any order, capitals in headers,
    decimal commas. An emptied points field never takes a mark away; `notes` then gets a sentence.

    Raises CommandError with what is wrong, by line: no number, less than 0, more than the check gives, a student or
    check that is not in `results`, rows that disagree; or the file cannot be read, is empty or lacks a column.
    """
    sheet = Sheet(path)
    columns = _grades_columns(sheet, several=len({result.lab for result in results}) > 1)
    table = _Written(results, sheet)
    marks: dict[Where, Entry] = {}
    seen: dict[Where, tuple[int, Entry | None]] = {}
    wrong: list[str] = []
    told: list[str] = []
    for line, row in sheet.lines():
        cells = {name: unguard(row[c], sheet.comma).strip() if c < len(row) else "" for name, c in columns.items()}
        try:
            found = table.find(cells)
            if not found:
                continue
            where, name, mark = found
            entry = _hand_mark(cells, mark, table, told, f"line {line}: {name}, {mark.check}")
        except ValueError as error:
            wrong.append(f"line {line}: {error}")
            continue
        first = seen.setdefault(where, (line, entry))
        if first[1] != entry:
            wrong.append(f"line {line}: disagrees with line {first[0]} on {mark.check} of {name}; delete one")
        elif entry:
            marks[name, where[1], mark.check] = entry
    if wrong:
        raise CommandError(_listing(path, wrong, sheet.codec == "cp1252"))
    if notes is not None:
        notes += told
    return marks


class _Written:
    """What grades.csv would hold now, to look up the rows of an edited one."""

    def __init__(self, results: Sequence[Result], sheet: Sheet):
        self.seen = sheet.seen
        self.students: dict[str, dict[str, tuple[str, Result]]] = {}  # key of a label: {key of a lab: (label, result)}
        for name, result in zip(labels(results), results):
            self.students.setdefault(key(name), {})[key(result.lab)] = (name, result)

    def find(self, cells: Mapping[str, str]) -> tuple[Where, str, Mark] | None:
        """(unique key, label, mark) of a row; None for a row about a student without marks.

        ValueError says what the row names that does not exist.
        """
        keep = "leave the columns student, lab and check as they were written"
        student, lab, check = (key(cells.get(name, "")) for name in ("student", "lab", "check"))
        if not check:
            if cells["points"]:
                raise ValueError(f"there are points ({cells['points']!r}), but no check; {keep}")
            return None
        if student not in self.students:
            raise ValueError(f"there is no student {cells['student']!r}{self._now(student)}; {keep}")
        of = self.students[student]
        if lab not in of and (lab or len(of) > 1):
            raise ValueError(f"{cells['student']!r} has no lab {cells['lab']!r} here; {keep}")
        lab = lab or next(iter(of))
        name, result = of[lab]
        for mark in result.marks:
            if key(mark.check) == check:
                return (student, result.lab, check), name, mark
        raise ValueError(f"{name!r} has no check {cells['check']!r}; {keep}")

    def _now(self, student: str) -> str:
        """What a student may be called now that another one has the same name."""
        longer = [of for name, of in self.students.items() if student and name.startswith(student + " (")]
        near = [label for of in longer for label, _ in of.values()]
        return f" (now {' or '.join(map(repr, near))}?)" if near else ""

    def same(self, text: str, written: str) -> bool:
        """Whether the cell `text` still says `written`, but for letters that its encoding lacks."""
        text, written = squash(text), squash(self.seen(clean(written)))
        return unguard(text, ";") == unguard(written, ";")  # the table may have had other commas


def _hand_mark(cells: Mapping[str, str], mark: Mark, table: _Written, told: list[str], where: str) -> Entry | None:
    """(points, reason) if the row's person changed `mark`, else None; ValueError when it cannot be a mark."""
    text, reason = cells["points"], cells.get("reason", "")
    changed = "reason" in cells and not table.same(reason, mark.reason)
    most, points = number(cells.get("max_points", "")), number(text)
    if most is not None and abs(most - mark.max_points) > SAME or number(cells.get("status", "")) is not None:
        raise ValueError(
            "the cells behind the points are not those that were written; put a number with a decimal "
            "comma in quotes, and leave the columns max_points and status as they were"
        )
    if not text:
        if mark.points is not None:
            told.append(f"{where}: the points were emptied; its {plain(mark.points)} points stay.")
        elif changed:
            told.append(f"{where}: there is a comment but no points, so it stays open.")
        return None
    if points is None:
        hint = " (a spreadsheet may have made a date of it)" if re.search(r"\d", text) else ""
        raise ValueError(f"the points {text!r} are not a number{hint}; write one such as 1.5")
    if points < 0:
        raise ValueError(f"the points {text!r} are less than 0; write 0 to {plain(mark.max_points)}")
    if points > mark.max_points + SAME:
        raise ValueError(f"the points {text!r} are more than {mark.check} gives, {plain(mark.max_points)}")
    if mark.points is not None and abs(points - mark.points) < SAME and not changed:
        return None
    return points, reason if changed else mark.reason


def _grades_columns(sheet: Sheet, several: bool) -> dict[str, int]:
    """{name of GRADES: column}; CommandError when one that is needed is missing or there twice."""
    columns: dict[str, int] = {}
    for column, header in enumerate(sheet.header):
        name = "_".join(key(header).split())
        if name in columns:
            raise CommandError(f"{sheet.path}: there are two columns {name!r}; delete one of them.")
        if name in GRADES:
            columns[name] = column
    missing = [name for name in ("student", "check", "points", *["lab"] * several) if name not in columns]
    if missing:
        raise CommandError(
            f"{sheet.path}: there is no column {' and no column '.join(map(repr, missing))} in line "
            f"{sheet.top + 1}, which should be {','.join(GRADES)}; put it back, or write the file anew."
        )
    return columns


def _listing(path: Path, wrong: Sequence[str], narrow: bool) -> str:
    """The text that lists what is `wrong`; narrow: the file's encoding lacks letters."""
    lines = [f"{path}: nothing was taken from it, since there is something to put right:"]
    lines += [f"  {sentence}" for sentence in wrong[:SHOWN]]
    if len(wrong) > SHOWN:
        lines.append(f"  and {len(wrong) - SHOWN} more")
    if narrow:
        lines.append("  The file is not UTF-8, which spoils some letters: save it as 'CSV UTF-8'.")
    return "\n".join(lines)
