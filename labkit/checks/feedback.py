"""From a student's exception to one sentence and the student's own line."""

import ast
import linecache
import logging
import os
import re
import sys
import sysconfig
import textwrap
import tomllib
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import TypeVar

LEFT_OVER = "The line `raise NotImplementedError` still stands below your code: delete it when that is complete."
TO_WRITE = "This part is still to be written: replace the `raise NotImplementedError`."
STOPPED = "It was still running when it was stopped: does a loop never end?"
LOG = logging.getLogger("labkit.checks")  # of faults of these checks themselves
LOG.addHandler(logging.NullHandler())
T = TypeVar("T")
_KIT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
# Of an exception, its text and what to do about it.
_KNOWN = tomllib.loads(Path(__file__).with_name("exceptions.toml").read_text(encoding="utf-8"))["known"]
_LIBRARIES = {os.path.realpath(p) for p in sysconfig.get_paths().values()} - {os.path.realpath(sys.prefix)}


class LabError(Exception):
    """An error whose text is written for the student: notebooks show it without a traceback."""

    @property
    def lines(self) -> list[str]:
        """The text in lines, the sentence that matters most first."""
        return str(self).splitlines()

    def _render_traceback_(self) -> list[str]:  # IPython's hook for exceptions that know how to show themselves
        return str(self).splitlines()


class FilterError(LabError):
    """The student's filter raised, or returned something that is no estimate."""


def safely(look: Callable[[], T], otherwise: T) -> T:
    """What `look` gives, or `otherwise` where it fails: what is said beside a verdict never takes its place."""
    try:
        return look()
    except LabError:
        raise
    except Exception:
        LOG.exception("A diagnosis failed.")
        return otherwise


def explain(error: BaseException) -> str:
    """One sentence for an exception, then the student's own line where it happened, if it is known."""
    where = own_line(error)
    return sentence(error) + (f"\n{where}" if where else "")


def own_line(error: BaseException) -> str:
    """'in update, line 12:  S = H @ P' for the deepest frame of the student's code, or ''."""
    if isinstance(error, SyntaxError):
        place = f"{error.filename}, " if is_cell(error.filename or "") else ""
        return f"{place}line {error.lineno}:  {(error.text or '').strip()}" if error.lineno else ""
    found, tb = [], error.__traceback__
    while tb is not None:
        if not is_library(tb.tb_frame.f_code.co_filename):
            found.append((tb.tb_frame, tb.tb_lineno))
        tb = tb.tb_next
    if isinstance(error, RecursionError):  # it may run out anywhere; the line that calls itself is met most often
        lines = [_line(*place) for place in found]
        return max(lines, key=lines.count, default="")
    return _line(*found[-1]) if found else ""


def running_line(frame: FrameType | None) -> str:
    """The same for code that is still running: the innermost line of the student's under `frame`."""
    while frame is not None and is_library(frame.f_code.co_filename):
        frame = frame.f_back
    return _line(frame, frame.f_lineno) if frame else ""


def _own_lines(error):
    """The student's function where it happened, from its first line to that one, or ''."""
    found, tb = "", error.__traceback__
    while tb is not None:
        code = tb.tb_frame.f_code
        if not is_library(code.co_filename):
            numbers = range(code.co_firstlineno, tb.tb_lineno + 1)
            found = "".join(linecache.getline(code.co_filename, n, tb.tb_frame.f_globals) for n in numbers)
        tb = tb.tb_next
    return found


def _is_left_over(error):
    """Whether the function has code of its own above the line that says that it is still to be written."""
    try:
        (function,) = ast.parse(textwrap.dedent(_own_lines(error))).body
        body = function.body if isinstance(function, ast.FunctionDef) else []
    except (SyntaxError, ValueError):
        return False
    return len(body) - (ast.get_docstring(function) is not None) > 1 if body else False


def _line(frame, number):
    code = frame.f_code
    cell = f"{code.co_filename}, " if is_cell(code.co_filename) else ""
    method = "" if code.co_name.startswith("<") else f"in {code.co_name}, "
    text = linecache.getline(code.co_filename, number, frame.f_globals).strip()
    return f"{cell}{method}line {number}:  {text}"


def is_cell(filename: str) -> bool:
    """Whether code was compiled by labkit.notebook.session, which calls its files like "cell 'answer-kf'"."""
    return re.search(r"(^|, )cell ('.*'|\d+)$", filename) is not None


def is_library(filename: str) -> bool:
    """Whether a file is of Python, of a package or of this kit: what is left is the student's."""
    if is_cell(filename):
        return False
    path = os.path.realpath(filename)
    return filename.startswith("<frozen") or any(path.startswith(folder + os.sep) for folder in (_KIT, *_LIBRARIES))


def sentence(error: BaseException) -> str:
    """What went wrong, in the words of someone who has seen it a hundred times."""
    text = (error.msg if isinstance(error, SyntaxError) else str(error)).strip().removesuffix(".")
    if isinstance(error, LabError):
        return str(error)
    if isinstance(error, KeyboardInterrupt):
        return STOPPED
    if isinstance(error, NotImplementedError):
        return LEFT_OVER if "still to be written" in str(error) and _is_left_over(error) else str(error) or TO_WRITE
    name = type(error).__name__ + (f": {text}" if text not in ("", "None") else "")
    if isinstance(error, SyntaxError) and re.match(r"(<<<<<<<|=======|>>>>>>>)", error.text or ""):
        return f"{name}.\nGit's conflict marks are in this cell: keep one of the two versions, and delete the marks."
    if isinstance(error, ValueError) and re.search(r"block_diag\([^*,()]+\)", _own_lines(error)):
        return f"{name}.\n`block_diag` takes blocks one by one: `block_diag(*blocks)`, with a star before the list."
    seen = f"{text}\n{own_line(error)}" if isinstance(error, IndexError) else text
    bases = {base.__name__ for base in type(error).__mro__}
    for known in _KNOWN:
        if bases & set(known["error"]) and re.search(known["text"], seen):
            return f"{name}.\n{known['advice']}"
    return name
