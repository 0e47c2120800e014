"""Fetch an answer from the notebook of an earlier lab."""

import _thread
import re
import sys
import threading
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

from ..checks.feedback import LabError
from .read import read

SECONDS = 10  # for the check of a loaded answer


class EarlierLabError(LabError):
    """The answer of an earlier lab that this one builds on is not there yet."""


def load_answer(lab: str, name: str, folder: Path | str | None = None) -> Any:
    """The object `name` (say, the class KF) from the answer cells of `<lab>.ipynb`, as it was last saved.

    Looks in `folder`, by default the current one, which is the notebook's own. Prints a note if the
    answer does not pass its check, and nothing otherwise.
    """
    from .session import Session

    path = Path(folder or ".") / f"{lab}.ipynb"
    first = f"Fill in `{name}` in {_lab(lab)} first"
    again = "save it (Ctrl+S), and run this cell again"
    if not path.exists():
        where = f"{path.name} is not in the folder {path.resolve().parent}"
        raise EarlierLabError(f"{first}: {where}. Put it there, {again}.")
    shown = _figures()
    cells = read(path)
    with redirect_stdout(StringIO()):
        session = Session([cell for cell in cells if cell.role != "check"], place=f"{lab}, ", wanted=[name])
        problems = [event for event in session.run() if event.error]
    for number in _figures() - shown:
        sys.modules["matplotlib.pyplot"].close(number)
    if name not in session.names:
        reasons = [line for event in problems for line in event.lines]
        raise EarlierLabError("\n".join([f"{first} ({path.name}), {again}.", *reasons]))
    problem = _unfinished(cells, name, session.names[name])
    if problem:
        end = "" if problem.endswith((".", "?")) else "."
        print(f"Your `{name}` from {_lab(lab)} does not pass its check yet: {problem}{end}")
        print(f"Finish it there, {again}.")
    return session.names[name]


def _unfinished(cells, name, answer):
    """What the check of an answer says that does not pass, in a sentence; '' if it does or has no check."""
    from ..checks import CheckError, judge, stored

    call = re.compile(rf"""^check\(\s*["']([\w-]+)["'],\s*{name}\s*\)""", re.MULTILINE)
    found = [match[1] for cell in cells if cell.role == "check" for match in call.finditer(cell.source)]
    timer = threading.Timer(SECONDS, _thread.interrupt_main)
    timer.daemon = True
    try:
        timer.start()
        for check in found:
            judge(stored(check), answer)
    except CheckError as error:
        return error.summary
    finally:
        timer.cancel()
    return ""


def _figures():
    pyplot = sys.modules.get("matplotlib.pyplot")
    return set(pyplot.get_fignums()) if pyplot else set()


def _lab(lab):
    number = re.match(r"\d+", lab)
    return f"lab {int(number[0])}" if number else lab
