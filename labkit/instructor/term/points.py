"""What counts in the term: points, and what each lab weighs. The one place that knows where they come from."""

from collections.abc import Iterable

from ..policy import NAME, course_of, read, ruled
from ..policy.memory import people_of
from ..policy.people import Person, named
from ..records import Result
from ..report.gradebook import Gradebook


def counting(book: Gradebook, lab: str) -> list[Result]:
    """The results of a lab with the points that count. Raises CommandError for rules that cannot be used."""
    return ruled(book, lab)


def weights(book: Gradebook, labs: Iterable[str]) -> dict[str, float]:
    """What each lab weighs in the total."""
    return {lab: course_of(book, lab).lab(lab).weight for lab in labs}


def known(book: Gradebook) -> tuple[list[str], bool]:
    """(names of all students, whether a list says who is in the class), the LMS's or the course's own."""
    people, own = people_of(book), read(book.path.with_name(NAME), book.labs()).students
    names = [*own, *(name for of in people.values() for name, _ in of.called)]
    return [name for name in names if not name.isdigit()], bool(own) or any(of.complete for of in people.values())


def groups(book: Gradebook, lab: str) -> list[list[Person]]:
    """Who hands in together in a lab, as the course's rules say."""
    return [members for _, members in named(course_of(book, lab), lab, people_of(book))[0].groups]
