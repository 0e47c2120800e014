"""The football field of the four-legged league and its six visual landmarks."""

from dataclasses import dataclass

import numpy as np

from ..geometry import Point
from ..validation import is_number
from ..world import Landmark, Map

GOALS = ("yellow goal", "blue goal")
BEACONS = ("pink-yellow", "yellow-pink", "pink-blue", "blue-pink")


@dataclass(frozen=True)
class Field:
    """A field with its origin at the centre, x toward the blue goal, y to the left; all in metres.

    length, width: between the outer edges of the lines.  goal: width of a goal.
    beacon_x, beacon_y: the four beacons stand at (+-beacon_x, +-beacon_y).  beacon: their diameter.
    margin: of carpet around the lines, where a robot may be too.

    The defaults are those of the RoboCup Four-Legged League since its rules of 2005, figure 1 (the paper's
    footnote 4 refers to them); the diameter of a beacon is that of figure 2 there.
    Raises ValueError, with the argument's name, for a field that cannot be.
    """

    length: float = 5.4
    width: float = 3.6
    goal: float = 0.8
    beacon_x: float = 1.35
    beacon_y: float = 1.9
    beacon: float = 0.2
    margin: float = 0.2

    def __post_init__(self):
        for name in ("length", "width", "goal", "beacon_x", "beacon_y", "beacon", "margin"):
            value = getattr(self, name)
            if not (is_number(value) and value > 0):
                raise ValueError(f"{name} must be a positive number of metres, but it is {value!r}")
        if self.goal > self.width:
            raise ValueError(f"goal ({self.goal} m) cannot be wider than the field's width ({self.width} m)")
        for name, end in (("beacon_x", self.length / 2 + self.margin), ("beacon_y", self.width / 2 + self.margin)):
            if getattr(self, name) > end:
                raise ValueError(f"{name} ({getattr(self, name)} m) is beyond the carpet's end ({end:g} m)")

    @property
    def map(self) -> Map:
        """Map of the landmarks [m]: the middles of the goals' mouths, and the beacons."""
        x, (bx, by) = self.length / 2, (self.beacon_x, self.beacon_y)
        places = [(-x, 0), (x, 0), (-bx, by), (-bx, -by), (bx, by), (bx, -by)]
        return Map(Landmark(p, name) for p, name in zip(places, GOALS + BEACONS))

    @property
    def half(self) -> Point:
        """Half (2,) the size of the carpet [m]: lines and margin."""
        return np.array([self.length / 2 + self.margin, self.width / 2 + self.margin])

    @property
    def area(self) -> float:
        """Of the carpet [m^2]."""
        return float(4 * self.half.prod())


FIELD = Field()


def is_goal(landmark: Landmark | str) -> bool:
    """Whether a landmark, or its id, is a goal; all others count as beacons."""
    return getattr(landmark, "id", landmark) in GOALS
