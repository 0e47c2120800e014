"""A check cell tried on known mistakes: which of them does what it drew show?"""

import copy
import io
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout
from typing import Any

import numpy as np

from ...checks.compare import TINY, TOLERANCE, gap_of
from ...history import History, make_filter, replay
from .exam import Exam
from .runs import Steps, apart, replayed


def caught(exam: Exam, source: str, names: Mapping[str, Any], uses: Sequence[str]) -> set[str]:
    """Which known mistakes fail in a check cell, with what it draws now, by their names in `Exam.wrong`.

    source: the cell's;  names: those that it runs with;  uses: the answers in it.
    """
    found = set()
    rights = {name: exam.right(name)[0] for name in uses}
    for subject in uses:
        wrong = exam.wrong(subject)
        panel = _Panel(subject, wrong)
        if not wrong:
            continue
        if not _fails(source, {**names, **rights, "exam": _Trial(exam), subject: panel}):
            found |= panel.caught
        else:  # it looks at answers in a way of its own
            found |= {id for id, form in wrong.items() if _fails(source, {**names, **rights, subject: form})}
    return found


def _fails(source, names):
    with redirect_stdout(io.StringIO()), np.errstate(all="ignore"):
        try:
            exec(source, names)
        except Exception:
            return True
    return False


class _Panel:
    """All wrong forms of one answer, in its place, so that what a cell draws is drawn once for all of them."""

    def __init__(self, name, wrong):
        self.__name__, self.wrong, self.caught = name, wrong, set()

    def try_out(self, fails: Callable[[Any], bool]) -> None:
        """Note for which of them `fails` is true, or stops."""
        for id in self.wrong.keys() - self.caught:
            try:
                failed = fails(self.wrong[id])
            except (Exception, _Differs):
                failed = True
            self.caught |= {id} if failed else set()


class _Trial(Exam):
    """An exam that sees what becomes of a panel, and fails nobody."""

    def __init__(self, exam):
        self.__dict__.update(exam.__dict__)

    def same(
        self, function: Any, calls: Sequence[Sequence], what: str = "other inputs", turns: int | None = None
    ) -> None:
        due = [[right(*call) for right in self.right(function.__name__)] for call in copy.deepcopy(calls)]

        def fails(wrong):
            values = [wrong(*call) for call in copy.deepcopy(calls)]
            return any(min(apart(came, one, turns) for one in rights) > 1 for came, rights in zip(values, due))

        function.try_out(fails)

    def same_run(self, KF: Any, record: Any, what: str = "on this run", **options: Any) -> History:
        forms = self.right(KF.__name__)

        def follow(wrong, log):
            right, steps = self._replayed(forms[0], log, options), Steps(forms, log, options)
            replay(_Hasty(make_filter(wrong, log, **options), right, steps, log.fields), log)

        def fails(wrong):
            try:
                follow(wrong, record)
            except _MayBeGate:
                follow(wrong, self.believable(forms[0], record, options))
            return False  # it did not stop: it fits

        KF.try_out(fails)
        return replayed(forms[0], record, options)


class _Differs(BaseException):
    """Nothing that `replay` should explain, which takes longer than some steps of a filter."""


class _MayBeGate(_Differs):
    """It differs where something is far off, which a gate of its own may have left out."""


class _Hasty:
    """A filter that stops as soon as it cannot be right any more, which for most mistakes is soon."""

    def __init__(self, kf, right, steps, fields):
        self._kf, self._right, self._steps, self._fields = kf, right, steps, fields
        self._ends, self._given, self._checked, self._same = [], [], 0, True
        self._compare()

    def __getattr__(self, name):
        return getattr(self._kf, name)

    def predict(self, u):
        """Predict, and note what was given."""
        self._kf.predict(u)
        self._given.append([u])

    def update(self, y):
        """Update, and compare as `same_run` does with what is right; raises _Differs where nothing fits."""
        self._kf.update(y)
        self._given[-1].append(y)
        self._compare()

    def _compare(self):
        self._ends.append([np.array(getattr(self._kf, field), dtype=float) for field in self._fields])
        self._same = self._same and self._fits(*self._ends[-1], self._right)
        if self._same:
            return
        if not self._checked and not self._steps.starts(*self._ends[0]):
            raise _Differs
        while self._checked < len(self._given):
            k = self._checked
            if not self._steps.follows(self._ends[k], *self._given[k], self._ends[k + 1]):
                raise _MayBeGate if self._steps.is_far(self._ends[k], *self._given[k]) else _Differs
            self._checked += 1

    def _fits(self, x, P, right):
        limit, step = TOLERANCE * np.abs(right.x).max() + TINY, len(self._given)
        return gap_of(P, right.P[step]) <= 1 and np.abs(x - right.x[step]).max() <= limit
