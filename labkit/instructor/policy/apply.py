"""The rules applied: from what a lab's checks and readers gave to the points that count, each change in a sentence.

The gradebook keeps the raw marks, so that other rules give other points without grading anything.
"""

import json
from collections.abc import Collection, Sequence
from dataclasses import replace
from datetime import UTC, datetime

from ..records import ERROR, FAILED, IGNORED, PARTLY, Mark, Result, Ruling
from ..report.gradebook import Gradebook
from ..report.texts import counted, listed, plain
from . import moments, penalty
from .course import BEST, FIRST, NEWEST, OWN, Course
from .memory import course_of, people_of
from .people import Named, Person, named
from .reading import refuse


def ruled(book: Gradebook, lab: str, course: Course | None = None) -> list[Result]:
    """Each student's result of a lab after the rules, by name: `points` and `late` are those that count, and
    `ruling` says what was changed. Members of a group who did not hand in are among them.

    course: what `course.toml` says, read anew if it is not given. Raises CommandError if that cannot be used.
    """
    course = course_of(book, lab, course)
    of, wrong = named(course, lab, people_of(book))
    refuse(book.path.with_name(course.file), wrong)
    raw = {(result.student, result.identifier): result for result in book.results(lab)}
    people = dict.fromkeys([*raw, *(person for _, members in of.groups for person in members)])
    found = [result for person in people if (result := _of_person(person, raw, course, of))]
    if course.lab(lab).attempts == BEST:
        several = {id: ids for ids in book.attempts(lab) if len(ids) > 1 for id in ids}
        found = [_of_several(result, several.get(result.id, ()), book, course, of) for result in found]
    return sorted(found, key=lambda result: (result.student.lower(), result.identifier))


def _of_several(best: Result, ids: Collection[int], book: Gradebook, course: Course, of: Named) -> Result:
    """The best of the hand-ins with these numbers, which says so where the newest has less.

    A file that was graded anew, as its lab was changed, is one hand-in, whose newest grading is meant.
    """
    if best.problem or best.ungraded or len(ids) < 2:
        return best
    query = "SELECT id, digest FROM submission WHERE id IN (SELECT value FROM json_each(?)) ORDER BY id"
    files = dict[int, str](book.db.execute(query, (json.dumps([*ids]),)).fetchall())
    last = {digest: id for id, digest in files.items()} | {files[best.id]: best.id}
    found = [apply(book.result(id), _person(best), course, of) for id in last.values()]
    others = [result for result in found if not result.problem and result.id != best.id]
    if not others or any(result.ungraded or result.points > best.points for result in others):
        return best
    known = all(result.when for result in (best, *others))
    other = max(others, key=lambda r: r.when or datetime.min) if known else min(others, key=lambda r: r.points)
    if other.points == best.points or known and best.when and other.when and other.when < best.when:
        return best
    whose = f"{best.ruling.by}'s " * bool(best.ruling.by)
    told = (
        f"The best of {whose}{len(others) + 1} graded hand-ins counts, with {plain(best.points, 2)} points"
        f"{' so far' * bool(best.open)}; {'the newest of them' if known else 'another'} has {plain(other.points, 2)}."
    )
    return _with(replace(best, ruling=replace(best.ruling, best=True)), told)


def choose_best(book: Gradebook, lab: str, course: Course | None = None) -> None:
    """Let each student's attempt with the most points after the rules count, of those that could be graded.

    One of which a check could not be run may be the best: it stands, without points, until it is known.
    """
    course = course_of(book, lab, course)
    of, _ = named(course, lab, people_of(book))
    with book:
        for ids in book.attempts(lab):
            graded = [(id, apply(result, _person(result), course, of)) for id in ids for result in [book.result(id)]]
            good = [(id, result) for id, result in graded if not result.problem]
            if good:
                id, _ = max(good, key=lambda pair: (_broken(pair[1]), pair[1].points, pair[0]))
                now = book.result(id)
                book.choose(id, now.notes, now.late)


def _broken(result: Result) -> bool:
    return any(mark.status == ERROR for mark in result.marks)


def _person(result: Result) -> Person:
    return result.student, result.identifier


def due_of(person: Person, course: Course, of: Named, lab: str) -> datetime | None:
    """When a lab is due for one student."""
    due, extension = course.lab(lab).due, of.extensions.get(person)
    return max(due, extension.due) if due and extension else due


def too_late(person: Person, when: datetime | None, late: bool, course: Course, of: Named, lab: str) -> bool:
    """Whether what a student handed in is late for everybody of the student's group. late: the LMS says so."""
    pair = of.group(person)
    probe = Result(*person, lab, when=when, late=late)
    return all(apply(probe, member, course, of).late for member in (pair[1] if pair else [person]))


