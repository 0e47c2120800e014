"""What the rules have to say before anything is graded: whom they name, and which hand-ins come too late to count."""

from argparse import Namespace
from collections.abc import Sequence
from datetime import datetime

from ..intake.attempts import Rules
from ..intake.collect import Entry, Unfit
from ..report import canvas, moodle
from ..report.gradebook import Gradebook
from ..report.lms import digits
from ..report.sheet import Sheet
from . import memory
from .apply import too_late
from .course import Course
from .people import Person, named
from .reading import refuse


def rules(
    book: Gradebook, lab: str, course: Course, args: Namespace, found: Sequence[Entry | Unfit]
) -> tuple[Rules, datetime | None, list[str]]:
    """(which hand-ins of a lab are graded, when it is due, notes), and the command's options kept for the lab.

    found: what was handed in, under the names that count. Raises CommandError for names in the course's file that
    are nobody's, or may be several students'.
    """
    said = memory.options(args)
    memory.remember(book, lab, said, roster(args))
    people = memory.people_of(book, {lab: [(of.student, of.identifier) for of in found]})
    wrong: list[str] = []
    for one in dict.fromkeys((*people, *(extension.lab for extension in course.extensions))):
        wrong += named(course, one, people)[1]
    refuse(book.path.with_name(course.file), list(dict.fromkeys(wrong)))
    own, notes = memory.overridden(course, lab, said)
    of, _ = named(course, lab, people)

    def late(entry: Entry) -> bool:
        return own.late.ignore and too_late((entry.student, entry.identifier), entry.when, entry.late, own, of, lab)

    return Rules(own.lab(lab).attempts, late), own.lab(lab).due, notes


def roster(args: Namespace) -> list[Person]:
    """The class, as the LMS's own file lists it; [] without one. Raises CommandError if it cannot be read."""
    found: list[Person] = []
    if args.moodle:
        found += [(row.name, digits(row.identifier)) for row in moodle.rows_of(Sheet(args.moodle)).values()]
    if args.canvas:
        found += canvas.people(args.canvas)
    return [person for person in found if any(person)]
