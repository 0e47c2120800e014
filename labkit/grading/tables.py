"""The class's tables: grades.csv, which an instructor may edit and hand back, and summary.csv.

`Sheet` is what reads every CSV file here and in `lms`: it changes single cells and keeps each other byte.
"""

import csv
import io
import os
import re
import unicodedata
from collections import Counter
from contextlib import suppress
from pathlib import Path

from .records import ERROR, OPEN, Problem

GRADES = ("student", "lab", "check", "points", "max_points", "status", "reason")
SUMMARY = (
    "student", "identifier", "lab", "points", "max_points", "percent", "open", "late", "handed_in", "source",
    "sandbox_level", "notes",
)  # fmt: skip
SHOWN = 10  # how many problems or names one message lists
SAME = 1e-3  # points closer than this are equal: a spreadsheet saves the digits that it shows
_BOMS = ((b"\xef\xbb\xbf", "utf-8"), (b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"))


def labels(results):
    """What each of `results` is called, in order: its student's name, made to differ within one lab.

    Students who share a name get their identifier (or the name of their file) behind it: 'Ada (123)'.
    """
    names = [clean(result.student) or "no name" for result in results]
    count = Counter((result.lab, _key(name)) for result, name in zip(results, names))
    taken, told = set(), []
    for result, name in zip(results, names):
        if count[result.lab, _key(name)] > 1:
            mark = clean(result.identifier) or clean(re.split(r"[\\/]", result.source)[-1])
            name += f" ({mark})" if mark else ""
        label, number = name, 1
        while (result.lab, _key(label)) in taken:
            number += 1
            label = f"{name} #{number}"
        taken.add((result.lab, _key(label)))
        told.append(label)
    return told


def label(result, results):
    """What `result`, one of `results`, is called in every table; see `labels`."""
    return next(name for name, other in zip(labels(results), results) if other is result)


def write_grades(path, results):
    """Write one row a mark of `results`; an instructor may fill it in for `read_hand_marks`.

    A student who could not be graded has one row, with status 'error'.  Problem: it cannot be written.
    """
    rows = []
    for name, result in zip(labels(results), results):
        if result.problem:
            rows.append((name, result.lab, "", "", "", ERROR, result.problem))
            continue
        for mark in result.marks:
            points, status = ("", OPEN) if mark.points is None else (plain(mark.points), mark.status)
            rows.append((name, result.lab, mark.check, points, plain(mark.max_points), status, mark.reason))
    _write(path, GRADES, rows)


def write_summary(path, results):
    """Write one row a student of `results`; Problem when the file cannot be written."""
    rows = []
    for name, result in zip(labels(results), results):
        points = percent = ""
        if not result.problem:
            points = plain(result.points)
            percent = f"{100 * result.points / result.max_points:.1f}" if result.max_points else ""
        when = result.when.astimezone().isoformat(timespec="seconds") if result.when else ""
        notes = " ".join([result.problem, *result.notes])
        rows.append((
            name, result.identifier, result.lab, points, plain(result.max_points), percent, str(result.open),
            "yes" if result.late else "", when, result.source, str(result.level), notes,
        ))  # fmt: skip
    _write(path, SUMMARY, rows)


def read_hand_marks(path, results, notes=None):
    """What a person filled in or changed in a grades.csv: {(label, lab, check id): (points, reason)}.

    `results` are those of one lab or of several, as they were written; a
    row that says the same gives nothing. The file may come back from any spreadsheet: see `Sheet`; rows
    and columns in any order, capitals in headers, decimal commas. An emptied points field never takes
    a mark away; `notes`, a list, then gets a sentence.

    Problem lists what is wrong, by line: no number, less than 0, more than the check gives, a student
    or check that is not in `results`, rows that disagree; or the file cannot be read, is empty or
    lacks a column.
    """
    sheet = Sheet(path)
    columns = _grades_columns(sheet, several=len({result.lab for result in results}) > 1)
    table = _Written(results, sheet)
    marks, seen, wrong, told = {}, {}, [], []
    for line, row in sheet.lines():
        cells = {name: unguard(row[c]).strip() if c < len(row) else "" for name, c in columns.items()}
        try:
            where, name, mark = table.find(cells)
            if mark is None:
                continue
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
        raise Problem(_listing(path, wrong, sheet.codec == "cp1252"))
    if notes is not None:
        notes += told
    return marks


class _Written:
    """What grades.csv would hold now, to look up the rows of an edited one."""

    def __init__(self, results, sheet):
        self.seen, self.labs = sheet.seen, {_key(result.lab) for result in results}
        self.students = {}  # key of a label: {key of a lab: (label, result)}
        for name, result in zip(labels(results), results):
            self.students.setdefault(_key(name), {})[_key(result.lab)] = (name, result)

    def find(self, cells):
        """(unique key, label, mark) of a row; mark is None for a row about a student without marks.

        ValueError says what the row names that does not exist.
        """
        keep = "leave the columns student, lab and check as they were written"
        student, lab, check = (_key(cells.get(name, "")) for name in ("student", "lab", "check"))
        if not check:
            if cells["points"]:
                raise ValueError(f"there are points ({cells['points']!r}), but no check; {keep}")
            return None, None, None
        if student not in self.students:
            near = [name for key, of in self.students.items() for name, _ in of.values()
                    if student and key.startswith(student + " (")]  # fmt: skip
            now = f" (now {' or '.join(map(repr, near))}?)" if near else ""
            raise ValueError(f"there is no student {cells['student']!r}{now}; {keep}")
        of = self.students[student]
        if lab not in of and (lab or len(of) > 1):
            raise ValueError(f"{cells['student']!r} has no lab {cells['lab']!r} here; {keep}")
        lab = lab or next(iter(of))
        name, result = of[lab]
        for mark in result.marks:
            if _key(mark.check) == check:
                return (student, result.lab, check), name, mark
        raise ValueError(f"{name!r} has no check {cells['check']!r}; {keep}")

    def same(self, text, written):
        """Whether the cell `text` still says `written`, but for letters that its encoding lacks."""
        return _squash(text) == _squash(self.seen(clean(written)))


def _hand_mark(cells, mark, table, told, where):
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


def _grades_columns(sheet, several):
    """{name of GRADES: column}; Problem when one that is needed is missing or there twice."""
    columns = {}
    for column, header in enumerate(sheet.header):
        name = "_".join(_key(header).split())
        if name in columns:
            raise Problem(f"{sheet.path}: there are two columns {name!r}; delete one of them.")
        if name in GRADES:
            columns[name] = column
    missing = [name for name in ("student", "check", "points", *["lab"] * several) if name not in columns]
    if missing:
        raise Problem(
            f"{sheet.path}: there is no column {' and no column '.join(map(repr, missing))} in line "
            f"{sheet.top + 1}, which should be {','.join(GRADES)}; put it back, or write the file anew."
        )
    return columns


def _listing(path, wrong, narrow):
    """The text that lists what is `wrong`; narrow: the file's encoding lacks letters."""
    lines = [f"{path}: nothing was taken from it, since there is something to put right:"]
    lines += [f"  {sentence}" for sentence in wrong[:SHOWN]]
    if len(wrong) > SHOWN:
        lines.append(f"  and {len(wrong) - SHOWN} more")
    if narrow:
        lines.append("  The file is not UTF-8, which spoils some letters: save it as 'CSV UTF-8'.")
    return "\n".join(lines)


class Sheet:
    """A CSV file as it is: its cells can be read and single ones changed, and every other byte stays.

    Understood: UTF-8, UTF-16 with a byte order mark, else Windows' western letters; comma, semicolon or tab
    between cells; any line ends; a first line 'sep=;'.
    """

    def __init__(self, path):
        """Read `path`; Problem when it cannot be read, is no text or has nothing in it."""
        self.path = Path(path)
        try:
            data = self.path.read_bytes()
        except OSError as error:
            raise Problem(f"{path} cannot be read: {error.strerror or error}.") from None
        self.bom, self.codec = next((pair for pair in _BOMS if data.startswith(pair[0])), (b"", "utf-8"))
        text = self._decode(data[len(self.bom) :])
        lines = text.splitlines()
        full = [i for i, line in enumerate(lines) if line.strip(' \t,;"') and not line.startswith("sep=")]
        self.top = full[0] if full else None
        if self.top is None:
            raise Problem(f"{path} is empty; it should be a table whose first line names its columns.")
        outside = Counter(re.sub(r'"[^"]*"', "", lines[self.top]))
        self.comma = max(",;\t", key=lambda c: outside[c])
        if lines[0].startswith("sep="):
            self.comma = lines[0][4:5] or self.comma
        self._raw, self._ends = _split(text, re.escape(self.comma))

    def _decode(self, data):
        if data.startswith(b"PK\x03\x04"):
            raise Problem(f"{self.path} is a workbook; in the spreadsheet, save it as 'CSV UTF-8'.")
        for codec in (self.codec, "cp1252"):
            try:
                text = data.decode(codec)
            except UnicodeDecodeError:
                continue
            if "\0" not in text:
                self.codec = codec
                return text
        raise Problem(f"{self.path} is not a text file that can be read; save it as 'CSV UTF-8'.")

    @property
    def header(self):
        """The cells of the line that names the columns."""
        return self.row(self.top)

    def row(self, index):
        """The cells of row `index`, without their quotes."""
        return [_value(raw) for raw in self._raw[index]]

    def cell(self, index, column):
        """One cell's text without spaces around it, '' behind the end of its row."""
        row = self._raw[index]
        return _value(row[column]).strip() if column < len(row) else ""

    def body(self):
        """The indices of the rows below the header that are not blank."""
        return [i for i in range(self.top + 1, len(self._raw)) if any(cell.strip() for cell in self.row(i))]

    def lines(self):
        """(line number, cells) of each row below the header that is not blank."""
        return [(i + 1, self.row(i)) for i in self.body()]

    def seen(self, text):
        """`text` as this file's encoding can hold it."""
        return text.encode(self.codec, "replace").decode(self.codec)

    def put(self, index, column, text):
        """Set a cell; it has quotes if it had them before or needs them now."""
        row = self._raw[index]
        row += [""] * (column + 1 - len(row))
        if text != _value(row[column]):
            quoted = row[column].startswith('"') or re.search(r'["\s]', text) or self.comma in text
            row[column] = '"' + text.replace('"', '""') + '"' if quoted else text

    def save(self, out):
        """Write the table to `out`; Problem when that cannot be done."""
        text = "".join(self.comma.join(row) + end for row, end in zip(self._raw, self._ends))
        replace(out, self.bom + text.encode(self.codec, "replace"))


def _split(text, comma):
    """The cells of each row as they stand in the file, quotes included, and the row's line end."""
    cell = re.compile(rf'("(?:[^"]++|"")*+"[^{comma}\r\n]*+|[^{comma}\r\n]*+)({comma}|\r\n|\r|\n|\Z)')
    rows, ends, row, at = [], [], [], 0
    while at < len(text) or row:
        found = cell.match(text, at)
        at = found.end()
        row.append(found[1])
        if found[2] in ("\r\n", "\r", "\n", ""):
            rows.append(row)
            ends.append(found[2])
            row = []
    return rows, ends


def _value(raw):
    """The text of a cell as it stands in the file."""
    if not raw.startswith('"') or len(raw) < 2:
        return raw
    inside, _, behind = raw[1:].rpartition('"')
    return inside.replace('""', '"') + behind


def replace(path, data):
    """Write the bytes `data` to `path` in one step, so that a kill leaves the old file or the new one.

    Problem when it cannot be written, as when a spreadsheet on Windows holds the file.
    """
    path = Path(path)
    part = path.with_name(path.name + ".part")  # always this name: what a kill leaves is written over
    try:
        with open(part, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    except OSError as error:
        with suppress(OSError):
            part.unlink()
        reason = error.strerror or error
        if isinstance(error, PermissionError):
            reason = f"{reason}; is it open in a spreadsheet? Close it there and run this again"
        raise Problem(f"{path} cannot be written: {reason}.") from None


def _write(path, header, rows):
    text = io.StringIO()
    table = csv.writer(text)
    table.writerow(header)
    table.writerows([guard(cell) for cell in row] for row in rows)
    replace(path, text.getvalue().encode("utf-8-sig"))  # with the mark, Excel takes it for UTF-8


def clean(text):
    """`text` on one line, without control characters and halves of characters."""
    return re.sub(r"[\x00-\x1f\x7f\ud800-\udfff]", "", " ".join(str(text).split()))


def guard(text):
    """`text`, clean, as a cell that no spreadsheet takes for a formula."""
    text = clean(text)
    return "'" + text if re.match("'*[=+@-]", text) else text


def unguard(text):
    """The text that `guard` made a cell of; a tab or line end that a person added counts too."""
    return text[1:] if re.match("'+[=+@\t\r-]", text) else text


def number(text):
    """The number in a cell, with a decimal point or comma, or None: '1,5' is 1.5, 'nan' is no number."""
    text = text.strip()
    return float(text.replace(",", ".")) if re.fullmatch(r"[+-]?(\d{1,9}([.,]\d*)?|[.,]\d+)", text) else None


def plain(value, digits=4):
    """`value` with at most `digits` decimals and no idle zeros: '1', '1.5'."""
    return f"{value + 1e-9:.{digits}f}".rstrip("0").rstrip(".")  # 1e-9: halves go up, whatever their bits


def _squash(text):
    """`text` for comparing: composed letters, one space for each gap."""
    return unicodedata.normalize("NFC", " ".join(text.split()))


def _key(text):
    """`text` for looking up: no capitals, and no leading zeros, which a spreadsheet drops of a number."""
    text = _squash(clean(text)).casefold()
    return text.lstrip("0") or "0" if text.isdigit() else text
