"""When each student handed in, as Moodle's worksheet says: in any language, known by what the cells hold."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any

from babel import Locale

from ..intake.collect import Entry
from ..records import Result
from .lms import fold, match
from .moodle import rows_of
from .sheet import Sheet
from .texts import counted

# Moodle's most used languages, as Unicode's CLDR names them; it has their months and days.
LANGUAGES = (
    "en es de fr ru it pt ca gl eu nl pl cs sk sl hr sr bg uk ro hu tr el sv da nb fi et lv lt zh ja ko ar he fa id vi"
)
NONE = ("", "-")  # what stands where nothing was handed in
DOWNLOAD = timedelta(minutes=1)  # files that are packed or unpacked together are this close at most
CLOCK = re.compile(r"(?<![\d.:/-])(\d{1,2})(?:[:.]| ?h ?)(\d\d)(?:[:.](\d\d))?(?![.:/-]?\d)")
BEHIND = {"uhr", "h", "ч"}  # words behind a time that change nothing of it
ORDERS = ("ymd", "dmy", "mdy")


def dated(
    entries: Sequence[Entry], worksheet: Path | str | None, submissions: str, due: datetime | None
) -> tuple[list[Entry], list[str]]:
    """(entries with the times that hold for them, notes on where these are from).

    entries: each student's follow each other, the latest attempt last. A time of the worksheet goes before the
    file's own, which is that of the download where all files are within a minute, and then none. Where the files' own
    hold, an earlier attempt keeps its own. Raises CommandError: the worksheet cannot be read.
    """
    stamps = [entry.when for entry in entries if entry.when]
    real = len(stamps) == 1 or bool(stamps) and max(stamps) - min(stamps) > DOWNLOAD
    told = told_times(worksheet, entries) if worksheet else {}
    found: list[Entry] = []
    for student, group in groupby(entries, key=_student):
        *earlier, last = group
        when = told.get(student)
        if when is None:
            found += [replace(entry, when=entry.when if real else None) for entry in (*earlier, last)]
            continue
        for entry in earlier:
            own = entry.when if real and entry.when else when
            found.append(replace(entry, when=min(own, when)))
        found.append(replace(last, when=when))
    notes = []
    if told:
        notes.append(f"Times of handing in are those of {Path(worksheet or '').name}.")
    elif worksheet and stamps:
        notes.append(f"{Path(worksheet).name} tells no times of handing in of these students that can be read.")
    without = [entry.student for entry in found if _student(entry) not in told]
    if stamps and without and (due or worksheet):
        notes.append(
            _of_files(
                submissions, real, f" of {counted(len(set(without)), 'student')}" if told else "", bool(worksheet)
            )
        )
    return found, notes


def _of_files(submissions: str, real: bool, whose: str, tried: bool) -> str:
    """The note on the times of the files."""
    if real:
        return f"Times of handing in{whose} are those of the files in {submissions}."
    end = "" if tried else " Moodle's grading worksheet has the true times: give it with --moodle."
    return (
        f"All files in {submissions} are within a minute of each other, as after a download, so when the "
        f"hand-ins{whose} came is not known, and no due date reaches them.{end}"
    )


def _student(entry: Entry) -> tuple[str, str]:
    return entry.student, entry.identifier


def told_times(worksheet: Path | str, entries: Sequence[Entry]) -> dict[tuple[str, str], datetime]:
    """{(student, identifier): time} of the `entries` that the worksheet has a time for; of a group, the latest."""
    sheet = Sheet(worksheet)
    times = submitted(sheet)
    students = list(dict.fromkeys(map(_student, entries)))
    of, _ = match(rows_of(sheet), [Result(*student) for student in students])
    found: dict[tuple[str, str], datetime] = {}
    for row, at in of.items():
        if row in times:
            found[students[at]] = max(times[row], found.get(students[at], times[row]))
    return found


def submitted(sheet: Sheet) -> dict[int, datetime]:
    """{row: when it was handed in}, local as the sheet says it; {} when no column says that for certain.

    It is the first column of times behind Moodle's maximum grade; the one of the grades' times comes after it.
    """
    body = sheet.body()
    start = _behind_grades(sheet)
    for column in range(start, len(sheet.header)):
        cells = {row: sheet.cell(row, column) for row in body}
        texts = [text for text in cells.values() if text not in NONE]
        if not all(map(_looks_like_time, texts)) or not texts and "-" not in cells.values():
            continue
        known = read_times(texts)
        return {row: when for row, text in cells.items() if (when := known.get(text))}
    return {}


def _behind_grades(sheet: Sheet) -> int:
    """The first column behind the one maximum that all rows share, or 0: due dates stand before it."""
    for column in range(1, len(sheet.header)):
        texts = {sheet.cell(row, column) for row in sheet.body()}
        if len(texts) == 1 and re.fullmatch(r"\d+([.,]\d+)?", texts.pop()):
            return column + 1
    return 0


def _looks_like_time(text: str) -> bool:
    return bool(re.search(r"(?<!\d)\d{4}(?!\d)", text) and CLOCK.search(fold(text)) and len(text) < 80)


def read_times(texts: Sequence[str]) -> dict[str, datetime]:
    """{text: time} of times in one language and form; those that may mean two things are left out."""
    readings: list[tuple[int, dict[str, datetime]]] = []  # (words understood, {text: time})
    for language in LANGUAGES.split():
        for order in ORDERS:
            read = {text: found for text in dict.fromkeys(texts) if (found := read_time(text, language, order))}
            if read:
                readings.append((sum(n for _, n in read.values()), {text: when for text, (when, _) in read.items()}))
    most = max(((len(read), n) for n, read in readings), default=(0, 0))
    best = [set(read.items()) for n, read in readings if (len(read), n) == most]
    return dict(set.intersection(*best)) if best else {}


def read_time(text: str, language: str, order: str) -> tuple[datetime, int] | None:
    """(the time that `text` says in a language, how many of its words for the day and its half were understood).

    order: of day, month and year where the month is a number. None: it is no time in that language, or its weekday
    is not that of the day.
    """
    text, names = fold(text), _words(language)
    clocks = list(CLOCK.finditer(text))
    if not clocks:
        return None
    clock = clocks[-1]
    head, tail = text[: clock.start()], text[clock.end() :]
    half, head, tail = _half(head, tail, names["half"])
    months, head = _taken(head + " ", names["month"])
    days, head = _taken(head, names["day"])
    numbers = re.findall(r"\d+", head + tail)
    words = re.findall(r"[^\W\d_]+", tail)
    if len(set(months)) > 1 or len(set(days)) > 1 or not set(words) <= BEHIND:
        return None
    day = _day(numbers, months, order, re.search(r"\d\.\s?\d", head) is not None)
    hour, minute, second = (int(part or 0) for part in clock.groups())
    if day is None or hour > 23 or minute > 59 or second > 59 or days and days[0] != day.weekday():
        return None
    hour = hour if half is None or hour > 12 else hour % 12 + 12 * half
    known = len(set(days)) + (half is not None)
    return day.replace(hour=hour, minute=minute, second=second), known


def _day(numbers: list[str], months: list[int], order: str, dotted: bool) -> datetime | None:
    """The day that the numbers say in that order, None if they say none."""
    if months:
        numbers = [number for part in order for number in _part(part, numbers, months)]
    if len(numbers) != 3 or len(numbers[order.index("y")]) != 4 or dotted and order == "mdy" and not months:
        return None
    year, month, day = (int(numbers[order.index(part)]) for part in "ymd")
    try:
        return datetime(year, month, day)
    except ValueError:
        return None


def _part(part: str, numbers: list[str], months: list[int]) -> list[str]:
    """The numbers that may be a date's year, month or day where the month has a name."""
    return [str(months[0])] if part == "m" else [n for n in numbers if (len(n) == 4) == (part == "y")]


