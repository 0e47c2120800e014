"""What an input can be: one table of kinds, each of which says all that checks and grading need to know of it.

Inputs are stored as JSON: numbers and lists stand for themselves, {"landmark": [...]} for an object of a kind.
The general kinds are at the end of this file. A lab adds its own in KINDS of `labkit/<its package>/kinds.py`, where
they are found by names such as "legged.noise"; nothing else in checks or grading knows a lab.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..world import Landmark, Map


def vary(stored: Any, rng: np.random.Generator) -> Any:
    """A stored input with other numbers: each changes by some per cent, a matrix as a whole; zeros and names stay."""
    if isinstance(stored, float):
        return stored * _factor(rng)
    if isinstance(stored, dict):
        return {name: vary(value, rng) for name, value in stored.items()}
    if isinstance(stored, list):
        if stored and isinstance(stored[0], list):  # so that a covariance stays one
            return (np.array(stored, dtype=float) * _factor(rng)).tolist()
        return [vary(value, rng) for value in stored]
    return stored


def _factor(rng):
    """Far enough from 1 that stored results are wrong, near enough that a drive stays a drive."""
    return 1 + rng.choice([-1, 1]) * rng.uniform(0.02, 0.06)


def frozen(numbers: Any, dtype: type = float) -> NDArray:
    """An array (...,) of the numbers, read-only, so that code which changes it raises at its own line."""
    array: NDArray = np.array(numbers, dtype=dtype)
    array.setflags(write=False)
    return array


def number_text(value: Any, digits: int = 4, size: float = 0.0) -> str:
    """A text or an array, its numbers rounded to four digits: '[1.234, -0.5]'.

    size: of numbers beside it; what is nothing beside these, or beside the largest of its own, is 0: rounding made it.
    """
    if isinstance(value, str):
        return repr(value)
    size = np.nanmax(np.abs([size, *np.ravel(value)]))
    if value.ndim == 0:
        return "NaN" if np.isnan(value) else f"{value if abs(value) > 1e-9 * size else 0.0:.{digits}g}"
    shown = value if len(value) <= 8 else value[:6]
    digits = 3 if value.ndim > 1 and value.shape[-1] > 2 else digits  # a row of three in one line
    return "[" + ", ".join([number_text(v, digits, size) for v in shown] + ["..."] * (len(shown) < len(value))) + "]"


def same() -> str:
    """The watch over an input that cannot be changed."""
    return ""


def _stays(value):
    raise TypeError("an input of this kind travels as the numbers that it is made of")


@dataclass(frozen=True)
class Kind:
    """One kind of input. What is stored is JSON; what travels is plain data, arrays and objects of other kinds.

    read        from what is stored, the object that a student's code gets; its arrays are `frozen`
    vary        from what is stored and a random generator, what is stored of another such input
    tell        from what is stored, the input as a student would type it
    noise       from what is stored and a method's name, what the method uses of it, where that is a noise worth telling
    watch       from the object, a function that says later what was changed in it, or ''
    cls         of the objects that travel as this kind, or None
    send        from the object, what travels;  receive: from that, the object; any exception means that there is none
    """

    read: Callable[[Any], Any]
    vary: Callable[[Any, np.random.Generator], Any] = vary
    tell: Callable[[Any], str] = repr
    noise: Callable[[Any, str], str] = lambda stored, method: ""
    watch: Callable[[Any], Callable[[], str]] = lambda value: same
    cls: type | None = None
    send: Callable[[Any], Any] = _stays
    receive: Callable[[Any], Any] = _stays


def point(cls: type[Landmark], *more: str) -> Kind:
    """Landmarks of a class, stored as [id, x, y, the fields `more`]."""

    def read(stored):
        id, x, y, *rest = stored
        return made([id, frozen([x, y]), *rest])

    def made(data):
        id, p, *rest = data
        if np.shape(p) != (2,):
            raise ValueError(f"a place must be two numbers, but it is {p!r}")
        landmark = cls._of(p, id)
        for name, value in zip(more, rest, strict=True):
            setattr(landmark, name, value)
        return landmark

    def tell(stored):
        id, x, y, *rest = stored
        fields = "".join(f", {name}={value!r}" for name, value in zip(more, rest))
        return f"{cls.__name__}({number_text(np.array([x, y]))}, id={id!r}{fields})"

    def watch(landmark):
        p, id = landmark.p, landmark.id
        changed = "puts other values into a Landmark that it was given"
        return lambda: "" if landmark.p is p and landmark.id == id else changed

    return Kind(
        read,
        lambda stored, rng: [stored[0], *(float(value) * _factor(rng) for value in stored[1:3]), *stored[3:]],
        tell,
        watch=watch,
        cls=cls,
        send=lambda lm: [lm.id, np.asarray(lm.p, dtype=float), *(getattr(lm, name) for name in more)],
        receive=made,
    )


def many(one: Kind, make: Callable = list, what: str = "list of landmarks", name: str = "", first: int = 2) -> Kind:
    """Several inputs of one kind, in a list or what else `make` makes; told by name, or by the first of them."""

    def tell(stored):
        more = [f"{len(stored) - first} more"] * (len(stored) > first)
        return name or "[" + ", ".join([*map(one.tell, stored[:first]), *more]) + "]"

    def watch(value):
        kept, watches = list(value), [one.watch(item) for item in value]

        def changed():
            if len(value) != len(kept) or not all(a is b for a, b in zip(value, kept)):
                return f"changes the {what} that it was given"
            return next(filter(None, (watch() for watch in watches)), "")

        return changed

    return Kind(
        lambda stored: make(map(one.read, stored)),
        lambda stored, rng: [one.vary(item, rng) for item in stored],
        tell,
        watch=watch,
        cls=make if isinstance(make, type) and make not in (list, tuple) else None,
        send=list,
        receive=make,
    )


def fields(cls: type, *names: str, tell: Callable = repr, noise: Callable = Kind.noise) -> Kind:
    """Objects of a class that is made with its fields by name: all that it has, or those named here."""

    def made(data):
        return cls(**data)

    def send(value):
        return {name: getattr(value, name) for name in names or vars(value)}

    return Kind(made, tell=tell, noise=noise, cls=cls, send=send, receive=made)


def run(cls: type, *more: str) -> Kind:
    """Logs of a class, which travel without what no filter may know: the truth, and how the run was made."""
    known = ("times", "controls", "seen_step", "seen_id", "seen", "map", "sensor", "frame", "Q", "R", *more)
    kind = fields(cls, *known)
    return replace(kind, receive=lambda data: cls(**{**data, "seen_id": np.asarray(data["seen_id"])}))


def split(stored: Any) -> tuple[str, Kind, Any]:
    """The name of a stored input's kind, the kind and what it reads; the name of plain values is ''."""
    if not isinstance(stored, dict):
        return "", PLAIN, stored
    ((name, content),) = stored.items()
    return name, find(name), content


