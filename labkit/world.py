"""The world: landmarks with names, maps of them, and what a sensor sees of a map."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .geometry import Measurements, Point, Points, Seed, wrap
from .validation import as_count, as_point

SENSORS = ("xy", "rb")


class Landmark:
    """A point with a name, in a map or in a measurement.

    p:  (2,) position [m] in a map; in a measurement (dx, dy) [m] or (range [m], bearing [rad]).
    id: the name (any hashable); two landmarks are equal when their ids are.

    `lm + v` and `lm - v` act on `p` and give arrays, so `lm - x` points from x to the landmark.
    """

    __slots__ = ("id", "p")
    complete = True  # a camera may see only part of a landmark: see labkit.legged.Sighting
    __array_ufunc__ = None  # `array - landmark` must reach __rsub__, not numpy's loop over objects

    def __init__(self, p: ArrayLike, id: Any):
        self.p = as_point(p, f"the position of landmark {id!r}")
        self.id = id

    @classmethod
    def _of(cls, p, id):
        """Without the checks, for the thousands of measurements of a recorded run."""
        self = object.__new__(cls)
        self.p, self.id = p, id
        return self

    def __add__(self, v: Any) -> Point:
        return self.p + getattr(v, "p", v)

    def __sub__(self, v: Any) -> Point:
        return self.p - getattr(v, "p", v)

    def __radd__(self, v: Any) -> Point:
        return v + self.p

    def __rsub__(self, v: Any) -> Point:
        return v - self.p

    def __eq__(self, other: object) -> bool:
        return self.id == getattr(other, "id", other)

    def __hash__(self) -> int:
        return hash(self.id)

    def __repr__(self) -> str:
        return f"Landmark({np.array2string(self.p, precision=3, separator=', ')}, id={self.id!r})"


class Map(list[Landmark]):
    """A list of Landmark in world coordinates, with distinct ids.

    `m.index(lm)` finds a landmark by id, also that of a measurement; a bare id works too.
    """

    def __init__(self, landmarks: Iterable[Landmark] = ()):
        super().__init__()
        for landmark in landmarks:
            self.append(landmark)

    def append(self, landmark: Landmark) -> None:
        """Add a landmark; TypeError if it is none, ValueError if its id is taken."""
        if not isinstance(landmark, Landmark):
            raise TypeError(f"a Map holds Landmark objects, but it was given {landmark!r}")
        if landmark in self:
            raise ValueError(f"the map already has a landmark with id {landmark.id!r}")
        super().append(landmark)

    @property
    def positions(self) -> Points:
        """(n, 2) [m], world frame, in the order of the list."""
        return positions(self)

    @property
    def ids(self) -> list:
        """The names, in the order of the list."""
        return [landmark.id for landmark in self]


def positions(landmarks: Sequence[Landmark]) -> Points:
    """(n, 2) array of the `p` of landmarks; (0, 2) where there are none."""
    try:
        return np.array([lm.p for lm in landmarks], dtype=float).reshape(-1, 2)
    except (AttributeError, TypeError):
        raise TypeError(f"a Map or a list of Landmark objects is needed, but it is {landmarks!r}") from None


def places(map: Sequence[Landmark], ids: np.ndarray) -> Points:
    """(M, 2) [m] where the landmarks with these ids (M,) are; ValueError names one that the map lacks."""
    known = {lm.id: lm.p for lm in map}
    try:
        return np.array([known[i] for i in ids.tolist()]).reshape(-1, 2)
    except KeyError as lacking:
        has = f"its ids are {str(list(known))[:80]}" if known else "it is empty"
        raise ValueError(f"a measurement is of landmark {lacking}, which the map lacks: {has}") from None


def random_map(n: int = 25, rng: Seed = None, half_width: float = 5.0) -> Map:
    """Map of `n` landmarks, ids 0..n-1, uniform in [-half_width, half_width]^2 [m].

    rng: a numpy Generator, or a seed for one.
    """
    n = as_count(n, "n, the number of landmarks,", 0)
    points = np.random.default_rng(rng).uniform(-half_width, half_width, (n, 2))
    return Map(Landmark._of(p, i) for i, p in enumerate(points))


def sensed(offset: Points, sensor: str) -> Measurements:
    """What a noise-free sensor reports of points at `offset` (..., 2) [m] from the robot.

    'xy': the offset itself; 'rb': (range [m], bearing [rad]), bearing in the world frame.
    """
    if sensor == "xy":
        return offset
    dx, dy = offset[..., 0], offset[..., 1]
    return np.stack([np.hypot(dx, dy), np.arctan2(dy, dx)], axis=-1)


def located(p: Points, values: Measurements, sensor: str) -> Points:
    """World positions (..., 2) [m] of what a robot at `p` (..., 2) measured: the inverse of `sensed`."""
    if sensor == "xy":
        return p + values
    r, bearing = values[..., 0], values[..., 1]
    return p + np.stack([r * np.cos(bearing), r * np.sin(bearing)], axis=-1)


def difference(a: Measurements, b: Measurements, sensor: str) -> Measurements:
    """A - b for measurements (..., 2): bearings are wrapped, all else is plain subtraction."""
    d = np.asarray(a) - b
    if sensor == "rb":
        d[..., 1] = wrap(d[..., 1])
    return d
