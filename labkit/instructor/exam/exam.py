"""What an instructor's check cells use: the right answer, inputs drawn for each student, and comparison.

In the solution notebook the cells run on the solution itself; when a class is graded, the same cells run
on what stands for a student's objects, see `labkit.instructor.exam.kernel`.
"""

import zlib
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ... import checks
from ...checks import CheckError
from ...checks.compare import nearest
from ...checks.feedback import FilterError
from ...checks.trace import run
from ...geometry import Array
from ...history import START, History
from ...log import Log
from ...notebook.read import read
from ..authoring.spec import answers, build, definitions
from ..records import CommandError
from ..sandbox.channel import StudentCodeError
from ..sandbox.proxy import Stand, Student
from .beside import beside, found_or_raised
from .runs import Believable, Steps, apart, believable_calls, replayed, same_run
from .traces import answer_form, inputs, probes, run_of, traces
from .variants import variant

ROOT = Path(__file__).resolve().parents[3]
OTHERS = (
    "Your answer is right for the numbers of the notebook's own check, but not for other numbers of the same kind. "
    "Does it use a fixed number where it should use its arguments or fields?"
)
TRIES = 20  # of a draw, before it is said that none will do


class Exam:
    """What one lab asks; `seed`, `student` and `current`, the check's cell, decide what is drawn.

    lab: its name, '01_cartesian_ekf'. Raises CommandError if there is no solution of it.
    """

    def __init__(self, lab: str) -> None:
        if not (ROOT / "solutions" / f"{lab}.ipynb").is_file():
            raise CommandError(f"There is no solutions/{lab}.ipynb: grading needs the full kit, not the students' one.")
        self.lab, self.seed, self.student, self.current = lab, 0, "", ""
        self.place: int | None = None  # which of the draws that `labkit build` found good, None for the student's own
        self.keep: Callable[..., None] = lambda **arrays: None  # where the figure's data go
        self.definitions = [check for check in definitions(ROOT) if check.lab == lab]
        forms = [right.form for check in self.definitions for right in check.right if right.other]
        forms += [form for check in self.definitions for mistake in check.mistakes for form in mistake.forms]
        self._source = answers(read(ROOT / "solutions" / f"{lab}.ipynb"), forms)
        self._accepted: dict[str, list] = {}
        self._wrong: dict[str, dict[str, Any]] = {}
        self._last: tuple[list, Any] = [], None  # a run of a filter of this process: what was asked for, its History
        self.believable = Believable()
        self._judged: tuple[Any, Any] = None, None  # a log, and the one on which a filter was judged in its place

    def rng(self, draw: str = "") -> np.random.Generator:
        """A random generator of this student's for this check; the same each time it is asked for."""
        who, seed = (self.student, self.seed) if self.place is None else (f"place {self.place}", 0)
        words = [zlib.crc32(text.encode()) for text in (who, self.current, draw)]
        return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=words))

    def deal(self, good: Sequence[int]) -> None:
        """Choose this student's draw for this check among the good ones; if there is no list, it is drawn freely."""
        self.place = None
        self.place = int(self.rng("deal").choice(good)) if good else None

    def right(self, name: str) -> list:
        """The accepted forms of the answer `name`: the solution's own first."""
        if name not in self._accepted:
            others = [
                right.form
                for check in self.definitions
                if check.subject == name
                for right in check.right
                if right.other
            ]
            self._accepted[name] = [build(self._source, form, name) for form in [(), *others]]
        return self._accepted[name]

    def forms(self, names: Sequence[str]) -> dict[str, dict[str, Any]]:
        """{name: {'check: mistake 1': form}} of these answers: their known mistakes, in each of their forms."""
        found: dict[str, dict[str, tuple[str, Any]]] = {name: {} for name in names}  # checks have mistakes in common
        for check in (check for check in self.definitions if check.subject in names):
            for mistake in check.mistakes:
                for number, form in enumerate(mistake.forms, 1):
                    found[check.subject].setdefault(repr(form), (f"{check.name}: {mistake.id} {number}", form))
        return {name: dict(forms.values()) for name, forms in found.items()}

    def wrong(self, name: str) -> dict[str, Any]:
        """{'check: mistake 1': object}: the answer `name` in all known wrong forms."""
        if name not in self._wrong:
            forms = self.forms([name])[name].items()
            self._wrong[name] = {id: build(self._source, form, name) for id, form in forms}
        return self._wrong[name]

    def same(self, function: Callable | Stand, calls: Sequence, what: str = "other inputs", turns: Any = None) -> None:
        """Fail unless `function` gives what the solution gives for each of `calls`, tuples of arguments (float arrays).

        Results are numbers, arrays, texts or pairs of them;  turns: where in one (m,) an angle is, the same a turn on.
        """
        name = function.__name__
        values = function.map(calls) if isinstance(function, Stand) else [function(*call) for call in calls]
        for number, (came, call) in enumerate(zip(values, calls), 1):
            if min(apart(came, right(*call), turns) for right in self.right(name)) > 1:
                self.fail(f"`{name}` gives another result for {what} (call {number} of {len(calls)}).")

    def same_run(self, KF: type | Stand, record: Any, what: str = "on this run", **options: Any) -> History:
        """Fail unless the filter estimates what the solution's does over a whole log; returns its History.

        record: a Log of any lab;  options: what `labkit.make_filter` takes for it.
        """
        self._judged = record, record
        mine, right, gated = self._compared(KF, record, options)
        if gated:  # a gate of its own leaves out what is far off, so it is tried on a run where nothing is
            near = self.believable(self.right(KF.__name__)[0], record, options)
            self._judged = record, near
            mine, right, _ = self._compared(KF, near, options)
        if not right:
            self.fail(f"Your filter's estimate {what} differs from the right one.")  # where and how far would tell more
        return mine

    def _compared(self, KF, record, options):
        """(the History of a filter, whether it is right, whether it is not and may have a gate of its own)."""
        rights = self.right(KF.__name__)
        if isinstance(KF, Stand):  # the right filter runs while the student's does
            with ThreadPoolExecutor(1) as pool:
                asked = pool.submit(self.history, KF, record, **options)
                self._replayed(rights[0], record, options)
            mine = asked.result()
        else:
            mine = self.history(KF, record, **options)
        if same_run(mine, self._replayed(rights[0], record, options)):
            return mine, True, False
        return mine, *Steps(rights, record, options).judge(mine, record)

    def history(self, KF: type | Stand, record: Any, secret: bool = True, **options: Any) -> History:
        """The History of a student's (or the solution's) filter class over a log; as `same_run`."""
        if not isinstance(KF, Stand):
            return self._replayed(KF, self._judged[1] if record is self._judged[0] else record, options)
        mean = np.shape(np.atleast_1d(options.get("x0", START)))
        return run_of(KF.replay(record, options, secret), record.times, mean, self.fail)

    def _replayed(self, KF, record, options):
        """As `replayed`, but for the run that was asked for last, which is not run again."""
        asked = [KF, record, *options, *options.values()]
        if len(asked) != len(self._last[0]) or any(a is not b for a, b in zip(asked, self._last[0])):
            self._last = asked, replayed(KF, record, options)
        return self._last[1]

    def figure(self, KF: type | Stand, record: Log, **options: Any) -> None:
        """Keep the student's run over a log that all may know, for the picture on the feedback page."""
        if isinstance(KF, Stand):
            mine = self.history(KF, record, secret=False, **options)
            self.keep(
                times=record.times,
                x=mine.x[:, :2],
                P=mine.P[:, :2, :2],
                truth=np.asarray(record.truth)[:, :2],
                landmarks=record.map.positions,
            )

    def curve(
        self, function: Callable | Stand, calls: Sequence[Sequence], times: Array, bounds: Sequence[float], label: str
    ) -> None:
        """Keep a student's values (N,) along a run that all may know, for the picture on the feedback page.

        times (N,) [s];  bounds: between which the values should be;  label: of their axis.
        """
        if isinstance(function, Stand):
            values = [np.asarray(value, dtype=float) for value in function.map(calls, secret=False)]
            if all(value.shape == () for value in values):
                self.keep(x=times, values=np.array(values), bounds=np.asarray(bounds), label=np.array(label))

    def fail(self, sentence: str) -> NoReturn:
        """Give no points, for this reason, which must not tell the inputs: raises CheckError."""
        raise CheckError(self.current or "check", sentence)

    def check(self, name: str, subject: Any) -> None:
        """`labkit.check` of a student's object: the notebook's own inputs, then others of the same kind."""
        if not isinstance(subject, Stand):
            checks.check(name, subject)
            return
        data = checks.stored(name)
        passed, _ = self._judge(data, subject)
        self._judge_drawn(data, subject)
        print(checks.success(name, passed))

    def _judge(self, data, subject):
        public = self._public(subject.student)
        with beside(data["subject"], subject.student.notebook.cells, public):
            return checks.decide(data, found_or_raised(public[data["name"]]))

    def _public(self, student: Student) -> dict[str, Any]:
        """What the student's objects do on the inputs of all the notebook's own checks.

        Asked for at once, of a process that has seen nothing secret yet: what it says may be shown.
        """
        if student.public is None:
            if student.tainted:
                student.renew()
            found: dict[str, Any] = {}
            for check in self.definitions:
                try:
                    found[check.name] = self._seen(checks.stored(check.name), student.find(check.subject))
                except (FilterError, CheckError) as error:
                    if isinstance(error, StudentCodeError):
                        error.public = True
                    found[check.name] = error
            student.public = found
        return student.public

    def _seen(self, data, subject):
        """Traces of an object on a check's inputs, and of its probes if it is wrong."""
        seen = traces(data, subject.observe(inputs(data), answer_form(data), secret=False))
        if "probing" in data and checks.wrong(data, seen):
            asked = probes(data)
            seen |= traces(data, subject.observe(asked, answer_form(asked), secret=False))
        return seen

    def _judge_drawn(self, data, subject):
        """Known mistakes failed in `_judge` already, whatever is drawn: this is for answers that know its numbers."""
        others = {key: data[key] for key in ("name", "subject", "kind")}
        others |= {"scenarios": [self._drawn(data, s) for s in data["scenarios"] if "advice" not in s]}
        try:
            came = traces(others, subject.observe(inputs(others), answer_form(others), secret=True))
        except CheckError:
            self.fail(OTHERS)  # in our words: it has seen inputs that its student has not
        wrong = [s for s in others["scenarios"] if nearest(came[s["id"]], s["right"])[0] > 1]
        if wrong:
            self.fail(OTHERS)

    def _drawn(self, data, stored):
        """A variant of a stored scenario, with what is right in it; drawn again where all that is right stops."""
        for again in range(TRIES):
            fresh = variant(stored, self.rng(f"{stored['id']} {again}" if again else stored["id"]))
            fresh = believable_calls(self.right(data["subject"])[0], fresh)
            runs = [run(right, data["kind"], fresh) for right in self.right(data["subject"])]
            if right := [[trace.steps, None] for trace in runs if not trace.stop]:
                return {**fresh, "right": right}
        raise CommandError(
            f"The solution stops in {TRIES} variants of '{stored['id']}' in the check '{data['name']}': give that "
            "scenario, in solutions/checks, numbers that may be a little different."
        )
