"""Which of a student's attempts counts, read and made ready to be graded."""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

from ...notebook.read import Cell
from ..records import IGNORED, HandInError
from .collect import Entry, Submissions, Unfit
from .submission import Work, assemble


@dataclass(frozen=True)
class Rules:
    """What the instructor decided.

    attempts    which counts: 'newest', 'first', or 'best' of all.
    too_late    whether one came too late to count.
    """

    attempts: str = "newest"
    too_late: Callable[[Entry], bool] = lambda entry: False


@dataclass(frozen=True)
class HandIn:
    """An attempt that can be graded.

    digest  SHA-256 of the file, and of those beside it if there are any, in hexadecimal.
    notes   sentences for the student and the instructor on what was chosen or is odd.
    """

    entry: Entry
    digest: str
    work: Work
    notes: list[str]


def hand_ins(
    submissions: Submissions, entries: Iterable[Entry], released: Sequence[Cell], rules: Rules
) -> Iterator[HandIn | Unfit]:
    """The attempts of each student that count, one notebook at a time; an Unfit if none of a student's can be graded.

    entries: as `survey` gives them;  released: the cells of the students' notebook as it was handed out.
    """
    for _, group in groupby(entries, key=lambda entry: (entry.student, entry.identifier)):
        yield from _of_student(submissions, list(group), released, rules)


def _of_student(submissions, entries, released, rules):
    order, why = _in_order(entries, rules)
    several = {"newest": "the newest counts", "first": "the first counts", "best": "the best counts"}[rules.attempts]
    told = [f"{len(entries)} attempts: {several}."] if len(entries) > 1 else []
    graded = False
    for entry in order:
        try:
            found = _hand_in(submissions, entry, released, told)
        except HandInError as error:
            why = why or (str(error) if entry.name in str(error) else f"{entry.name}: {error}")
            continue
        graded = True
        yield found
        if rules.attempts != "best":
            return
    if not graded:
        last = entries[-1]
        yield Unfit(last.student, last.identifier, last.source, last.when, why)


def _in_order(entries, rules):
    """(attempts to be tried in turn until one can be graded, why there are none)."""
    entries = [entry for entry in entries if not rules.too_late(entry)]
    if not entries:
        return [], IGNORED
    return (entries if rules.attempts == "first" else entries[::-1]), ""


def _hand_in(submissions, entry, released, told):
    cells, digest = submissions.read(entry)
    files = submissions.beside(entry)
    work = assemble(released, cells, files)
    return HandIn(entry, _digest(digest, files), work, [*entry.notes, *work.notes, *told])


def _digest(digest, files):
    """One digest of a notebook's and of the files beside it; the notebook's own where there are none."""
    if not files:
        return digest
    parts = [digest, *(f"{hashlib.sha256(raw).hexdigest()} {name}" for name, raw in sorted(files.items()))]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()
