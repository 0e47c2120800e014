"""A gradebook of several labs and codes that may be copies, for tests, pictures and benchmarks of the term."""

import ast
import re
from contextlib import closing

from labkit.instructor.authoring.spec import definitions
from labkit.instructor.report.gradebook import Gradebook

from helpers.classroom import answers, blank, cell_is_code
from helpers.graded import CHECKS, classroom
from helpers.reference import ROOT

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


# Right forms of which each was written for itself: others are one text with a line changed, as a copy would be.
INDEPENDENT = {
    "01_cartesian_ekf": (
        *("inverse", "pinv", "joseph", "both signs", "information form", "sequential", "mean of the innovations"),
        *("float32", "in place", "loops and columns"),
    ),
    "03_range_bearing_ekf": (
        *("inverse", "pinv", "joseph", "both signs", "information form", "sequential", "least squares", "loops"),
        *("einsum", "dictionary", "math", "central differences", "positive bearings", "float32", "column"),
    ),
}


def codes(lab):
    """{id: text} of all answers of a lab, in each of its independent right forms."""
    text = "\n\n".join(source for id, source in answers(lab).items() if cell_is_code(blank(lab), id))
    text = re.sub(r" *### (BEGIN|END) SOLUTION\n?", "", text)
    found = {"model": text}
    for check in definitions(ROOT):
        for right in check.right if check.lab == lab else ():
            if right.id in INDEPENDENT[lab] and right.id not in found:
                found[right.id] = formed(text, right.form)
    return {id: made for id, made in found.items() if made}


def formed(text, form):
    """A text in another form: code that is appended, or edits; None if an edit does not fit."""
    if isinstance(form, str):
        return f"{text}\n\n{form}"
    for old, new in form:
        if text.count(old) != 1:
            return None
        text = text.replace(old, new)
    return text


class _Disguise(ast.NodeTransformer):
    """Names are others, functions stand in another order, and no comment or docstring is left."""

    def visit_ClassDef(self, node):
        self.generic_visit(node)
        node.body.sort(key=lambda part: getattr(part, "name", ""), reverse=True)
        return node

    visit_Module = visit_ClassDef  # noqa: N815 - ast's name

    def visit_FunctionDef(self, node):
        self.names = {arg.arg for arg in node.args.args if arg.arg != "self"}
        self.names |= {n.id for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
        self.generic_visit(node)
        if ast.get_docstring(node):
            node.body[0].value = ast.Constant("Another text.")
        return node

    def visit_Name(self, node):
        node.id = f"my_{node.id}" if node.id in self.names else node.id
        return node

    def visit_arg(self, node):
        node.arg = f"my_{node.arg}" if node.arg in self.names else node.arg
        return node


def disguised(text):
    """A text as somebody hands it in who does not want to be seen to have copied it."""
    tree = _Disguise()
    tree.names = set()
    lines = ast.unparse(tree.visit(ast.parse(text))).splitlines()
    return "\n".join(line + ("  # my own idea" if n % 3 == 0 else "") for n, line in enumerate(lines))
