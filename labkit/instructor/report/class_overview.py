"""The page about the whole class: what went wrong for how many, and what to explain again next week."""

import math
import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from statistics import median
from typing import NamedTuple
from urllib.parse import quote

from ..records import BLANK, ERROR, FAILED, NOT_RUN, PARTLY, PASSED, Check, Mark, Result
from .divided import lost
from .names import labels
from .pages import LOOKS, render
from .texts import counted, plain
from .ways import ways

SIGNS = (PASSED, PARTLY, FAILED, NOT_RUN, ERROR)
LEFT, WIDTH, TALLEST = 10, 700, 110  # of the chart's bars, in units of its drawing


class Bar(NamedTuple):
    """So many students have `first` to `last` points; where the bar stands and how large it is."""

    first: str
    last: str
    students: int
    left: float
    width: float
    height: float


class Spread(NamedTuple):
    """How many students have how many points; marked: the mean of the points that could be had for what is marked;
    edges: (place, points) of the axis below the bars.
    """

    median: float
    mean: float
    marked: float
    most: float
    bars: list[Bar]
    edges: list[tuple[float, str]]


class Mistake(NamedTuple):
    """A known mistake, how many made it, their share of the most frequent one's, and the checks that saw it."""

    mistake: str
    students: int
    share: float
    titles: list[str]


class Coded(NamedTuple):
    """What became of a check that is run; share: of those who passed, 0 to 1.

    before: (name, students) of the functions that those who failed have to mend first.
    """

    check: Check
    passed: int
    partly: int
    failed: int
    other: int
    share: float
    before: list[tuple[str, int]]


class Written(NamedTuple):
    """What became of a written question; mean: of the points that a person gave so far."""

    check: Check
    read: int
    waiting: int
    blank: int
    mean: float | None


class Student(NamedTuple):
    """A row of the table of all students."""

    label: str
    link: str
    graded: bool
    points: float
    most: float
    signs: str
    passed: int
    remarks: list[str]


def class_page(results: Sequence[Result], checks: Sequence[Check], title: str, pages: Mapping[str, str]) -> str:
    """The HTML of the class's page.

    results: of one lab;  pages: {label: file name of the feedback page} in feedback/lab.
    """
    named = sorted(zip(labels(results), results), key=lambda pair: pair[0].casefold())
    graded = [result for result in results if not result.problem]
    once = {result.id: result for result in graded}.values()  # what counts for several is one hand-in
    coded = [check for check in checks if not check.hand]
    links = {label: quote(f"feedback/{r.lab}/{pages[label]}", errors="replace") for label, r in named if label in pages}
    return render(
        "class",
        title=title,
        ways=ways(results[0].lab, "class") if results else (),
        graded=len(graded),
        waiting=sum(result.open for result in once),
        blank=sum(result.blank for result in once),
        levels=sorted(Counter(result.level for result in graded).items(), reverse=True),
        spread=_spread([result for result in graded if not result.ungraded]),
        mistakes=_mistakes(graded, checks),
        lost=lost(graded, checks),
        coded=[_coded(check, _marks(graded, check)) for check in coded],
        written=[_written(check, _marks(graded, check)) for check in checks if check.hand],
        unfit=[(label, result.problem) for label, result in named if result.problem],
        late=[label for label, result in named if result.late],
        signs=[LOOKS[status] for status in SIGNS],
        students=[_student(label, links.get(label, ""), result, coded) for label, result in named],
    )


def _marks(graded: Sequence[Result], check: Check) -> list[Mark]:
    return [mark for result in graded for mark in result.marks if mark.check == check.id]


def _spread(graded: Sequence[Result]) -> Spread | None:
    most = max((result.max_points for result in graded), default=0)
    if not most:
        return None
    points = [result.points for result in graded]
    step = next(s for s in _steps() if most / s <= 15)
    bins = max(1, math.ceil(most / step - 1e-9))
    counts = Counter(min(bins - 1, max(0, int(p / step + 1e-9))) for p in points)
    each, top = WIDTH / bins, max(counts.values())
    edges = [(LEFT + i * each, plain(i * step, 2)) for i in range(bins + 1)]
    bars = [
        Bar(edges[i][1], edges[i + 1][1], counts[i], edges[i][0], each, TALLEST * counts[i] / top)
        for i in sorted(counts)
    ]
    marked = sum(result.max_marked for result in graded) / len(graded)
    return Spread(median(points), round(sum(points) / len(points), 1), round(marked, 1), most, bars, edges)


def _steps() -> Iterator[float]:
    """Widths of a bar in points, ever wider: .1, .2, .5, 1, 2, 5 ..."""
    for power in range(-1, 9):
        yield from (10.0**power, 2 * 10.0**power, 5 * 10.0**power)


def _mistakes(graded: Sequence[Result], checks: Sequence[Check]) -> list[Mistake]:
    """The known mistakes by how many students made them."""
    who, where = defaultdict(set), defaultdict(set)
    for i, result in enumerate(graded):
        for mark in result.marks:
            if mark.mistake:
                who[mark.mistake].add(i)
                where[mark.mistake].add(mark.check)
    most = max(map(len, who.values()), default=0)
    return [
        Mistake(told, len(who[told]), len(who[told]) / most, [c.title for c in checks if c.id in where[told]])
        for told in sorted(who, key=lambda told: (-len(who[told]), told))
    ]


def _coded(check: Check, marks: Sequence[Mark]) -> Coded:
    count = Counter(mark.status for mark in marks)
    passed, partly, failed = count[PASSED], count[PARTLY], count[FAILED]
    reports = [] if check.hidden else [" ".join(mark.lines) for mark in marks if mark.status in (PARTLY, FAILED)]
    before = Counter(name for report in reports for name in _first_to_mend(report))
    share = passed / len(marks) if marks else 0.0
    other = len(marks) - passed - partly - failed
    return Coded(check, passed, partly, failed, other, share, before.most_common())


def _first_to_mend(report: str) -> set[str]:
    told = re.search(r"First mend ([^:]+):", report)
    return set(re.findall(r"`\w+`", told[1])) if told else set()


def _written(check: Check, marks: Sequence[Mark]) -> Written:
    blank = sum(mark.status == BLANK for mark in marks)
    points = [mark.points for mark in marks if mark.points is not None and mark.status != BLANK]
    mean = sum(points) / len(points) if points else None
    return Written(check, len(points), len(marks) - len(points) - blank, blank, mean)


def _student(label: str, link: str, result: Result, coded: Sequence[Check]) -> Student:
    given = {mark.check: mark.status for mark in result.marks}
    status = [given.get(check.id, NOT_RUN) for check in coded]
    remarks = [*["could not be graded"] * bool(result.problem), *["late"] * result.late]
    remarks += [f"{counted(result.ruling.less, 'point')} less"] if result.ruling.less else []
    remarks += [f"by {result.ruling.by}"] if result.ruling.by else []
    remarks += [f"{counted(result.ungraded, 'check')} could not be run"] if result.ungraded else []
    remarks += [f"{result.open} to be read"] if result.open else []
    remarks += [f"{result.blank} without an answer"] if result.blank else []
    signs = "".join((LOOKS.get(one) or LOOKS[NOT_RUN]).sign for one in status)
    passed = status.count(PASSED)
    return Student(label, link, not result.problem, result.points, result.max_points, signs, passed, remarks)
