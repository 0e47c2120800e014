"""From a student's exception to one sentence and the student's own line."""

import linecache
import os
import re
import sys
import sysconfig

_KIT = os.path.dirname(os.path.abspath(__file__))
_LIBRARIES = {os.path.realpath(p) for p in sysconfig.get_paths().values()} - {os.path.realpath(sys.prefix)}


class Told(Exception):
    """An error whose text is written for the student: notebooks show it without a traceback."""

    def _render_traceback_(self):  # IPython's hook for exceptions that know how to show themselves
        return str(self).splitlines()


class FilterError(Told):
    """The student's filter raised, or returned something that is no estimate."""


def explain(error):
    """One sentence for an exception, then the student's own line where it happened, if it is known."""
    where = own_line(error)
    return sentence(error) + (f"\n{where}" if where else "")


def own_line(error):
    """'in update, line 12:  S = H @ P' for the deepest frame of the student's code, or ''."""
    if isinstance(error, SyntaxError):
        return f"line {error.lineno}:  {(error.text or '').strip()}" if error.lineno else ""
    found = ""
    tb = error.__traceback__
    while tb is not None:
        code = tb.tb_frame.f_code
        if not _is_library(code.co_filename):
            line = linecache.getline(code.co_filename, tb.tb_lineno, tb.tb_frame.f_globals).strip()
            found = f"in {code.co_name}, line {tb.tb_lineno}:  {line}"
        tb = tb.tb_next
    return found


def _is_library(filename):
    path = os.path.realpath(filename)
    return filename.startswith("<frozen") or any(
        path.startswith(folder + os.sep) for folder in (_KIT, *_LIBRARIES)
    )


def sentence(error):
    """What went wrong, in the words of someone who has seen it a hundred times."""
    text = str(error)
    if isinstance(error, Told):
        return text
    if isinstance(error, NotImplementedError):
        return text or "This part is still to be written: replace the `raise NotImplementedError`."
    for kind, pattern, advice in _KNOWN:
        if isinstance(error, kind) and re.search(pattern, text):
            return f"{type(error).__name__}: {text}.\n{advice}"
    return f"{type(error).__name__}: {text}"


_KNOWN = [
    (ValueError, "read-only|non-writeable",
     "Your code changes an array that it was given (for example with `+=`). Others still use that "
     "array: make a new one, as in `x = x + step`."),
    (ValueError, "need at least one array",
     "There was nothing to stack: when the robot sees no landmark, `y` is an empty list and "
     "`update` has nothing to do."),
    (ValueError, r"matmul|dot|core dimension|not aligned|operands could not be broadcast",
     "Two sizes do not fit. With p landmarks in view: innovation (2p,), H (2p, 2), R (2p, 2p), "
     "S (2p, 2p), K (2, 2p). Print the `.shape` of both sides."),
    (ValueError, "[Ss]ingular",
     "A matrix without an inverse: is R added to H P H', and is R the covariance of *all* landmarks in view?"),
    (ValueError, "is not in list",
     "That landmark was looked for and not found; compare landmarks with `==` (by id), not by position."),
    (ValueError, "truth value of an array",
     "An `if` or `==` met a whole array; compare single numbers or landmarks instead."),
    (IndexError, ".",
     "Something was looked up at a position that is not there. A landmark's id is its name, not its "
     "place in the map: find it with `==` or `map.index(...)`."),
    (AttributeError, "NoneType",
     "A variable is None: a function without `return`, or a search that found nothing."),
    (AttributeError, "Landmark",
     "A Landmark has two fields: `.p`, an array of two numbers, and `.id`."),
    (UnboundLocalError, ".", "That name gets its value only in a branch that did not run."),
    (NameError, ".", "That name is not known here: a typing slip, a missing `self.`, or a cell not run yet."),
    (TypeError, "positional argument",
     "The call and the definition disagree: methods take `self` first, then exactly what the signature says."),
    (TypeError, "Landmark",
     "A Landmark was used as if it were an array: its two numbers are in `.p`."),
    (RecursionError, ".", "A function calls itself without an end."),
    (ZeroDivisionError, ".", "A division by zero: is a list empty there, or a distance zero?"),
    (SyntaxError, ".", "Python cannot read this line: look for a missing bracket, colon or indent, there or just above."),
]  # fmt: skip
