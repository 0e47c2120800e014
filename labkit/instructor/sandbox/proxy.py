"""The trusted side of a worker.

`Student` holds one student's worker; `Stand` and `StandFilter` look like the student's own function, class
and filter to an instructor's check cell.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from ...checks import Data
from ...checks.feedback import FilterError
from ...notebook.limits import CALL, PATIENCE
from .channel import Channel, NotGradedError, StudentCodeError, WorkerLostError
from .forms import Form, array, fields, flag, result, several, table, text, whole
from .launch import Sandbox

TOTAL = 60.0  # seconds of the processor for all calls of one student
VALUE = fields(value=result)
PROBLEM = fields(place=text(80), lines=several(text(300), 0, 3))
HISTORY = fields(x=array, P=array, x_prior=array, P_prior=array)
MOST = 10  # problems that a worker tells
USED_UP = "This check was left out: your code had used up its time in the checks before it."


class Student:
    """One student's code in its worker, started anew when it is lost.

    notebook: what `do_load` runs;  wanted: the names that the checks ask for;  spare: a worker that waits already;
    call, total: seconds of the processor for one call, and for all.
    """

    def __init__(
        self,
        sandbox: Sandbox,
        notebook: "Notebook",
        wanted: Sequence[str],
        spare: Channel | None = None,
        call: float = CALL,
        total: float = TOTAL,
    ) -> None:
        self.sandbox, self.notebook, self.wanted = sandbox, notebook, wanted
        self.call, self.total, self.left = call, total, float(total)
        self.slow: set[str] = set()  # objects that used up the time of a call once
        self.stopped = 0  # how often time was up, or somebody else may have ended the worker
        self.cut = False  # whether the notebook's cells ran into a limit, so that something may be missing
        self.channel = spare
        self.kinds: dict[str, Any] = {}
        self.problems: list[dict] = []
        self.loaded, self.why_lost = False, ""
        self.tainted = False  # whether this process has seen what its student must not
        self.parts: dict[str, tuple[list[str], bool]] = {}  # of wrong filters: the right ones, and whether that is sure
        self.public: dict[str, Any] | None = None  # what it said before, on inputs that its student knows

    def load(self) -> None:
        """Run the student's cells in a fresh worker. Raises WorkerLostError."""
        if self.loaded:
            return
        if self.why_lost:
            raise WorkerLostError(self.why_lost)
        self._spare_time()
        self._start()
        self.tainted = False
        form = load_form(self.wanted)
        try:
            answer = self._timed({"do": "load", **asdict(self.notebook), "wanted": self.wanted}, form)
        except NotGradedError:
            self._drop()
            raise
        except FilterError as error:
            self.cut = getattr(error, "stopped", False) or getattr(error, "killed", False)
            self.why_lost = f"Your notebook could not be loaded. {error}"
            self._drop()
            raise WorkerLostError(self.why_lost) from None
        self.cut, self.kinds, self.problems = answer["stopped"], answer["kinds"], answer["problems"]
        self.loaded = True

    def _start(self):
        """Have a worker that is ready; one that the machine has ended while it waited is replaced."""
        try:
            self.channel = self.channel or Channel(self.sandbox, self.total)
            self.channel.settle()
        except NotGradedError:
            self._drop()
            self.channel = Channel(self.sandbox, self.total)
            self.channel.settle()

    def ask(self, about: str, form: Form, secret: bool = False, **request: Any) -> dict[str, Any]:
        """The answer to a request, in its form. Raises FilterError, NotGradedError.

        about: the student's object that it is about;  secret: whether it holds what the student must not see.
        """
        self._spare_time()
        self.load()
        self.tainted = self.tainted or secret
        try:
            return self._timed(request, form, about)
        except (WorkerLostError, NotGradedError):
            self._drop()
            raise

    def renew(self) -> None:
        """Forget the process, so that the next request goes to one that has seen nothing."""
        self._drop()

    def _spare_time(self):
        if self.left <= 0:
            self.stopped += 1
            raise WorkerLostError(USED_UP, stopped=True)

    def _timed(self, request, form, about=""):
        before = self.channel.usage.look()
        allowed = min(self.call, PATIENCE if about in self.slow else self.call, max(self.left, 0.1))
        stopped = False
        try:
            answer = self.channel.ask(request, allowed, form)
            stopped = answer.get("stopped") is True
            return answer
        except (WorkerLostError, StudentCodeError) as error:
            stopped = error.stopped
            self.stopped += getattr(error, "killed", False)
            raise
        finally:
            self.left -= self.channel.usage.look() - before
            if stopped:
                self.stopped += 1
                self.slow |= {about}

    def _drop(self):
        if self.channel:
            self.channel.end()
        self.channel, self.loaded = None, False

    def end(self) -> None:
        """Be rid of its worker."""
        self._drop()

    def find(self, name: str) -> "Stand":
        """What stands for the student's object of that name in a check cell. Raises MissingAnswerError."""
        self.load()
        if name not in self.kinds:
            raise MissingAnswerError(name, self.problems)
        return Stand(self, name)


