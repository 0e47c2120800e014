"""Where an answer fails because of another function of the same lab: that is to be mended first."""

import inspect
import types
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from .hints import fold
from .source import functions_of


def used(subject: Any) -> dict[str, types.FunctionType]:
    """{name: function} of what a student's function or class calls by a name of the notebook, also by way of others."""
    found: dict[str, types.FunctionType] = {}
    todo = list(functions_of(subject))
    while todo:
        caller = todo.pop(0)
        for name in _names(caller.__code__):
            function = caller.__globals__.get(name)
            if not inspect.isfunction(function) or function.__globals__ is not caller.__globals__:
                continue  # none of the notebook's
            if name not in found and function is not subject:
                found[name] = function
                todo.append(function)
    return found


def _names(code):
    """What a code object looks up, with the comprehensions in it."""
    inner = [name for const in code.co_consts if inspect.iscode(const) for name in _names(const)]
    return [*code.co_names, *inner]


def first_to_mend(
    names: Iterable[str], fails: Callable[[str], bool], uses: Callable[[str], Iterable[str]]
) -> list[str]:
    """The line about functions that an answer uses and that do not pass their own checks; [] if there are none.

    uses: what each of them uses in turn: of two that fail, one of which uses the other, the other is first.
    """
    wrong = [name for name in sorted(names) if fails(name)]
    first = [name for name in wrong if not set(wrong) & set(uses(name)) - {name}] or wrong
    if not first:
        return []
    told = " and ".join(f"`{name}`" for name in first)
    own = "its own check does" if len(first) == 1 else "their own checks do"
    return fold(f"First mend {told}: {own} not pass yet.")


def more_told(checks: Sequence[str]) -> list[str]:
    """The line about other checks of the same class that do not pass and look closer; [] if there are none."""
    if not checks:
        return []
    names = " and ".join(f"`{name}`" for name in checks)
    says, that, looks = ("says", "that does", "looks") if len(checks) == 1 else ("say", "these do", "look")
    return fold(f"First mend what {names} {says}: {that} not pass either, and {looks} closer.")
