"""Whom `course.toml` names: students as the LMS calls them, by name or number, and nobody by guess."""

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches

from ..report.lms import name_key
from ..report.texts import clean, listed, squash
from .course import Course, Extension, Group

Person = tuple[str, str]  # (name, number), as a Result has them
NEAR = 0.75  # how alike a name must be to be taken for one that is misspelt


@dataclass
class Known:
    """Those of one lab: {person: what each may be called}; complete: whether a list of the LMS says who there is."""

    called: dict[Person, set[str]] = field(default_factory=dict)
    complete: bool = False

    def find(self, said: str) -> list[Person]:
        """Who is called so."""
        return [person for person, names in self.called.items() if said in names]


@dataclass
class Named:
    """What a course says of the students of one lab."""

    extensions: dict[Person, Extension] = field(default_factory=dict)
    groups: list[tuple[Group, list[Person]]] = field(default_factory=list)

    def group(self, person: Person) -> tuple[Group, list[Person]] | None:
        """The group of a student, if any."""
        return next((pair for pair in self.groups if person in pair[1]), None)


def known(handed_in: Iterable[Person], roster: Iterable[Person]) -> Known:
    """Those of a lab, from the hand-ins and from the list of the LMS; who is in both, by name and number, is one.

    A group's number may be that of somebody else, so a number alone makes nobody one, but where a name is hidden.
    """
    of, at = Known(), dict[tuple[object, str], list[Person]]()
    for name, number in dict.fromkeys(handed_in):
        of.called[name, number] = _names(name, number)
        hidden = name.lower().startswith("participant ")
        at.setdefault((() if hidden else _letters(name), number), []).append((name, number))
    for name, number in roster:
        of.complete = True
        keys = [(_letters(name), number), (_letters(name), "")] + [((), number)] * bool(number)
        same = next((found for key in keys if (found := at.get(key, []))), [])
        of.called.setdefault(same[0] if len(same) == 1 else (name, number), set()).update(_names(name, number))
    return of


def _letters(name: str) -> tuple[str, ...]:
    return name_key(re.sub(r"[\W_]+", " ", name))


def _names(name: str, number: str) -> set[str]:
    name = squash(clean(name))
    return {said for said in (name, number, f"{name} ({number})") if said}


def named(course: Course, lab: str, labs: Mapping[str, Known]) -> tuple[Named, list[str]]:
    """(who is meant in one lab, what is wrong). labs: those of all labs."""
    found, wrong = Named(), list[str]()
    for group in course.groups:
        if not group.labs or lab in group.labs:
            found.groups.append((group, _members(group, course, lab, labs, found, wrong)))
    declared = {person: _names(*person) for _, members in found.groups for person in members}
    here = labs.get(lab) or Known()
    labs = {**labs, lab: Known({**declared, **here.called}, here.complete)}
    for one in course.extensions:
        person = _person(one.student, course, lab, labs, wrong, f"{one.where} student") if one.lab == lab else None
        if person and person in found.extensions:
            before = found.extensions[person]
            wrong.append(
                f"{one.where} student: {one.student!r} is {before.student!r}, who has an extension for {lab} already, "
                f"in {before.where.rstrip(',')}; keep one of them."
            )
        elif person:
            found.extensions[person] = one
    return found, wrong


def _members(
    group: Group, course: Course, lab: str, labs: Mapping[str, Known], found: Named, wrong: list[str]
) -> list[Person]:
    where = f"{group.where} members"
    members = [p for said in group.members if (p := _person(said, course, lab, labs, wrong, where, True))]
    for person in dict.fromkeys(members):
        if members.count(person) > 1:
            wrong.append(f"{where}: {person[0]!r} stands there twice, by name and number.")
        if other := found.group(person):
            wrong.append(f"{where}: {person[0]!r} is in {other[0].where.rstrip(',')} too, for {lab}; keep one of them.")
    return members


def _person(
    said: str, course: Course, lab: str, labs: Mapping[str, Known], wrong: list[str], where: str, member: bool = False
) -> Person | None:
    """Who is meant; None, with a sentence in `wrong`, if that cannot be told. member: a group's need not be known."""
    here = labs.get(lab) or Known()
    found = here.find(said)
    if len(found) == 1:
        return found[0]
    if found:
        which = " or ".join(f"{name} ({number})" if number else name for name, number in found)
        wrong.append(f"{where}: {said!r} may be {len(found)} students of {lab}; write which one, as {which}.")
        return None
    elsewhere = [of.find(said) for other, of in labs.items() if other != lab]
    if said in course.students or not said.isdigit() and any(elsewhere):
        return said, ""  # who has not handed in here
    if said.isdigit() and not here.called:
        return None  # numbers of Moodle are another lab's: this one's are not known yet
    everybody = sorted({name for of in labs.values() for name, _ in of.called if name})
    near = get_close_matches(said, everybody, 3, NEAR if member else 0.6)
    if member and not near and not here.complete and not said.isdigit():
        return said, ""
    wrong.append(f"{where}: {_unknown(said, lab, near, here)}")
    return None


def _unknown(said: str, lab: str, near: Collection[str], here: Known) -> str:
    if near:
        return f"there is no student {said!r}; did you mean {' or '.join(map(repr, near))}?"
    if here.complete:
        there = listed(sorted(name for name, _ in here.called if name))
        return f"there is no student {said!r} in {lab}; the LMS has {there}."
    return (
        f"no student {said!r} is known. Write the name as in the LMS; of who has not handed in anything yet, also into "
        f"the list students = [{said!r}] at the top of the file."
    )