@dataclass(frozen=True)
class Notebook:
    """What is run of a student's. cells: their own, as dictionaries;  given: those of the lab as it was handed out;
    files: {path: base64} of what lies beside the notebook.
    """

    cells: Sequence[dict[str, Any]]
    given: Sequence[dict[str, Any]] = ()
    files: Mapping[str, str] = field(default_factory=dict)


def load_form(wanted: Sequence[str]) -> Form:
    """What the answer to a notebook may be, of which these names are wanted."""
    return fields(kinds=table(text(80), wanted), problems=several(PROBLEM, 0, MOST), stopped=flag)


class MissingAnswerError(WorkerLostError):
    """The student's notebook has run, but a name that is to be checked is not there."""

    def __init__(self, name: str, problems: Sequence[dict]) -> None:
        super().__init__(f"`{name}` is not there after your notebook has run.")
        self.lines_of_problems = []
        for problem in problems[:3]:
            self.lines_of_problems += [f"{problem['place']}: {line}" for line in problem["lines"]]


class Stand:
    """Looks like the student's function or class. `secret`: whether the inputs must not reach the student."""

    def __init__(self, student: Student, name: str) -> None:
        self.student, self.__name__ = student, name

    def __call__(self, *args: Any, **options: Any) -> Any:
        """What the student's function gives, or what stands for an object of the class."""
        request = {"name": self.__name__, "args": list(args), "options": options}
        if self.student.kinds.get(self.__name__) != "type":
            return self.student.ask(self.__name__, VALUE, do="call", secret=True, **request)["value"]
        made = self.student.ask(self.__name__, fields(made=whole), do="make", secret=True, **request)["made"]
        return StandFilter(self.student, self.__name__, made)

    def map(self, calls: Sequence[Sequence], secret: bool = True) -> list:
        """The results of several calls, each a tuple of arguments, in one request. Raises FilterError."""
        request = {"name": self.__name__, "calls": [list(args) for args in calls]}
        form = fields(values=several(result, len(calls), len(calls)))
        return self.student.ask(self.__name__, form, do="map", secret=secret, **request)["values"]

    def replay(self, record: Any, options: dict[str, Any], secret: bool = True) -> dict[str, Any]:
        """{x, P, x_prior, P_prior} of the student's filter over a whole log, in one call; no truth goes along.

        options: of `labkit.make_filter`.
        """
        request = {"name": self.__name__, "record": record, "options": options}
        return self.student.ask(self.__name__, HISTORY, do="replay", secret=secret, **request)

    def observe(self, data: Data, form: Form, secret: bool) -> dict[str, Any]:
        """The answer of `do_observe`, in its form: what the object does on a check's inputs."""
        return self.student.ask(self.__name__, form, do="observe", secret=secret, name=self.__name__, data=data)


class StandFilter:
    """Looks like one object of the student's class."""

    def __init__(self, student: Student, name: str, made: Any) -> None:
        object.__setattr__(self, "_student", student)
        object.__setattr__(self, "_name", name)
        object.__setattr__(self, "_made", made)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        if name in ("predict", "update"):
            return lambda *args, **options: self._method(name, args, options)
        try:
            return self._student.ask(self._name, VALUE, do="get", made=self._made, name=name)["value"]
        except StudentCodeError as error:
            if error.kind == "AttributeError":  # so that getattr can fall back on a default, as for a filter's own
                raise AttributeError(str(error)) from error
            raise

    def _method(self, name, args, options):
        sent = {"made": self._made, "method": name, "args": list(args), "options": options}
        return self._student.ask(self._name, VALUE, do="method", secret=True, **sent)["value"]
