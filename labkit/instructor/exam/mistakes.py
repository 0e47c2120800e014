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
from .runs import apart, replayed


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

    def same(self, function: Any, calls: Sequence[Sequence], what: str = "other inputs") -> None:
        due = [[right(*call) for right in self.right(function.__name__)] for call in copy.deepcopy(calls)]

        def fails(wrong):
            values = [wrong(*call) for call in copy.deepcopy(calls)]
            return any(min(apart(came, one) for one in rights) > 1 for came, rights in zip(values, due))

        function.try_out(fails)

    def same_run(self, KF: Any, record: Any, what: str = "on this run", **options: Any) -> History:
        rights = [replayed(right, record, options) for right in self.right(KF.__name__)]

        def fails(wrong):
            replay(_Hasty(make_filter(wrong, record, **options), rights, record.fields), record)
            return False  # it did not stop: it fits

        KF.try_out(fails)
        return rights[0]


class _Differs(BaseException):
    """Nothing that `replay` should explain, which takes longer than some steps of a filter."""


class _Hasty:
    """A filter that stops as soon as it cannot be right any more, which for most mistakes is soon."""

    def __init__(self, kf, rights, fields):
        self._kf, self._left, self._fields, self._step = kf, list(rights), fields, 0
        self._compare()

    def __getattr__(self, name):
        return getattr(self._kf, name)

    def update(self, y):
        """Update, and compare as `same_run` does with what is right; raises _Differs where nothing fits."""
        self._kf.update(y)
        self._step += 1
        self._compare()

    def _compare(self):
        x, P = (np.asarray(getattr(self._kf, field), dtype=float) for field in self._fields)
        self._left = [right for right in self._left if self._fits(x, P, right)]
        if not self._left:
            raise _Differs

    def _fits(self, x, P, right):
        limit = TOLERANCE * np.abs(right.x).max() + TINY
        return gap_of(P, right.P[self._step]) <= 1 and np.abs(x - right.x[self._step]).max() <= limit
