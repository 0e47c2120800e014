"""The child process of `labkit check`: runs one notebook's checks, one JSON line of news each."""

import json
import os
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ..checks.feedback import running_line
from .limits import CALL, still_running
from .read import NotebookError, read
from .rehearse import Rehearsal, checks_of, subjects
from .session import ALL, Session
from .shell import alone

STUCK = 2.0  # seconds of the processor beyond the limit after which a library does not come back


def main(path: str, seconds: float, done: Sequence[str], slow: Sequence[str]) -> None:
    """Report on the notebook at `path`, with `seconds` of the processor for all that it does.

    done: checks that need not run any more;  slow: answers that used up their time in one of them.
    """
    news = os.fdopen(os.dup(1), "w", encoding="utf-8")  # what the student prints goes nowhere
    silent = os.open(os.devnull, os.O_RDWR)
    for fd in (0, 1, 2):
        os.dup2(silent, fd)

    def tell(**item: Any) -> None:
        news.write(json.dumps(item) + "\n")
        news.flush()

    alone()
    try:
        cells = read(path)
    except NotebookError as error:
        return tell(kind="unreadable", text=str(error))
    os.chdir(Path(path).resolve().parent)
    sys.path.insert(0, os.getcwd())
    _rehearse(path, Session(cells), Watch(seconds, tell), done, slow)
    tell(kind="end")
    os._exit(0)  # threads that a student started must not keep us


def _rehearse(path, session, watch, done, slow):
    checks = checks_of(path, session.calls)
    watch.tell(kind="checks", names=list(checks), missing=[check for check in checks if not checks[check]])
    watch.begin("", ALL)
    for problem in session.run(subjects(checks)):
        watch.tell(kind="problem", where=problem.where, lines=problem.lines)
    watch.tell(kind="beside", names=_beside())
    rehearsal = Rehearsal(session, set(slow))
    for check in checks:
        if check not in done:
            watch.begin(check, CALL)
            lines = rehearsal.judge(check)
            watch.tell(kind="verdict", check=check, lines=lines, slow=sorted(rehearsal.slow))


def _beside():
    """The files beside the notebook that its code has imported."""
    here = os.getcwd() + os.sep
    paths = [getattr(module, "__file__", None) or "" for module in list(sys.modules.values())]
    return sorted(path.removeprefix(here) for path in paths if path.startswith(here) and "site-packages" not in path)


class Watch:
    """Ends the process where a library computes without end, or where all time is used up, and says what ran."""

    def __init__(self, seconds: float, tell: Callable[..., None]) -> None:
        self.tell, self.seconds, self.check, self.stop = tell, seconds, "", seconds
        self.thread = threading.get_ident()
        threading.Thread(target=self._look, daemon=True).start()

    def begin(self, check: str, seconds: float) -> None:
        """From now on `check` (or, if '', the notebook's cells) runs."""
        self.tell(kind="begin", check=check)
        self.check, self.stop = check, min(time.process_time() + seconds + STUCK, self.seconds)

    def _look(self):
        while time.process_time() < self.stop:
            threading.Event().wait(0.1)
        lines = [still_running(CALL if self.stop < self.seconds else self.seconds)]
        lines.append(running_line(sys._current_frames()[self.thread]))
        self.tell(kind="verdict", check=self.check, lines=lines, slow=[])
        os._exit(0)
