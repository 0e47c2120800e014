"""Grade one submission as `labkit grade` does, for a grader that brings them one by one."""

import contextlib
import shutil
import zlib
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

from ...notebook.limits import CALL
from .. import command, records
from ..exam.paper import read
from ..folders import temporary
from ..intake.collect import Submissions
from ..records import CommandError, Mark, Result
from ..report.gradebook import Gradebook
from ..report.texts import final, readable
from ..sandbox.proxy import TOTAL
from ..trouble import why
from . import ALLOWED

# The other options of `labkit grade`: late days and attempts are the other side's affair.
PLAIN = dict.fromkeys(("attempts", "due", "late", "regrade", "moodle", "canvas", "scheduler", "level"))
PLAIN |= {"jobs": 1, "call": CALL, "total": TOTAL}
NAME = "hand-in"  # of the folder that is graded: what the other side calls its student is nothing that we read


def graded(lab: str, folder: Path, student: str, seed: int, allowed: Sequence[str] = ()) -> Result:
    """The Result of what one student handed in.

    folder: what was handed in;  student: by whatever name, which with the seed decides what is drawn;
    allowed: of ALLOWED. Raises CommandError if it cannot be graded through no fault of the student; what cannot be
    read is the Result's problem.
    """
    paper = read(lab)
    if not folder.is_dir():
        raise CommandError(f"{folder} is no folder: there is nothing to grade.")
    with temporary("export") as place, contextlib.ExitStack() as stack:
        try:  # links are copied as links, which whoever reads the class looks at with suspicion
            shutil.copytree(folder, Path(place, "class", NAME), symlinks=True)
        except OSError as error:
            raise CommandError(f"{folder} cannot be copied: {why(error)}.") from None
        if problem := _unfit(Path(place, "class"), lab):
            return Result(student, lab=lab, problem=problem)
        drawn = zlib.crc32(student.encode("utf-8", "replace"), seed)
        book = stack.enter_context(contextlib.closing(Gradebook(Path(place, "gradebook.db"), drawn)))
        book.set_paper(lab, paper.digest, paper.checks)
        command.fill(book, paper, Namespace(submissions=Path(place, "class"), **PLAIN, **_given(allowed)))
        (result,) = book.results(lab)
    if result.ungraded:
        said = next((mark.reason for mark in result.marks if mark.status == records.ERROR), "")
        raise CommandError(f"{lab}: some checks could not be run, through no fault of the student. {said}".strip())
    return result


def _unfit(folder, lab):
    """Why there is no notebook of the lab in a folder, as its student is told; '' if there is one."""
    try:
        with Submissions(folder) as submissions:
            entries, unfits, _ = submissions.survey(lab)
    except CommandError:
        return f"There is no notebook in what you handed in: hand in {lab}.ipynb."
    return "" if entries else unfits[0].reason


def _given(allowed):
    if odd := [name for name in allowed if name not in ALLOWED]:
        raise CommandError(f"{odd[0]!r} cannot be allowed: known are {', '.join(ALLOWED)}.")
    return {name: name in allowed for name in ALLOWED}


def told(mark: Mark) -> str:
    """What a student is told of a mark, as lines of text; '' where there is nothing to say."""
    lines = [*dict.fromkeys((final(mark.reason), mark.mistake)), *mark.lines]  # a known mistake may be the reason
    if mark.parts:
        lines += ["Right all the same:", *(f"- {records.PARTS[part]}" for part in mark.parts)]
    return readable("\n".join(line for line in lines if line))