def find(name: str) -> Kind:
    """The kind of that name, 'map' or 'legged.noise'. Raises KeyError if there is none."""
    package, dot, own = name.rpartition(".")
    if dot and not _has_kinds(package):
        raise KeyError(f"there is no labkit/{package}/kinds.py")
    return _table(package)[own]


@cache
def of(cls: type) -> tuple[str, Kind] | None:
    """The name and the kind of a class's objects, or None. The module of a class tells whose kind it is."""
    for base in cls.__mro__:
        top, package, *_ = [*base.__module__.split("."), ""]
        if top == "labkit":
            package = package if _has_kinds(package) else ""
            for name, kind in _table(package).items():
                if kind.cls is base:
                    return f"{package}.{name}".lstrip("."), kind
    return None


def _table(package):
    """The kinds of a lab's package, or of all labs, if it is ''."""
    return import_module(f"labkit.{package}.kinds").KINDS if package else KINDS


@cache
def _has_kinds(package):
    fits = package.isidentifier() and package not in ("checks", "instructor")
    return fits and any(Path(folder, package, "kinds.py").is_file() for folder in sys.modules["labkit"].__path__)


PLAIN = Kind(
    lambda stored: frozen(stored) if isinstance(stored, list) else stored,
    tell=lambda stored: number_text(np.array(stored)) if isinstance(stored, list) else repr(stored),
)
LANDMARK = point(Landmark)
KINDS = {
    "landmark": LANDMARK,
    "landmarks": many(LANDMARK),
    "map": many(LANDMARK, Map, "map", "m"),
    "ints": Kind(lambda stored: frozen(stored, int), lambda stored, rng: rng.permutation(stored).tolist()),
}
