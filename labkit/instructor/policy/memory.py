"""What the gradebook keeps for the rules: who is in the class, and what the command's options said of a lab.

So that whatever reads a lab out later, the tables of another lab's run or the page of the term, tells the same points.
"""

import json
from argparse import Namespace
from collections.abc import Iterable
from dataclasses import replace
from datetime import datetime
from typing import Any

from ..report.gradebook import Gradebook
from . import moments
from .course import NAME, Course, Lab, Late
from .people import Known, Person, known
from .reading import read


def options(args: Namespace) -> dict[str, str]:
    """What the command's options say of the rules, as it is kept."""
    due = args.due.isoformat() if args.due else ""
    return {name: said for name, said in (("due", due), ("late", args.late), ("attempts", args.attempts)) if said}


def remember(book: Gradebook, lab: str, said: dict[str, str], roster: Iterable[Person]) -> None:
    """Keep the options of a lab's run, and the class if there is a new list of it."""
    people = [*roster] or _kept(book, lab).get("people", [])
    kept = json.dumps({"options": said, "people": people})
    book.db.execute("INSERT OR REPLACE INTO meta VALUES (?, ?)", (f"course-{lab}", kept))


def _kept(book: Gradebook, lab: str) -> dict[str, Any]:
    rows = book.db.execute("SELECT value FROM meta WHERE key = ?", (f"course-{lab}",)).fetchall()
    return json.loads(rows[0][0]) if rows else {}


def people_of(book: Gradebook, more: dict[str, Iterable[Person]] | None = None) -> dict[str, Known]:
    """{lab: whom the gradebook knows}. more: {lab: those of hand-ins that are not in it yet}."""
    more = more or {}
    query = "SELECT DISTINCT student, identifier FROM submission WHERE lab = ? AND current = 1"
    found = {}
    for lab in dict.fromkeys((*book.labs(), *more)):
        handed_in = [*more.get(lab, ()), *book.db.execute(query, (lab,)).fetchall()]
        found[lab] = known(handed_in, map(tuple, _kept(book, lab).get("people", [])))
    return found


def course_of(book: Gradebook, lab: str, course: Course | None = None) -> Course:
    """The rules that hold for a lab: of the file beside the gradebook, unless `course` is it, and of the options.

    Raises CommandError for a file that cannot be used.
    """
    course = course or read(book.path.with_name(NAME), book.labs())
    return overridden(course, lab, _kept(book, lab).get("options", {}))[0]


def overridden(course: Course, lab: str, said: dict[str, str]) -> tuple[Course, list[str]]:
    """(the rules of one lab with what the options say in their place, sentences on what goes before the file)."""
    of, late, notes = course.lab(lab), course.late, []
    if "due" in said:
        due = moments.moment(datetime.fromisoformat(said["due"]), None)
        if of.due and of.due != due:
            told = f"{moments.shown(due, course.zone)} goes before {course.file}, by which {lab} is due"
            notes.append(f"--due: {told} {moments.shown(of.due, course.zone)}.")
        of = replace(of, due=due)
    if "late" in said:
        ignore = said["late"] == "ignore"
        if late.costs and not (late.ignore and ignore):
            notes.append(f"--late {said['late']} goes before what {course.file} says of late hand-ins.")
        late = Late(grace=late.grace, ignore=ignore)
    if "attempts" in said:
        if (course.labs.get(lab, Lab()).attempts or course.attempts) and of.attempts != said["attempts"]:
            notes.append(f"--attempts {said['attempts']} goes before {course.file}, by which the {of.attempts} counts.")
        of = replace(of, attempts=said["attempts"])
    return replace(course, late=late, labs={**course.labs, lab: of}), notes
