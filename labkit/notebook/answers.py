"""Fetch an answer from the notebook of an earlier lab."""

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

from ..checks.feedback import LabError
from .read import Cell, read


class EarlierLabError(LabError):
    """The answer of an earlier lab that this one builds on is not there yet."""


def load_answer(lab: str, name: str, folder: Path | str | None = None) -> Any:
    """The object `name` (say, the class KF) that the notebook `<lab>.ipynb` leaves, as it was last saved.

    Looks in `folder`, by default the current one, which is the notebook's own. Where the notebook is not there, as in
    Colab, `<lab>.py` will do, into which a cell has written the answer. Prints a note if the answer does not pass its
    check, and nothing otherwise.
    """
    from .rehearse import Rehearsal, checks_of, given, subjects
    from .session import Session

    path = Path(folder or ".").absolute() / f"{lab}.ipynb"
    first = f"Fill in `{name}` in {_lab(lab)} first"
    again = "save it (Ctrl+S), and run this cell again"
    if not path.exists():
        path = _pasted_or_told(path, name, f"{first}: ", f"Put it there, {again}.")
    with _apart(path.resolve().parent):
        session = Session(_pasted(path) if path.suffix == ".py" else read(path), place=f"{lab}, ")
        session.supply(given(checks_of(path, session.calls)))
        problems = list(session.run([name]))
    if name not in session.names:
        reasons = [line for problem in problems for line in problem.lines]
        raise EarlierLabError("\n".join([f"{first} ({path.name}), {again}.", *reasons]))
    for check in checks_of(path, session.calls):
        lines = Rehearsal(session).judge(check) if subjects([check]) == {name} else []
        if lines:
            end = "" if lines[0].endswith((".", "?")) else "."
            print(f"Your `{name}` from {_lab(lab)} does not pass its check yet: {lines[0]}{end}")
            print(f"Finish it there, {again}.")
            break
    return session.names[name]


def _pasted_or_told(path, name, first, put):
    """The file of Python that stands for a notebook which is not there; raises EarlierLabError if there is none."""
    pasted = path.with_suffix(".py")
    if not pasted.exists():
        where = f"{path.name} is not in the folder {path.resolve().parent}"
        cell = f"add a cell above with `%%writefile {pasted.name}` in its first line"
        then = f"below it your `{name}` and what it uses of your own. Run that cell, and then this one again."
        raise EarlierLabError(f"{first}{where}. {put}\nOr, where this notebook is alone: {cell}, {then}")
    return pasted


def _pasted(path):
    """The cells of a notebook that holds one answer: a file of Python."""
    try:
        return [Cell(1, "answer", "answer", True, path.read_text(encoding="utf-8-sig"))]
    except (OSError, UnicodeDecodeError):
        raise EarlierLabError(f"{path.name} cannot be read: write it anew, with your answer in it.") from None


@contextmanager
def _apart(folder: Path) -> Iterator[None]:
    """Run another notebook's code: it finds the files beside it, and what it prints and draws is gone."""
    shown, here = _figures(), os.getcwd()
    sys.path.insert(0, str(folder))
    os.chdir(folder)
    try:
        with redirect_stdout(StringIO()):
            yield
    finally:
        os.chdir(here)
        sys.path.remove(str(folder))
        for number in _figures() - shown:
            sys.modules["matplotlib.pyplot"].close(number)


def _figures():
    pyplot = sys.modules.get("matplotlib.pyplot")
    return set(pyplot.get_fignums()) if pyplot else set()


def _lab(lab):
    number = re.match(r"\d+", lab)
    return f"lab {int(number[0])}" if number else lab
