"""What is wrong in a lab's source, each in a sentence with its line, before anything is built from it."""

import ast
import re
from collections.abc import Collection, Iterator
from difflib import get_close_matches
from math import inf
from pathlib import Path

from nbformat import NotebookNode

from ...notebook.source import python
from . import percent

TAGS = ("hidden", "nbval-ignore-output", "nbval-skip", "raises-exception", *percent.ROLES)
HEAD = ("id", "tags", "points", "title")  # what labkit reads in the head of a cell
KEPT = ("labkit", "nbgrader", "parts", "jupyter", "collapsed", "scrolled", "editable", "deletable", "slideshow")
MARKER = re.compile(r"### (BEGIN|END) (SOLUTION|HIDDEN TESTS)")


def problems(script: Path, checks: Collection[str]) -> list[str]:
    """Sentences on a lab's source, such as "solutions/09_my_lab.py, line 30, cell 'check-h': ...".

    checks: the names of all checks in solutions/checks. Raises CommandError for a source that cannot be read at all.
    """
    book = percent.notebook(script)
    exam = any(
        re.search(r"(?m)^exam = Exam\(", cell.source) and {"setup", "hidden"} <= {*cell.metadata.get("tags", [])}
        for cell in book.cells
    )
    found = []
    for number, cell in enumerate(book.cells):
        told = [*_of(cell, checks), *((1, says) for says in _around(cell, book, script.stem, exam))]
        found += [f"{percent.place(script, number, line)}, cell '{cell.id}': {says}" for line, says in told]
    return found


def _of(cell: NotebookNode, checks: Collection[str]) -> Iterator[tuple[int, str]]:
    """(line in the cell, sentence) about a cell by itself."""
    tags = cell.metadata.get("tags", [])
    for key in cell.metadata.keys() - {*HEAD, *KEPT}:
        if key == "incorrectly_encoded_metadata":  # as jupytext calls it
            yield 0, f"its head cannot be read: {cell.metadata[key]}; it holds {', '.join(HEAD)}, texts in quotes."
        elif not key.startswith("lines_to_"):  # jupytext's own, on blank lines
            yield 0, f"{key!r} means nothing in the head of a cell, which may have {', '.join(HEAD)}."
    for tag in set(tags) - set(TAGS):
        near = get_close_matches(tag, TAGS, 1)
        yield 0, f"the tag {tag!r} means nothing here" + (f": is {near[0]!r} meant?" if near else ".")
    if set(tags) & set(percent.ROLES) and re.fullmatch(r"(show|text)-\d\d", cell.id):
        yield 0, f"a cell with the tag {tags[0]!r} needs an id: its marks and its place are known by it."
    points = cell.metadata.get("nbgrader", {}).get("points", 0)
    if isinstance(points, bool) or not isinstance(points, int | float) or not 0 <= points < inf:
        yield 0, f"points={points!r} is no number from 0 on."
    yield from _markers(cell)
    if cell.metadata.labkit == "guess" and len(re.findall(r"""(?m)^guess = ["']\w["']""", cell.source)) != 1:
        yield 1, 'a prediction has one line such as guess = "b".'
    if cell.cell_type == "code":
        yield from _code(cell, checks)


def _markers(cell):
    """About the markers of solutions and hidden tests."""
    opened = None
    for line, text in enumerate(cell.source.splitlines(), 1):
        if mark := MARKER.search(text):
            if (mark[1] == "END") != (opened == mark[2]):
                yield line, f"`### {mark[0][4:]}` has no partner before it."
                return
            opened = mark[2] if mark[1] == "BEGIN" else None
            named = re.search(r"(?m)^\s*(def|class) ", "\n".join(cell.source.splitlines()[:line]))
            if mark[0] == "### BEGIN SOLUTION" and cell.cell_type == "code" and not named:
                yield line, "a solution stands inside a function or a method, whose stub students get; here is none."
    if opened:
        yield len(cell.source.splitlines()), f"`### BEGIN {opened}` has no END."
    elif cell.metadata.labkit == "answer" and "### BEGIN SOLUTION" not in cell.source:
        yield 1, "an answer lies between `### BEGIN SOLUTION` and `### END SOLUTION`; here students would get it whole."


def _code(cell, checks):
    try:
        tree = ast.parse(python(cell.source))
    except SyntaxError as error:
        yield error.lineno or 1, f"this is not Python: {error.msg}."
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "check" and node.args:
            name = getattr(node.args[0], "value", None)
            if isinstance(name, str) and name not in checks:
                near = get_close_matches(name, checks, 1)
                hint = f" Is {near[0]!r} meant?" if near else " Its definition goes into a list CHECKS there."
                yield node.lineno, f"solutions/checks has no check {name!r}.{hint}"


def _around(cell, book, lab, exam):
    """Sentences about a cell among the others."""
    pointed, hidden = "points" in cell.metadata.get("nbgrader", {}), "hidden" in cell.metadata.get("tags", [])
    if cell.cell_type == "code" and hidden:
        if pointed and not exam:
            yield 'a hidden check needs `exam = Exam("' + lab + '")` in a cell before, tagged "setup" and "hidden".'
        if cell.id.startswith("grade-") and not pointed:
            yield "a hidden check without points counts nowhere: write points=2 in its head, or how many it gives."
    if cell.cell_type == "code" and pointed and not re.search(r"\b(print|check)\(", cell.source):
        yield 'it prints nothing, so nobody could tell that it passed: let it end with print("passed").'
    if cell.cell_type == "markdown":
        yield from _written(cell, {other.id: other for other in book.cells}, pointed, hidden)
    for name in re.findall(r"(?m)^exam = Exam\(\"(.*?)\"\)", cell.source):
        if name != lab:
            yield f"Exam({name!r}) is another lab's: here it is Exam({lab!r})."


def _written(cell, cells, pointed, hidden):
    """Sentences about a written question and its rubric. cells: {id: cell} of the lab."""
    rubric, asked = cell.id.replace("answer", "rubric"), cells.get(cell.id.replace("rubric", "answer", 1))
    if pointed and rubric not in cells:
        yield f"a written question with points needs a rubric: a hidden text cell with the id '{rubric}'."
    if cell.id.startswith("rubric-") and not hidden:
        yield 'students would get this rubric: write tags=["hidden"] in its head.'
    if cell.id.startswith("rubric-") and asked and "points" not in asked.metadata.get("nbgrader", {}):
        yield f"this is a rubric, but its question, '{asked.id}', has no points."
