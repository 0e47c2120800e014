"""The parts of a filter that are right, asked for in this process, without a sandbox."""

from functools import cache

from labkit.checks.probing import ask
from labkit.instructor.authoring.build import ROOT
from labkit.instructor.authoring.spec import answers, build, definitions
from labkit.instructor.exam.parts import draw, right_parts
from labkit.notebook.read import read

CHECKS = {check.name: check for check in definitions(ROOT) if check.divided}


@cache
def source_of(lab):
    """The imports and answers of a lab's solution."""
    return answers(read(ROOT / "solutions" / f"{lab}.ipynb"))


@cache
def drawn(name, student):
    """What a student's filter is asked."""
    return draw(CHECKS[name], mistaken(CHECKS[name], ()), 1, student)


def here(check, subject, student="student"):
    """The right parts of a filter class of this process."""
    return right_parts(drawn(check.name, student), lambda data: ask(subject, "filter", data["probing"]["probes"]))


def mistaken(check, form):
    """A filter of a check with one form of a mistake."""
    return build(source_of(check.lab), form, check.subject)


def mistakes(check):
    """{'check: mistake 1': form} of all checks of the same filter."""
    same = [one for one in definitions(ROOT) if (one.lab, one.subject) == (check.lab, check.subject)]
    return {f"{one.name}: {m.id} {k}": form for one in same for m in one.mistakes for k, form in enumerate(m.forms, 1)}
