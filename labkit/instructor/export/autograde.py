"""What nbgrader runs in the place of its own execution, see the nbgrader_config.py that `labkit export` writes.

Nothing of a student's runs in nbgrader's process or in its kernel: answers are graded in labkit's sandbox, and the
marks stand where nbgrader looks for them, as the outputs of the cells with points.
"""

import contextlib
import io
from pathlib import Path
from typing import Any

from nbformat import NotebookNode
from nbformat.v4 import new_code_cell, new_output
from nbgrader import utils
from nbgrader.converters.base import NbGraderException
from nbgrader.preprocessors import Execute
from traitlets import Integer, List, Unicode

from ..exam.exam import ROOT
from ..records import BLANK, BY_HAND, FAILED, OPEN, CommandError, Mark, Result
from ..report.texts import plain
from .single import graded, told


class Marks(Execute):
    """Puts labkit's marks into a notebook of a lab; any other notebook of the course is run as nbgrader does."""

    seed = Integer(0, help="What students' inputs are drawn from.").tag(config=True)
    allowed = List(Unicode(), help="Of weak_sandbox and trust_students.").tag(config=True)

    def preprocess(self, nb: NotebookNode, resources: dict[str, Any], *more: Any) -> tuple[NotebookNode, dict]:
        """The notebook with outputs in its cells with points. Raises NbGraderException, which leaves no mark."""
        about = resources["nbgrader"]
        if not (ROOT / "solutions" / f"{about['notebook']}.ipynb").is_file():
            return super().preprocess(nb, resources, *more)
        course = self.parent.parent.coursedir  # of the exporter's converter
        folder = course.format_path(course.submitted_directory, about["student"], about["assignment"])
        try:
            with contextlib.redirect_stdout(io.StringIO()) as said:
                result = graded(about["notebook"], Path(folder), about["student"], self.seed, self.allowed)
            fill(nb, result)
        except CommandError as problem:
            raise NbGraderException(f"{about['student']}, {about['notebook']}: {problem}") from None
        finally:
            self.log.info(said.getvalue())
        for note in result.notes:
            self.log.warning("%s: %s", about["student"], note)
        return nb, resources


def fill(nb: NotebookNode, result: Result) -> None:
    """Give each code cell with points its mark as an output; for cells that were deleted there are new ones.

    Raises CommandError for a cell with points of which the kit knows nothing.
    """
    marks = {mark.check: mark for mark in result.marks if mark.points is not None}
    for cell in nb.cells:
        if not utils.is_grade(cell):
            continue
        id = cell.metadata.nbgrader["grade_id"]
        mark = marks.pop(id, None)
        if cell.cell_type == "code":
            if not (mark or result.problem):
                raise CommandError(f"the kit has no check '{id}': is it another version than the one that exported?")
            cell.outputs = _outputs(mark or Mark(id, 0.0, 0.0, FAILED, result.problem))
    nb.cells += [_cell(mark) for mark in marks.values() if mark.status not in (OPEN, BLANK, BY_HAND)]


def _cell(mark):
    about = {"grade": True, "grade_id": mark.check, "points": mark.max_points, "solution": False, "locked": True}
    about |= {"schema_version": 3, "cell_type": "code", "task": False}
    source = f"# {mark.check}: its cell was not there any more."
    return new_code_cell(source, metadata={"nbgrader": about}, outputs=_outputs(mark))


def _outputs(mark):
    """What is said of a mark, and its points as nbgrader reads them: the number that a cell gives."""
    said = told(mark)
    text = [new_output("stream", name="stdout", text=said + "\n")] if said else []
    return [*text, new_output("execute_result", {"text/plain": plain(mark.points or 0)}, execution_count=1)]
