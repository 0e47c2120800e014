"""What a term's page and tables tell: who has what, what is missing, what was hard, which mistakes came back."""

import json
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from statistics import fmean, median
from typing import NamedTuple

from ..records import BLANK, Check, Result
from ..report.gradebook import Gradebook
from ..report.names import labels
from ..report.texts import clean, key
from .points import counting, known, weights

BINS = 10  # of a lab's spread, each of a tenth of the points
EXACT = 1e-9


class Got(NamedTuple):
    """What a student has of one lab. final: all of it is marked;  share: of what is marked so far, 0 to 1, or None;
    place: in the gradebook's order.
    """

    result: Result
    label: str
    points: float
    most: float
    final: bool
    share: float | None
    place: int


class Row(NamedTuple):
    """A student. total: by weights, 0 to 1, what is missing as nothing, None where no lab weighs anything;
    final: whether all that was handed in is marked.
    """

    label: str
    got: Mapping[str, Got]
    missing: Sequence[str]
    total: float | None
    final: bool


class Lab(NamedTuple):
    """A lab. short: its number;  share: what part of the total it is;  missing: labels of students without it;
    waiting: who is not marked to the end;  mean, median: of the shares so far;  bins: how many students have which.
    """

    name: str
    short: str
    share: float
    handed: int
    missing: Sequence[str]
    waiting: int
    unfit: int
    late: int
    mean: float | None
    median: float | None
    bins: Sequence[int]


class Hard(NamedTuple):
    """A check by what it gave: share of its points, 0 to 1, of those who are marked;  none: who got nothing."""

    lab: str
    check: Check
    share: float
    none: int
    marked: int


class Slip(NamedTuple):
    """A known mistake: how many students made it, and in which labs."""

    mistake: str
    students: int
    labs: Sequence[str]


class Term(NamedTuple):
    """All of it; mixed: names that several students share, who are kept apart by their numbers;  complete: whether it
    is known who is in the class.
    """

    labs: Sequence[Lab]
    rows: Sequence[Row]
    hard: Sequence[Hard]
    slips: Sequence[Slip]
    mixed: Sequence[str]
    complete: bool = False


def read(book: Gradebook) -> Term:
    """The Term of a gradebook."""
    results = {lab: counting(book, lab) for lab in book.labs()}
    asked: dict[str, dict[str, Check]] = {}  # each check as it was asked last
    for lab, stored in book.db.execute("SELECT lab, checks FROM paper ORDER BY rowid"):
        asked.setdefault(lab, {}).update({check["id"]: Check(**check) for check in json.loads(stored)})
    found = {lab: of_lab for lab, of_lab in results.items() if of_lab}
    names, complete = known(book)
    checks = {lab: [*every.values()] for lab, every in asked.items()}
    return of(found, checks, weights(book, found), names)._replace(complete=complete)


def of(
    results: Mapping[str, Sequence[Result]],
    checks: Mapping[str, Sequence[Check]],
    weight: Mapping[str, float],
    names: Iterable[str] = (),
) -> Term:
    """The Term of all results and all checks of each lab, and what it weighs. names: also of who handed in nothing."""
    students, mixed = _students(results, names)
    whole = sum(weight.values())
    rows = sorted((_row(label, got, weight) for label, got in students.items()), key=lambda row: row.label.casefold())
    numbers = [re.match(r"\d+|", lab)[0] for lab in results]  # type: ignore[index]
    shorts = numbers if all(numbers) and len({*numbers}) == len(numbers) else [*results]
    labs = [_lab(lab, short, weight[lab] / whole if whole else 0.0, rows) for lab, short in zip(results, shorts)]
    hard = [one for lab in results for check in checks.get(lab, ()) if (one := _hard(lab, check, results[lab]))]
    hard.sort(key=lambda one: (one.share, -one.none))
    return Term(labs, rows, hard, _slips(rows), mixed)


def _students(results, names):
    """({label: {lab: Got}}, names that several have): a student is known by the name, twins by their numbers too."""
    twins = set()
    for found in results.values():
        twins |= {name for name, count in Counter(key(result.student) for result in found).items() if count > 1}
    students, called = defaultdict(dict), {}
    for lab, found in results.items():
        for place, (result, label) in enumerate(zip(found, labels(found))):
            name = key(result.student)
            who = (name, result.identifier or label) if name in twins else (name, "")
            shown = f"{result.student} ({who[1]})" if who[1] and who[1] != label else label
            students[called.setdefault(who, shown)][lab] = _got(result, label, place)
    seen = {name for name, _ in called} | twins
    for name in names:
        if clean(name) and key(name) not in seen:
            seen.add(key(name))
            students[clean(name)] = {}
    every = {result.student for found in results.values() for result in found}
    return students, sorted(name for name in every if key(name) in twins)


def _got(result, label, place):
    marked = sum(mark.max_points for mark in result.marks if mark.points is not None)
    final = not (result.problem or result.open or result.ungraded)
    share = min(result.points / marked, 1.0) if marked and not result.problem else None
    return Got(result, label, result.points, result.max_points, final, share, place)


def _row(label, got, weight):
    whole = sum(weight.values())
    reached = sum(weight[lab] * one.points / one.most for lab, one in got.items() if one.most)
    missing = [lab for lab in weight if lab not in got]
    return Row(label, got, missing, reached / whole if whole else None, all(one.final for one in got.values()))


def _lab(lab, short, share, rows):
    got = [row.got[lab] for row in rows if lab in row.got]
    shares = [one.share for one in got if one.share is not None]
    count = Counter(min(BINS - 1, int(BINS * one + EXACT)) for one in shares)
    return Lab(
        lab,
        short,
        share,
        len(got),
        [row.label for row in rows if lab not in row.got],
        sum(not one.final and not one.result.problem for one in got),
        sum(bool(one.result.problem) for one in got),
        sum(one.result.late for one in got),
        fmean(shares) if shares else None,
        median(shares) if shares else None,
        [count[place] for place in range(BINS)],
    )


def _hard(lab, check, results):
    """The Hard of a check, None if nothing of it is marked. A question without an answer says nothing of it."""
    marks = [mark for result in results for mark in result.marks if mark.check == check.id]
    shares = [m.points / m.max_points for m in marks if m.points is not None and m.max_points and m.status != BLANK]
    return Hard(lab, check, fmean(shares), sum(not one for one in shares), len(shares)) if shares else None


def _slips(rows):
    who, where = defaultdict(set), defaultdict(dict)
    for at, row in enumerate(rows):
        for lab, one in row.got.items():
            for mark in one.result.marks:
                if mark.mistake:
                    who[mark.mistake].add(at)
                    where[mark.mistake][lab] = None
    told = sorted(who, key=lambda mistake: (-len(who[mistake]), mistake))
    return [Slip(mistake, len(who[mistake]), sorted(where[mistake])) for mistake in told]
