"""Where a filter fails because of a function of the same lab: that is to be mended first."""

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any


def used(subject: Any) -> Iterator[tuple[str, Callable]]:
    """(name, function) of what the methods of a student's class call by a name of the notebook."""
    methods = [m for cls in getattr(subject, "__mro__", ()) for m in vars(cls).values() if inspect.isfunction(m)]
    for method in methods:
        for name in _names(method.__code__):
            function = method.__globals__.get(name)
            if inspect.isfunction(function) and function.__globals__ is method.__globals__:
                yield name, function


def _names(code):
    """What a code object looks up, with the comprehensions in it."""
    inner = [name for const in code.co_consts if inspect.iscode(const) for name in _names(const)]
    return [*code.co_names, *inner]


def first_to_mend(
    subject: Any, checks: Sequence[Mapping], judge: Callable[[Any, Callable], object], refusal: type[Exception]
) -> list[str]:
    """The line about functions that a filter uses and that do not pass their own checks; [] if there are none.

    checks: the data of the checks of the same lab;  judge: raises `refusal` for a function that does not pass one.
    """
    wrong: list[str] = []
    for name, function in dict(used(subject)).items():
        for data in checks:
            if data["kind"] == "function" and data["subject"] == name and name not in wrong:
                try:
                    judge(data, function)
                except refusal:
                    wrong.append(name)
    if not wrong:
        return []
    told, them = " and ".join(f"`{name}`" for name in wrong), "it" if len(wrong) == 1 else "them"
    return [f"First mend {told}: what this check needs of {them} is not right yet either."]
