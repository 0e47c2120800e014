"""What grading passes from one part to the next."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from datetime import datetime

import numpy as np

PASSED, PARTLY, FAILED, NOT_RUN, ERROR = "passed", "partly", "failed", "not run", "error"
OPEN, BLANK, BY_HAND = "open", "blank", "by hand"
IGNORED = "It was handed in late, and late hand-ins do not count."
UNSHUT = "(Marked without a sandbox.)"  # ends the reason of a mark, where it was
PARTS = {  # of a filter, as its student is told of them
    "motion": "`predict`: how the estimate moves",
    "spread": "`predict`: its covariance",
    "expected": "the expected measurement, and the innovation",
    "H": "H",
    "R": "R, and how several measurements are put together",
    "gain": "the gain, and the new estimate and covariance",
    "gate": "the gate, and d2",
    "empty": "nothing in view",
    "runs": "single steps and whole runs, as this check compares them",
}
STUB = "*Write your answer here (double-click to edit).*"  # stands in students' notebooks where a text is to go


class CommandError(Exception):
    """The command cannot go on; the text says in a sentence what is wrong, where, and what to do."""


class HandInError(Exception):
    """A submission that cannot be graded; the text is a sentence that its student understands."""


def points_of(most: float, weights: Mapping[str, int], parts: Collection[str]) -> float:
    """What a check of `most` points gives for these parts of its filter, rounded up to a tenth of a point.

    weights: {part: per cent}.
    """
    share = sum(weight for part, weight in weights.items() if part in parts) / 100
    return min(most, math.ceil(10 * most * share - 1e-6) / 10)


@dataclass(frozen=True)
class Check:
    """One thing that gives points, as the instructor's notebook describes it.

    hand: a written question, marked by a person; then question, rubric and model, a right answer, are Markdown texts.
    hidden: students never see its source or its inputs; the title is what they are told.
    parts: of a check of the filter `subject`, {part of PARTS: per cent of the points}, else empty.
    """

    id: str
    title: str
    points: float
    hand: bool = False
    hidden: bool = False
    question: str = ""
    rubric: str = ""
    subject: str = ""
    parts: Mapping[str, int] = field(default_factory=dict)
    model: str = ""


@dataclass(frozen=True)
class Mark:
    """What one check gave; points is None while a written answer waits to be read, or the check to be run.

    status  one of the eight words above; only 'passed', 'partly' and 'by hand' give points.
    reason  a sentence for the student, '' when passed.
    lines   more lines for the student (the call, what was expected, what came).
    mistake the known mistake that was recognised, as the sentence that explains it, or ''.
    parts   of a filter that fails, those that are right all the same, see `PARTS`.
    """

    check: str
    points: float | None
    max_points: float
    status: str
    reason: str = ""
    lines: tuple[str, ...] = ()
    mistake: str = ""
    parts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Ruling:
    """What the course's rules made of a student's points.

    raw     the points before all rules, None without rules.
    less    what being late takes of the points of all marks;  days: begun after the due date, 0 if that is not known.
    by      who handed it in for the student, '' for the student.
    best    whether it counts as the best of several hand-ins, and the newest, or another, has less.
    told    a sentence for the student for each rule that changed something.
    """

    raw: float | None = None
    less: float = 0.0
    days: int = 0
    by: str = ""
    best: bool = False
    told: tuple[str, ...] = ()


@dataclass
class Result:
    """One student's graded submission of one lab.

    student     the name by which a person knows the student.
    identifier  the LMS's number for the student or the submission, '' if there is none.
    source      the file it came from;  when: time of handing in, or None.
    notes       sentences on what was chosen or is odd (late, several attempts, cells missing).
    level       sandbox level that its code ran at.
    id          the number of the submission in the gradebook.
    problem     why it could not be graded at all, or ''.
    answers     {check id: the student's text} of the written questions, and {'guess NAME': letter} of predictions.
    figure      {name: array} for the picture of the feedback page, or {}.
    ruling      what the course's rules made of the points, see `labkit.instructor.policy`.
    """

    student: str
    identifier: str = ""
    lab: str = ""
    source: str = ""
    when: datetime | None = None
    late: bool = False
    notes: list[str] = field(default_factory=list)
    level: int = 0
    problem: str = ""
    marks: list[Mark] = field(default_factory=list)
    answers: dict[str, str] = field(default_factory=dict)
    figure: dict[str, np.ndarray] = field(default_factory=dict)
    id: int = 0
    ruling: Ruling = Ruling()

    @property
    def points(self) -> float:
        """The sum of what is marked so far, after the course's rules."""
        return sum(mark.points or 0 for mark in self.marks) - self.ruling.less

    @property
    def raw(self) -> float:
        """The same before the course's rules."""
        return self.points if self.ruling.raw is None else self.ruling.raw

    @property
    def max_points(self) -> float:
        """The sum of what all checks can give."""
        return sum(mark.max_points for mark in self.marks)

    @property
    def max_marked(self) -> float:
        """The same of those that are marked."""
        return sum(mark.max_points for mark in self.marks if mark.points is not None)

    @property
    def open(self) -> int:
        """How many written answers wait to be read."""
        return sum(mark.points is None and mark.status == OPEN for mark in self.marks)

    @property
    def ungraded(self) -> int:
        """How many checks were not run, through no fault of the student: there are no points to tell yet."""
        return sum(mark.points is None and mark.status != OPEN for mark in self.marks)

    @property
    def blank(self) -> int:
        """How many written questions have no answer, and no points by hand."""
        return sum(mark.status == BLANK for mark in self.marks)
