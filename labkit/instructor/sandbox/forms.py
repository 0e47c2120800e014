"""What a worker's answer may be: its form, which the grader knows before it asks.

A form takes a value as it came through `wire` and gives back what may be used of it; for what does not fit it raises
FrameError. Texts are cut, all else must be as it was asked for: no field more or less, no list shorter or longer.
"""

import math
from collections.abc import Callable, Collection
from typing import Any, TypeAlias

import numpy as np

from .wire import FrameError

Form: TypeAlias = Callable[[Any], Any]
TEXT = 2000  # characters of anything that is only for reading


def text(most: int = TEXT) -> Form:
    """A text, of which `most` characters are kept."""
    return lambda value: _of(str, value)[:most]


def flag(value: Any) -> bool:
    """True or False."""
    return _of(bool, value)


def whole(value: Any) -> int:
    """A whole number; of one with more than 18 digits only that it is large."""
    return max(-(10**18), min(_of(int, value), 10**18))


def array(value: Any) -> np.ndarray:
    """An array of numbers (...,)."""
    return _of(np.ndarray, value)


def result(value: Any) -> Any:
    """What a student's function may give: numbers, texts, arrays and what Python puts these into."""
    if type(value) is int and abs(value) >= 2**63:
        return math.inf if value > 0 else -math.inf
    if isinstance(value, list | tuple):
        return type(value)(map(result, value))
    if isinstance(value, dict):
        return {name: result(item) for name, item in value.items()}
    return text()(value) if isinstance(value, str) else value


def optional(form: Form) -> Form:
    """None, or what has the form."""
    return lambda value: None if value is None else form(value)


def several(form: Form, least: int, most: int) -> Form:
    """A list of `least` to `most` values of one form."""

    def read(value):
        if not least <= len(_of(list, value)) <= most:
            raise FrameError("more or less came back than was asked for")
        return [form(item) for item in value]

    return read


def row(*forms: Form) -> Form:
    """A list of as many values as forms, each of its own."""

    def read(value):
        several(lambda item: item, len(forms), len(forms))(value)
        return [form(item) for form, item in zip(forms, value, strict=True)]

    return read


def fields(**forms: Form) -> Form:
    """A table of these fields, no more and no less."""

    def read(value):
        if _of(dict, value).keys() != forms.keys():
            raise FrameError("other fields came back than were asked for")
        return {name: form(value[name]) for name, form in forms.items()}

    return read


def table(form: Form, names: Collection[str]) -> Form:
    """A table of values of one form, under some of these names."""

    def read(value):
        if not set(_of(dict, value)) <= set(names):
            raise FrameError("other names came back than were asked for")
        return {name: form(item) for name, item in value.items()}

    return read


def either(**forms: Form) -> Form:
    """What has one of these forms: that whose name is a field of it."""

    def read(value):
        for name, form in forms.items():
            if name in _of(dict, value):
                return form(value)
        raise FrameError("something else came back than was asked for")

    return read


def _of(kind, value):
    if type(value) is not kind:
        raise FrameError(f"a {type(value).__name__} came back where a {kind.__name__} was asked for")
    return value


RAISED = fields(raised=text(80), place=optional(row(text(80), whole)), text=text(), stopped=flag)  # by the student
ODD = fields(odd=text())  # what came of their code is no data
