"""What the tables of all learning platforms share: which row is whose, what stays, and the report of it.

The instructor downloads the table and uploads it again, so each cell without a new grade stays, byte for byte.
"""

import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

from ..records import CommandError, Result
from .names import labels
from .sheet import Sheet
from .texts import counted, listed, number, plain

UNREAD, FAILED = "written answers wait to be marked", "the submission could not be graded"
UNKNOWN = "checks could not be run"
WAITING = {UNREAD: "; --partial fills them in", UNKNOWN: "; run the same command again", FAILED: ""}  # what to do


class Row(NamedTuple):
    """Whose a row of the table is, and why it must stay as it is, or ''.

    others: what else it says, by `name_key`; a group's name is among these, in whichever column.
    """

    identifier: str
    name: str
    stay: str = ""
    others: frozenset[tuple[str, ...]] = frozenset()


def fill(
    rows: Mapping[int, Row], results: Sequence[Result], put: Callable[[int, Result], list[str]], partial: bool
) -> list[str]:
    """Put each result into its row and return the report, a list of sentences.

    rows: {index: Row};  put(index, result) returns what it replaced. A result with written answers to be read is
    left out unless `partial`, one with checks that could not be run always; what a group handed in goes to each of
    its members.
    """
    names, (of, unclear) = labels(results), match(rows, results)
    shared = {at for at, count in Counter(of.values()).items() if count > 1}
    filled, replaced = [], []
    stay: dict[str, list[str]] = {why: [] for why in WAITING}  # reason: names of the rows
    for row, at in of.items():
        name = f"{rows[row].name or rows[row].identifier} ({names[at]})" if at in shared else names[at]
        if why := _stays(rows[row], results[at], partial):
            stay.setdefault(why, []).append(name)
            continue
        filled.append(name)
        if old := put(row, results[at]):
            replaced.append(f"{name} ({' and '.join(old)})")
    left = [names[at] for at in range(len(results)) if at not in of.values() and at not in unclear]
    without = [of_row.name or of_row.identifier for row, of_row in rows.items() if row not in of]
    told = (
        ("Something else was there before: {}.", replaced),
        *((f"Left as they were, since {why}: {{}}{WAITING.get(why, '')}.", who) for why, who in stay.items()),
        ("Graded, but not in the table: {}.", left),
        ("Graded, but more than one row or result fits: {}; fill these in by hand.", [names[at] for at in unclear]),
        ("In the table without a graded submission: {}.", without),
    )
    report = [f"Filled in: the {'grade' if len(filled) == 1 else 'grades'} of {counted(len(filled), 'student')}."]
    return report + [sentence.format(f"{len(who)} ({listed(who)})") for sentence, who in told if who]


def _stays(row: Row, result: Result, partial: bool) -> str:
    """Why a row stays as it was, '' if it gets its result."""
    if row.stay:
        return f"the table says '{row.stay}'"
    if result.problem:
        return FAILED
    if result.ungraded:  # known by another run only, whatever is asked for
        return UNKNOWN
    return UNREAD if result.open and not partial else ""


def match(rows: Mapping[int, Row], results: Sequence[Result]) -> tuple[dict[int, int], list[int]]:
    """({row: index of its result}, indices of results that may be several rows' or share one).

    A result under the name of a group is each member's who has none of their own.
    """
    of: dict[int, int] = {}
    unclear: set[int] = set()
    members = _members(rows, results)
    for in_result, in_row in (
        (lambda result: digits(result.identifier), lambda row: digits(row.identifier)),
        (lambda result: name_key(result.student), lambda row: name_key(row.name)),
    ):
        ours, places = [in_result(result) for result in results], defaultdict(list)
        many = Counter(ours)
        for place, row in rows.items():
            places[in_row(row)].append(place)
        for at, key in enumerate(ours):
            if not key or key not in places or at in of.values():
                continue
            if at in members and not set(places[key]) <= set(members[at][1]):
                continue  # a group's number may be that of someone else
            if many[key] > 1 or len(places[key]) > 1 or places[key][0] in of:
                unclear.add(at)
            else:
                of[places[key][0]] = at
    alike = Counter(group for group, _ in members.values())
    for at, (group, places_of) in members.items():
        free = [place for place in places_of if place not in of]
        if alike[group] == 1:
            of.update(dict.fromkeys(free, at))
        elif free and at not in of.values():
            unclear.add(at)
    return of, sorted(unclear - set(of.values()))


def _members(rows: Mapping[int, Row], results: Sequence[Result]) -> dict[int, tuple[tuple[str, ...], list[int]]]:
    """{index of a result: (its group, the rows that say the group's name in another column than that of names)}.

    A group's hand-in is named 'Group A' or, by older Moodle, 'Group A-Ada Lovelace'.
    """
    people = {name_key(row.name) for row in rows.values()}
    groups: dict[tuple[str, ...], list[int]] = {}
    for place, row in rows.items():
        for key in row.others:
            groups.setdefault(key, []).append(place)
    found = {}
    for at, result in enumerate(results):
        student = result.student
        starts = [student, *(student[: dash.start()] for dash in re.finditer("-", student))]
        group = next((key for start in starts if (key := name_key(start)) in groups), None)
        if group and name_key(student) not in people:
            found[at] = (group, groups[group])
    return found


def put_grade(sheet: Sheet, row: int, column: int, result: Result, most: float, comma: bool) -> list[str]:
    """Set a cell to the points of `result` out of `most`; returns a list that names another grade before."""
    share = result.points / result.max_points if result.max_points else 0
    text, old = plain(share * most, 2), sheet.cell(row, column)
    if number(old) == number(text):
        return []  # '7,50' stays '7,50'
    sheet.put(row, column, text.replace(".", ",") if comma else text)
    return [f"the grade {old}"] if old else []


def decimal_comma(sheet: Sheet, columns: Iterable[int | None]) -> bool:
    """Whether the numbers in `columns` have a decimal comma."""
    texts = [sheet.cell(i, c) for c in columns if c is not None for i in sheet.body()]
    return any("," in text and number(text) is not None for text in texts)


def one_lab(results: Sequence[Result]) -> str:
    """The lab of all `results`, '' if there are none. Raises CommandError when they are of several."""
    labs = sorted({result.lab for result in results})
    if len(labs) > 1:
        raise CommandError(f"The table is for one lab, but there are results of {listed(labs)}; choose one.")
    return labs[0] if labs else ""


def only(items: Iterable[int]) -> int | None:
    """The only one of `items`, or None when there is none or more."""
    found = list(items)
    return found[0] if len(found) == 1 else None


def fold(text: str) -> str:
    """`text` without capitals, accents and idle spaces, for comparing."""
    letters = unicodedata.normalize("NFKD", " ".join(text.split()).casefold())
    return "".join(letter for letter in letters if unicodedata.category(letter) != "Mn").rstrip(".")


def name_key(name: str) -> tuple[str, ...]:
    """The words of a name in no order: one key for 'Lovelace, Ada' and 'Ada  LOVELACE'."""
    return tuple(sorted(fold(name).replace(",", " ").split()))


def digits(identifier: str) -> str:
    """'123' of 'Participant 123', 'Teilnehmer/in123', '0123'; '' without a number at the end."""
    found = re.search(r"(\d+)\s*$", identifier)
    return found[1].lstrip("0") if found else ""