def _half(head: str, tail: str, halves: dict[str, int]) -> tuple[int | None, str, str]:
    """(0 before noon, 1 after noon or None, head, tail) without the words for it."""
    if found := re.match(r"\s*([ap])\.?\s?m\b\.?", tail):
        return int(found[1] == "p"), head, tail[found.end() :]
    for word in sorted(halves, key=len, reverse=True):
        for at, part in enumerate((head, tail)):
            if re.search(rf"(?<![a-z]){re.escape(word)}(?![a-z])", part):
                both = [head, tail]
                both[at] = part.replace(word, " ")
                return halves[word], both[0], both[1]
    return None, head, tail


def _taken(text: str, names: dict[str, int]) -> tuple[list[int], str]:
    """(what the names in `text` stand for, the text without them)."""
    longest = "|".join(map(re.escape, sorted(names, key=len, reverse=True))) or r"\Z."
    pattern = re.compile(rf"(?<!\w)(?:{longest})(?!\w)")
    return [names[name] for name in pattern.findall(text)], pattern.sub(" ", text)


@cache
def _words(language: str) -> dict[str, dict[str, int]]:
    """{'month', 'day', 'half': {name: number}} of a language; Monday and January come first, at 0 and 1."""
    locale = Locale(language)

    def names(table: Any) -> Iterator[tuple[str, Any]]:
        for context in ("format", "stand-alone"):
            for width in ("wide", "abbreviated"):
                for number, name in table.get(context, {}).get(width, {}).items():
                    if name and not re.search(r"\d", name):
                        yield fold(name), number

    halves = {"am": 0, "pm": 1}
    return {
        "month": dict(names(locale.months)),
        "day": dict(names(locale.days)),
        "half": {name: halves[number] for name, number in names(locale.day_periods) if number in halves},
    }
