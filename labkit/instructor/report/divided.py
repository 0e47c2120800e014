"""How the points of a filter's checks were divided among its parts: on a student's page and on that of the class."""

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from ..records import FAILED, PARTLY, PARTS, PASSED, Check, Mark, Result
from .texts import plain


class Part(NamedTuple):
    """A part of a filter, and what all checks of that filter gave for it."""

    title: str
    points: str


class Divided(NamedTuple):
    """The parts of one filter; rounded: by how much more its checks gave together, '' if by nothing."""

    subject: str
    parts: list[Part]
    rounded: str


class Lost(NamedTuple):
    """How many students a part of a filter cost points, of those who keep some; share: of the most frequent one's."""

    title: str
    students: int
    share: float


def divided(result: Result, checks: Sequence[Check]) -> list[Divided]:
    """The tables of a student's page: of each filter that failed in a check and that is right in some part."""
    tables = []
    for subject, pairs in _filters(result, checks):
        if not any(mark.status == PARTLY for _, mark in pairs):
            continue
        got, most = dict.fromkeys(PARTS, 0.0), dict.fromkeys(PARTS, 0.0)
        for check, mark in pairs:
            for part, weight in check.parts.items():
                most[part] += weight * check.points / 100
                if mark.status == PASSED or part in mark.parts:
                    got[part] += weight * check.points / 100
        parts = [Part(PARTS[part], f"{plain(got[part], 2)} of {plain(most[part], 2)}") for part in PARTS if most[part]]
        more = plain(sum(mark.points or 0 for _, mark in pairs) - sum(got.values()), 2)
        tables.append(Divided(subject, parts, more if more != "0" else ""))
    return tables


def lost(results: Sequence[Result], checks: Sequence[Check]) -> list[Lost]:
    """The table of the class's page: the parts that cost most students points first."""
    who = Counter[str]()
    for result in results:
        for subject, pairs in _filters(result, checks):
            wrong = [set(check.parts) - {"runs", *mark.parts} for check, mark in pairs if mark.status == PARTLY]
            who.update(f"`{subject}`: {PARTS[part]}" for part in PARTS if any(part in one for one in wrong))
    most = max(who.values(), default=0)
    return [Lost(title, students, students / most) for title, students in who.most_common()]


def _filters(result: Result, checks: Sequence[Check]) -> list[tuple[str, list[tuple[Check, Mark]]]]:
    """The filters of a lab, with those of their checks that were run and are not marked by hand."""
    marks = {mark.check: mark for mark in result.marks if mark.status in (PASSED, PARTLY, FAILED)}
    subjects = dict.fromkeys(check.subject for check in checks if check.parts)
    return [(name, [(c, marks[c.id]) for c in checks if c.subject == name and c.id in marks]) for name in subjects]