def _of_person(person: Person, raw: dict[Person, Result], course: Course, of: Named) -> Result | None:
    """What counts for one student: the own hand-in, or one of the student's group."""
    pair = of.group(person)
    if not pair:
        return apply(raw[person], person, course, of)
    group, members = pair
    own = raw.get(person)
    graded = [raw[one] for one in members if one in raw and not raw[one].problem]
    if not graded:
        return apply(own, person, course, of) if own else None
    rule = group.counts or course.lab(graded[0].lab).attempts
    if rule != BEST and not all(result.when for result in graded):
        rule = UNTIMED
    mine = [apply(result, person, course, of) for result in graded]
    mine = [result for result in mine if not result.problem] or mine
    chosen = _choice(mine, own, rule)
    if own and chosen.id == own.id:
        return chosen
    by = next(result.student for result in graded if result.id == chosen.id)
    told = f"{by} handed this in for your group ({listed(name for name, _ in members)})"
    several = f"; of its {len(graded)} hand-ins {_WORDS[rule]} counts." if len(graded) > 1 else "."
    ruling = replace(chosen.ruling, by=by, told=(told + several, *chosen.ruling.told))
    return replace(chosen, student=person[0], identifier=person[1], ruling=ruling)


UNTIMED = "untimed"
_WORDS = {
    NEWEST: "the newest",
    FIRST: "the first",
    BEST: "the one with most points",
    OWN: "the newest",
    UNTIMED: "the one with most points, since it is not known which came first,",
}


def _choice(graded: Sequence[Result], own: Result | None, rule: str) -> Result:
    """The hand-in of a group that counts for one member, whose own is `own`."""
    mine = next((result for result in graded if own and result.id == own.id), None)
    if mine and rule in (OWN, UNTIMED):
        return mine
    if rule in (BEST, UNTIMED):
        return max(graded, key=lambda r: (r.points, r is mine, r.id))
    order = sorted(graded, key=lambda r: (r.when or datetime.min, (r is mine) != (rule == FIRST)))
    return order[0] if rule == FIRST else order[-1]


def apply(result: Result, person: Person, course: Course, of: Named) -> Result:
    """A raw result after all rules but those of groups, as if it were this student's."""
    marks, told = _whole(result.marks, course)
    ruling = Ruling(sum(mark.points or 0 for mark in result.marks), told=tuple(told))
    result = replace(result, marks=marks, notes=[*result.notes], ruling=ruling)
    return _timed(result, person, course, of)


def _whole(marks: Collection[Mark], course: Course) -> tuple[list[Mark], list[str]]:
    """(marks, sentences) where a check counts as a whole or not at all."""
    parts = [mark for mark in marks if mark.status == PARTLY and mark.points]
    if course.partial_credit or not parts:
        return [*marks], []
    lost, all_of = sum(mark.points or 0 for mark in parts), sum(mark.points or 0 for mark in marks)
    told = (
        f"A check counts as a whole in this course: {plain(lost, 2)} of {plain(all_of, 2)} points less, which were for"
    )
    whole = [replace(m, points=0.0, status=FAILED, parts=()) if m.status == PARTLY else m for m in marks]
    return whole, [f"{told} parts of {counted(len(parts), 'check')} that you did not pass."]


def _timed(result: Result, person: Person, course: Course, of: Named) -> Result:
    """The result with what its time changes."""
    due, lab = due_of(person, course, of, result.lab), course.lab(result.lab)
    extension = of.extensions.get(person) if lab.due else None
    if not due or not result.when:
        return _told_late(result, course, extension is not None)
    zone, late, handed = course.zone, course.late, result.when
    days = moments.days_late(handed, due, late.grace, zone)
    when, until = moments.shown(handed, zone), moments.shown(due, zone)
    if days:
        return _costly(result, course, days, f"due {until}{' by your extension' * bool(extension)}, handed in {when}")
    result = replace(result, late=False)
    if late.costs and extension and moments.days_late(handed, lab.due or due, late.grace, zone):
        return _with(result, f"Handed in {when}: in time, by your extension until {until}.")
    if late.costs and handed.astimezone(UTC) > due.astimezone(UTC):
        minutes = plain(late.grace.total_seconds() / 60)
        return _with(result, f"Handed in {when}, due {until}: in time, with {minutes} minutes of grace.")
    return result


def _told_late(result: Result, course: Course, extended: bool) -> Result:
    """Where only the LMS can say whether it is late, and never by how much."""
    if not result.late:
        return result
    if extended:
        told = "Handed in late, as the LMS says, which may not know of your extension: counted as in time."
        return _with(replace(result, late=False), told)
    if course.late.ignore:
        return replace(result, problem=result.problem or IGNORED, marks=[])
    told = "Handed in late; by how much is not known, so that it costs nothing." if course.late.costs else ""
    return _with(result, told) if told else replace(result, notes=[*result.notes, "Handed in late."])


def _costly(result: Result, course: Course, days: int, when: str) -> Result:
    """A result that is so many days late."""
    late = course.late
    result = replace(result, late=True, ruling=replace(result.ruling, days=days))
    if late.ignore:
        result = replace(result, problem=result.problem or IGNORED, marks=[])
        return _with(result, f"{counted(days, 'day')} late ({when}; a day begun counts).")
    cost = penalty.less(late, days, result.points, result.max_points)
    if not cost:
        return replace(result, notes=[*result.notes, "Handed in late."])
    told = (
        f"{counted(days, 'day')} late ({when}; a day begun counts): {penalty.rate(late, result.max_points)}, "
        f"{plain(cost, 2)} of {plain(result.points, 2)} points less."
    )
    return _with(replace(result, ruling=replace(result.ruling, less=cost)), told)


def _with(result: Result, told: str) -> Result:
    return replace(result, ruling=replace(result.ruling, told=(*result.ruling.told, told)))
