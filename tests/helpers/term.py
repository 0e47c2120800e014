"""A gradebook of several labs, for tests, pictures and the benchmark of the term."""

from contextlib import closing

from labkit.instructor.report.gradebook import Gradebook

from helpers.graded import CHECKS, classroom

LABS = (
    "01_cartesian_ekf",
    "02_noise_mismatch",
    "03_range_bearing_ekf",
    "04_legged_robot",
    "05_fuzzy_hybrid",
    "06_observers",
    "07_formation",
    "08_further",
)


def a_term(out, students=60, labs=4):
    """The folder `out` as `labkit grade` leaves it but for pages: each lab misses another sixth of the students."""
    out.mkdir(parents=True, exist_ok=True)
    with closing(Gradebook(out / "gradebook.db", seed=7)) as book, book:
        for number, lab in enumerate(LABS[:labs]):
            book.set_paper(lab, "paper", CHECKS)
            for at, result in enumerate(classroom(students, seed=number)):
                if at % 6 != number % 6:
                    enter(book, lab, result, number)
    return out


def enter(book, lab, result, number=0):
    """Put a made-up result into the gradebook, numbered as Moodle does: anew for each lab."""
    about = (result.student, f"{result.identifier}{number}", result.source, str(result.id), "paper", result.when)
    id = book.add(lab, *about, result.late, result.notes, result.answers, result.problem)
    book.choose(id, result.notes, result.late)
    hands = {check.id for check in CHECKS if check.hand}
    for mark in result.marks:
        if mark.check not in hands:
            book.mark(id, mark.check, mark.points, mark.status, mark.reason, mark.lines, mark.mistake)
    book.finish(id)
    for mark in result.marks:
        if mark.check in hands and mark.points is not None:
            book.hand(book.result(id), mark.check, mark.points, mark.reason)
