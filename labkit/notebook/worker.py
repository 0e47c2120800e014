"""The child process of `labkit check`: runs one notebook's checks, one JSON line of news each."""

import json
import os
import sys
import threading
from pathlib import Path

from ..checks.feedback import running_line
from .read import NotebookError, read
from .session import Session


def main(path: str, seconds: float) -> None:
    """Report on the notebook at `path`; after `seconds` say where it hangs, and end."""
    news = os.fdopen(os.dup(1), "w", encoding="utf-8")  # what the student prints goes nowhere
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    os.dup2(silent, 2)

    def tell(**item):
        news.write(json.dumps(item) + "\n")
        news.flush()

    try:
        cells = read(path)
    except NotebookError as error:
        return tell(kind="unreadable", text=str(error))
    os.chdir(Path(path).resolve().parent)
    sys.path.insert(0, os.getcwd())
    session = Session(cells)
    checks = [step.check for step in session.steps if step.check]
    tell(kind="checks", names=checks)
    if checks:
        watchdog = threading.Timer(seconds, _give_up, [threading.main_thread().ident, session, seconds, tell])
        watchdog.daemon = True
        watchdog.start()
        for event in session.run():
            tell(kind="event", check=event.check, where=event.where, passed=not event.error, lines=event.lines)
    tell(kind="end")
    os._exit(0)  # threads that a student started must not keep us


def _give_up(thread, session, seconds, tell):
    step = session.current
    lines = [f"It was still running after {seconds:g} s: does a loop never end?"]
    lines.append(running_line(sys._current_frames()[thread]))
    tell(kind="event", check=step.check, where=step.cell.label, passed=False, lines=lines)
    tell(kind="end")
    os._exit(0)
