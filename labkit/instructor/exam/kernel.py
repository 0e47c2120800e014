"""What runs in the trusted kernel: it puts one student after the other in front of the check cells.

The check notebook (see `labkit.instructor.exam.batch`) calls `begin` at the head of each check cell; what came
of the cell is written to a file, a line for each, for the recorder that sits in pytest.
"""

import builtins
import json
from base64 import b64decode
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...checks import CheckError
from ...checks.feedback import FilterError
from ...notebook import variant
from .. import records
from ..sandbox.channel import Channel, NotGradedError, StudentCodeError, WorkerLostError
from ..sandbox.forms import TEXT
from ..sandbox.launch import Sandbox
from ..sandbox.proxy import MissingAnswerError, Notebook, Student

if TYPE_CHECKING:  # it loads while the first worker starts
    from .exam import Exam

FILE = "said.jsonl"
UNCLEAR = "What your code gave back could not be used here."
ODD = ArithmeticError, AssertionError, AttributeError, LookupError, TypeError, ValueError  # what odd numbers can raise


class Batch:
    """The students whom this kernel marks. folder: where batch.json is, and where the results go;  shell: IPython's."""

    exam: "Exam"

    def __init__(self, folder: str | Path, shell: Any) -> None:
        self.folder = Path(folder)
        batch = json.loads((self.folder / "batch.json").read_text(encoding="utf-8"))
        self.students, self.checks = batch["students"], {c["id"]: c for c in batch["checks"]}
        self.subjects, self.given, self.time = batch["subjects"], batch["given"], batch["time"]
        self.sandbox = Sandbox(**batch["sandbox"])
        self.number: int | None = None  # of the student whose turn it is
        self.work: dict[str, Any] = {}  # what is run of this student's
        self.student: Student | None = None
        self.spare: Channel | None = Channel(self.sandbox, self.time["total"])  # it imports while this kernel does
        self.check: str | None = None  # the cell that runs
        self.stopped = 0  # how often the student's time was up before it
        self.seed, self.events = batch["seed"], shell.events

    def hold(self, exam: "Exam") -> None:
        """Begin with this exam, which draws by the batch's seed and tells its figures here."""
        self.exam, exam.seed, exam.keep = exam, self.seed, self.keep
        self.events.register("post_run_cell", self._ran)

    def begin(self, number: int, check: str, names: dict[str, Any]) -> None:
        """Make `names` (the cell's globals) hold this student's objects; check: the cell's grade_id."""
        self.check = None  # nothing is told of a cell that did not begin
        student = self.student if number == self.number and self.student else self._next(number)
        self.exam.student, self.exam.current = self.students[number]["key"], check
        self.exam.deal(self.checks[check]["draws"])
        self.check, self.stopped = check, student.stopped
        for name in self.subjects:
            names.pop(name, None)
        wanted = self.checks[check]["uses"]
        names.update({name: student.find(name) for name in wanted})

    def _next(self, number):
        if self.student:
            self.student.end()
        self.number, self.work = number, json.loads(Path(self.students[number]["work"]).read_text(encoding="utf-8"))
        own = self.work["files"].get(variant.FILE)
        variant.tell(own and b64decode(own).decode())  # for what the check cells draw as the student's notebook did
        notebook = Notebook(self.work["cells"], self.given, self.work["files"])
        self.student = Student(self.sandbox, notebook, self.subjects, self.spare, **self.time)
        # The next student's worker imports what it needs while this one is graded.
        self.spare = Channel(self.sandbox, self.time["total"]) if number + 1 < len(self.students) else None
        return self.student

    def keep(self, **arrays: Any) -> None:
        """Store the data of the student's figure."""
        np.savez(self.folder / f"figure-{self.number}.npz", **arrays)

    def _ran(self, result):
        if self.check is None:
            return
        error = result.error_before_exec or result.error_in_exec
        told = self._told(error) if error else {"status": records.PASSED}
        if told["status"] == records.FAILED and self.checks[self.check]["parts"]:
            told |= self._right_parts()
        with open(self.folder / FILE, "a", encoding="utf-8") as file:
            about = {"number": self.number, "check": self.check, "again": self._unsure(error, told["status"])}
            file.write(json.dumps({**about, **told}) + "\n")
        self.check = None

    def _right_parts(self):
        """What of a filter that failed is right; where the machine cannot find out, the mark waits."""
        from .parts import of_student  # right answers need it not

        try:
            return {"parts": of_student(self.exam, self.student.find(self.checks[self.check]["divided"]))}
        except (*ODD, FilterError):
            return {}
        except (NotGradedError, records.CommandError) as error:
            return {"status": records.ERROR, "reason": f"This was not graded: {error}"[:TEXT], "lines": []}

    def _unsure(self, error, status):
        """Whether it may come out otherwise once more: what took too long, or was not the student's doing."""
        if status == records.ERROR or isinstance(error, ODD):
            return True
        cut = self.student is not None and (self.student.cut or self.student.stopped > self.stopped)
        return cut or getattr(error, "stopped", False) or getattr(error, "killed", False)

    def _told(self, error):
        """What an exception of a check cell means to the student."""
        hidden = self.checks[self.check]["hidden"]
        if isinstance(error, CheckError):
            shown = {"lines": error.details, "mistake": error.mistake} if not hidden else {}
            return {"status": records.FAILED, "reason": error.summary, **shown}
        if isinstance(error, MissingAnswerError):
            return {"status": records.NOT_RUN, "reason": str(error), "lines": error.lines_of_problems}
        if isinstance(error, StudentCodeError):
            return {"status": records.FAILED, **self._raised(error, hidden or not error.public)}
        if isinstance(error, WorkerLostError):
            return {"status": records.FAILED, "reason": str(error)}
        if isinstance(error, FilterError):
            return {"status": records.FAILED, "reason": str(error)}
        if isinstance(error, ODD):
            # The check runs on the solution, so it is the student's result that it cannot digest.
            return {"status": records.FAILED, "reason": UNCLEAR}
        kind = "" if isinstance(error, NotGradedError | records.CommandError) else f"{type(error).__name__}: "
        return {"status": records.ERROR, "reason": f"This was not graded: {kind}{error}"[:TEXT]}

    def _raised(self, error, secret):
        """Reason and lines for an exception of the student's; when secret, nothing in their own words."""
        if not secret:
            first, *rest = error.args[0].splitlines() or [f"Your code stopped with a {error.kind} that says nothing."]
            return {"reason": first, "lines": rest}
        if error.kind == "FilterError":
            return {"reason": "After some step your filter's estimate is not a number any more (NaN or infinite)."}
        known = error.kind == "LinAlgError" or isinstance(getattr(builtins, error.kind, None), type)
        kind = error.kind if known else "problem of its own"  # a name that they chose could tell something
        reason = f"Your code stopped here with a{'n' * (kind[0] in 'AEIOU')} {kind}."
        if error.stopped:
            reason = "Your code was still running when it was stopped."
        if error.place is None:
            return {"reason": reason}
        label, line = error.place
        source = self.work["sources"].get(label, "").splitlines()
        if 0 < line <= len(source):
            reason = f"{reason[:-1]}, in {label}, line {line}:  {source[line - 1].strip()[:200]}"
        return {"reason": reason}

    def end(self) -> None:
        """Let go of all workers."""
        for worker in (self.student, self.spare):
            if worker:
                worker.end()
        self.student = self.spare = None
