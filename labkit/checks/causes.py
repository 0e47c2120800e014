"""Where a filter fails because of a function of the same lab: that is to be mended first."""

import inspect
from collections.abc import Callable, Iterator
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


def first_to_mend(names: list[str]) -> list[str]:
    """The line about functions that do not pass their own checks; [] if there are none."""
    if not names:
        return []
    told = " and ".join(f"`{name}`" for name in names)
    return [
        f"First mend {told}: what this check needs of {'it' if len(names) == 1 else 'them'} is not right yet either."
    ]
