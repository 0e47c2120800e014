"""From a student's exception to one sentence and the student's own line."""

import linecache
import os
import re
import sys
import sysconfig
from types import FrameType
from typing import Any

_KIT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
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
        if not _is_library(tb.tb_frame.f_code.co_filename):
            found.append((tb.tb_frame, tb.tb_lineno))
        tb = tb.tb_next
    if isinstance(error, RecursionError):  # it may run out anywhere; the line that calls itself is met most often
        lines = [_line(*place) for place in found]
        return max(lines, key=lines.count, default="")
    return _line(*found[-1]) if found else ""


def running_line(frame: FrameType | None) -> str:
    """The same for code that is still running: the innermost line of the student's under `frame`."""
    while frame is not None and _is_library(frame.f_code.co_filename):
        frame = frame.f_back
    return _line(frame, frame.f_lineno) if frame else ""


def _own_lines(error):
    """The student's function where it happened, from its first line to that one, or ''."""
    found, tb = "", error.__traceback__
    while tb is not None:
        code = tb.tb_frame.f_code
        if not _is_library(code.co_filename):
            numbers = range(code.co_firstlineno, tb.tb_lineno + 1)
            found = "".join(linecache.getline(code.co_filename, n, tb.tb_frame.f_globals) for n in numbers)
        tb = tb.tb_next
    return found


def _line(frame, number):
    code = frame.f_code
    cell = f"{code.co_filename}, " if is_cell(code.co_filename) else ""
    method = "" if code.co_name.startswith("<") else f"in {code.co_name}, "
    text = linecache.getline(code.co_filename, number, frame.f_globals).strip()
    return f"{cell}{method}line {number}:  {text}"


def is_cell(filename: str) -> bool:
    """Whether code was compiled by labkit.notebook.session, which calls its files like "cell 'answer-kf'"."""
    return re.search(r"(^|, )cell ('.*'|\d+)$", filename) is not None


def _is_library(filename):
    if is_cell(filename):
        return False
    path = os.path.realpath(filename)
    return filename.startswith("<frozen") or any(path.startswith(folder + os.sep) for folder in (_KIT, *_LIBRARIES))


def sentence(error: BaseException) -> str:
    """What went wrong, in the words of someone who has seen it a hundred times."""
    text = (error.msg if isinstance(error, SyntaxError) else str(error)).strip().removesuffix(".")
    if isinstance(error, LabError):
        return str(error)
    if isinstance(error, NotImplementedError):
        return str(error) or "This part is still to be written: replace the `raise NotImplementedError`."
    name = type(error).__name__ + (f": {text}" if text not in ("", "None") else "")
    if isinstance(error, ValueError) and re.search(r"block_diag\([^*,()]+\)", _own_lines(error)):
        return f"{name}.\n`block_diag` takes blocks one by one: `block_diag(*blocks)`, with a star before the list."
    seen = f"{text}\n{own_line(error)}" if isinstance(error, IndexError) else text
    for kind, pattern, advice in _KNOWN:
        if isinstance(error, kind) and re.search(pattern, seen):
            return f"{name}.\n{advice}"
    return name


_KNOWN: list[tuple[Any, str, str]] = [  # of an exception, its text and what to do about it
    (
        ValueError,
        "read-only|non-writeable",
        "Your code changes an array that it was given (for example with `+=`). Others still use that "
        "array: make a new one, as in `x = x + step`.",
    ),
    (
        ValueError,
        "need at least one array",
        "There was nothing to stack: when the robot sees no landmark, `y` is an empty list and "
        "`update` has nothing to do.",
    ),
    (
        ValueError,
        r"matmul|dot|core dimension|not aligned|operands could not be broadcast",
        "Two sizes do not fit. With p landmarks in view and n numbers in the estimate: innovation (2p,), H (2p, n), "
        "R (2p, 2p), S (2p, 2p), K (n, 2p). Print the `.shape` of both sides.",
    ),
    (
        ValueError,
        "[Ss]ingular",
        "A matrix without an inverse: is R added to H P H', and is R the covariance of *all* landmarks in view?",
    ),
    (
        ValueError,
        "is not in list",
        "That landmark was looked for and not found; compare landmarks with `==` (by id), not by position.",
    ),
    (
        ValueError,
        "truth value of an array",
        "An `if`, `min`, `max` or `==` met a whole array; compare single numbers or landmarks, or use a function that "
        "takes arrays, like `np.clip`.",
    ),
    (
        IndexError,
        r"\b(m|map)\[|\.id\b",
        "Something was looked up at a position that is not there. A landmark's id is its name, not its "
        "place in the map: find it with `==` or `map.index(...)`.",
    ),
    (
        IndexError,
        ".",
        "Something was looked up at a position that is not there: positions count from 0 to the length minus 1.",
    ),
    (KeyError, "", "A dictionary was asked for a key that it does not have."),
    (
        (AttributeError, TypeError),
        "NoneType",
        "A variable is None: a function without `return`, or a search that found nothing.",
    ),
    ((AttributeError, TypeError), "type (object )?'map'", "`map` is a Python built-in; yours is `self.map`."),
    (AttributeError, "Landmark", "A Landmark has two fields: `.p`, an array of two numbers, and `.id`."),
    (
        AttributeError,
        "has no attribute",
        "There is no such field or method: a typing slip, or a field that `__init__` does not set.",
    ),
    (UnboundLocalError, ".", "That name gets its value only in a branch that did not run."),
    (
        NameError,
        "'(stack|repeat_R)'",
        "That function was written in lab 1's notebook: run its cell there; in another notebook, copy it here.",
    ),
    (NameError, ".", "That name is not known here: a typing slip, a missing `self.`, or a cell not run yet."),
    (
        TypeError,
        "unexpected keyword argument",
        "The call and the definition disagree: a filter is made with KF(x0, P0, Q, R, m, dt=...).",
    ),
    (
        TypeError,
        "positional argument",
        "The call and the definition disagree: methods take `self` first, then exactly what the signature says.",
    ),
    (TypeError, "Landmark", "A Landmark was used as if it were an array: its two numbers are in `.p`."),
    (SystemExit, "", "The code ends Python itself (`exit()` or `quit()`): leave that out."),
    (RecursionError, ".", "A function calls itself without an end."),
    (ZeroDivisionError, ".", "A division by zero: is a list empty there, or a distance zero?"),
    (
        SyntaxError,
        ".",
        "Python cannot read this line: look for a missing bracket, colon or indent, there or just above.",
    ),
]
