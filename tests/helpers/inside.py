"""An examination in the test's own process, without sandbox, kernel and nbval; frames and check cells are real."""

import io
import os
from contextlib import redirect_stdout
from functools import cache

from labkit.instructor.exam import paper
from labkit.instructor.exam.jobs import given
from labkit.instructor.intake.submission import assemble
from labkit.instructor.sandbox import wire
from labkit.instructor.sandbox.channel import Channel
from labkit.instructor.sandbox.proxy import Notebook, Student
from labkit.instructor.sandbox.worker import Worker, failure
from labkit.notebook.read import cells_of
from labkit.notebook.usage import Usage


class Inside(Channel):
    """In the place of a channel: a worker in this process, reached by frames."""

    def __init__(self, sandbox=None, seconds=None):
        self.inner, self.came, self.ready, self.usage = Worker(), b"", True, Usage(os.getpid())

    def _send(self, data, limit):
        text, _ = wire.sizes(data[:8], objects=True)
        request = wire.unpack(data[8 : 8 + text], data[8 + text :], objects=True)
        try:
            answer = self.inner.answer(request)
        except Exception as error:
            answer = failure(error)
        self.came = wire.pack(answer)

    def _receive(self, count, limit):
        part, self.came = self.came[:count], self.came[count:]
        return part

    def end(self):
        pass


class Pupil(Student):
    """A student whose worker is in this process, however often it is made anew."""

    def load(self):
        self.channel = self.channel or Inside()
        super().load()


@cache
def room(lab):
    """(paper, names that the check cells start with, exam) of a lab."""
    sheet, names = paper.read(lab), {}
    exec(sheet.setup, names)
    return sheet, names, names["exam"]


def examine(lab, book, key="Ada", seed=1, only=None):
    """{check: None if passed, else what was raised} of a notebook, {check: "printed"} if it prints something else.

    only: the checks that are wanted, all that give points if None.
    """
    sheet, names, exam = room(lab)
    student, found = (
        Pupil(None, Notebook(assemble(sheet.released, cells_of(book)).cells, given(sheet)), sheet.subjects),
        {},
    )
    exam.student, exam.seed = key, seed
    for cell in (cell for cell in sheet.cells if cell.points is not None and (only is None or cell.id in only)):
        exam.current, said = cell.id, io.StringIO()
        try:
            exam.deal(cell.draws)
            used = {name: student.find(name) for name in cell.uses}
            with redirect_stdout(said):
                exec(cell.source, {**names, **used})
            found[cell.id] = None if said.getvalue() == cell.printed else "printed"
        except Exception as error:
            found[cell.id] = error
    return found
