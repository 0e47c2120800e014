"""What an instructor decided for a course, as `course.toml` says it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta, tzinfo

NAME = "course.toml"  # beside the gradebook
NEWEST, FIRST, BEST, OWN = "newest", "first", "best", "own"


@dataclass(frozen=True)
class Late:
    """What a late hand-in costs: points or per cent, of those reached or of all possible, for each day begun.

    grace: so much later is in time still, each day;  cap: it never costs more, in the same unit;
    ignore: late ones do not count at all.
    """

    points: float = 0.0
    percent: float = 0.0
    possible: bool = False
    grace: timedelta = timedelta()
    cap: float | None = None
    ignore: bool = False

    @property
    def costs(self) -> bool:
        """Whether being late changes anything."""
        return self.ignore or self.points > 0 or self.percent > 0


@dataclass(frozen=True)
class Lab:
    """What holds for one lab. due: with its zone;  attempts: which counts, '' for the course's."""

    due: datetime | None = None
    attempts: str = ""
    weight: float = 1.0


@dataclass(frozen=True)
class Extension:
    """A student's own due date. student: name or number;  where: it stands in the file."""

    student: str
    lab: str
    due: datetime
    where: str


@dataclass(frozen=True)
class Group:
    """Students one of whom hands in for all.

    labs: () for all;  counts: which of several hand-ins, '' as for one student;  where: it stands in the file.
    """

    members: tuple[str, ...]
    labs: tuple[str, ...]
    counts: str
    where: str


@dataclass(frozen=True)
class Course:
    """All rules; without a file they are those of a command without options.

    zone: of times that name none, None for this machine's;  attempts: '' if nothing is said;
    students: who is in the class, beside those known anyway;  known: the names of all labs that there are;
    variants: the course's name, from which numbers of students' own are drawn, '' for the same numbers for all;
    roster: the table of its students, as `labkit.instructor.roster` reads it;  file: as messages call it.
    """

    zone: tzinfo | None = None
    attempts: str = ""
    partial_credit: bool = True
    late: Late = field(default_factory=Late)
    labs: Mapping[str, Lab] = field(default_factory=dict)
    extensions: tuple[Extension, ...] = ()
    groups: tuple[Group, ...] = ()
    students: tuple[str, ...] = ()
    known: tuple[str, ...] = ()
    variants: str = ""
    roster: str = ""
    file: str = NAME

    def lab(self, name: str) -> Lab:
        """What holds for one lab."""
        lab = self.labs.get(name) or Lab()
        return replace(lab, attempts=lab.attempts or self.attempts or NEWEST)

    @property
    def weights(self) -> dict[str, float]:
        """{lab: how much it counts in the course's total}, 1 where nothing else is said."""
        return {name: self.lab(name).weight for name in dict.fromkeys((*self.known, *self.labs))}
