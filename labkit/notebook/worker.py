"""The child process of `labkit check`: runs one notebook's checks, one JSON line of news each."""

import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .limits import CALL
from .read import NotebookError, read
from .rehearse import Rehearsal, checks_of, given, subjects
from .session import Session
from .shell import alone
from .source import WRITE


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
    _rehearse(path, Session(cells), tell, done, slow, seconds)
    tell(kind="end")
    os._exit(0)  # threads that a student started must not keep us


def _rehearse(path, session, tell, done, slow, seconds):
    checks = checks_of(path, session.calls)
    tell(kind="checks", names=list(checks), missing=[check for check in checks if not checks[check]])
    for label in session.retyped:
        tell(
            kind="problem", where=label, lines=["It is a text cell that holds code: turn it back into a code cell (Y)."]
        )
    session.supply(given(checks))
    tell(kind="begin", check="", seconds=CALL)
    for problem in session.run(subjects(checks)):
        tell(kind="problem", where=problem.where, lines=problem.lines)
    written = {step.node.value.args[0].value for step in session.steps if WRITE in step.names.uses}
    tell(kind="beside", names=[name for name in _beside() if name not in written])
    rehearsal = Rehearsal(session, set(slow), until=seconds)
    for check in checks:
        if check not in done:
            tell(kind="begin", check=check, seconds=CALL)
            lines = rehearsal.judge(check)
            tell(kind="verdict", check=check, lines=lines, slow=sorted(rehearsal.slow))


def _beside():
    """The files beside the notebook that its code has imported."""
    here = os.getcwd() + os.sep
    paths = [getattr(module, "__file__", None) or "" for module in list(sys.modules.values())]
    return sorted(path.removeprefix(here) for path in paths if path.startswith(here) and "site-packages" not in path)
