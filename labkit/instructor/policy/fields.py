"""The tables of a TOML file, key by key: what is unknown or of the wrong kind is told in a sentence, and all of it."""

from collections.abc import Collection, Mapping
from datetime import date, datetime, time
from difflib import get_close_matches
from math import isfinite
from typing import Any

from ..report.texts import clean

WORDS = (
    (bool, "true or false"),
    ((int, float), "a number"),
    (str, "a text in quotes"),
    (list, "a list in brackets"),
    (dict, "a table"),
    (datetime, "a date with a time"),
    (date, "a date"),
    (time, "a time of day"),
)


def kind(value: object) -> str:
    """What a value of TOML is, in words."""
    return next((words for types, words in WORDS if isinstance(value, types)), "something else")


def meant(name: str, known: Collection[str], alike: float = 0.6) -> str:
    """How a sentence on a wrong name ends: with the nearest one that there is, or with all."""
    near = get_close_matches(name, known, 1, alike)
    if near:
        return f"; did you mean {near[0]!r}?"
    return f"; there {'are' if len(known) > 1 else 'is only'} {', '.join(known)}" if known else ""


class Table:
    """One table; where: what messages call it, '' for the whole file;  wrong: gets the sentences."""

    def __init__(self, values: Mapping[str, Any], where: str, wrong: list[str]) -> None:
        self.values, self.where, self.wrong = values, where, wrong

    def keys(self, known: Collection[str]) -> None:
        """Tell each key that is none of the known ones."""
        for key in self.values:
            if key not in known:
                self.tell(key, f"there is no such key{meant(key, known)}")

    def tell(self, key: str, problem: str) -> None:
        """Tell what is wrong with a key."""
        self.wrong.append(clean(" ".join(filter(None, (self.where, f"{key}: {problem}.")))).replace("?.", "?"))

    def get(self, key: str, types: type, default: Any, what: str = "") -> Any:
        """The value of a key if it is one of the type, else it is told; what: it should be, in words."""
        value = self.values.get(key, default)
        if key in self.values and type(value) is not types:
            self.tell(key, f"this is {kind(value)}, and should be {what or dict(WORDS).get(types, 'another kind')}")
            return default
        return value

    def number(self, key: str, default: float | None = 0.0, most: float = 1e6) -> Any:
        """A number from 0 to `most`."""
        value = self.values.get(key, default)
        if key not in self.values:
            return default
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.tell(key, f"this is {kind(value)}, and should be a number")
        elif not isfinite(value) or value < 0 or value > most:
            self.tell(key, f"{value} is not possible; write a number from 0 to {most:g}")
        else:
            return float(value)
        return default

    def choice(self, key: str, known: Collection[str], default: str) -> str:
        """One of the known words."""
        value = self.get(key, str, default)
        if value not in known and key in self.values and isinstance(self.values[key], str):
            self.tell(key, f"{value!r} is not possible{meant(value, known)}")
            return default
        return value

    def tables(self, key: str) -> list["Table"]:
        """The tables [[key]], each with its number."""
        found = self.get(key, list, [], f"a table in two brackets, [[{key}]]")
        tables = []
        for place, one in enumerate(found, 1):
            if isinstance(one, dict):
                tables.append(Table(one, f"[[{key}]] {place},", self.wrong))
            else:
                self.tell(f"{key} {place}", f"this is {kind(one)}, and should be a table [[{key}]]")
        return tables
