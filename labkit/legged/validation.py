"""What a localizer is given, checked before it does harm."""

import math
from collections.abc import Container, Sequence

import numpy as np

from ..geometry import Motion
from ..world import Landmark


def as_motion(u: Motion) -> Motion:
    """U (3,) as an array, if it is three finite numbers [m, m, rad]; raises ValueError."""
    if len(u) != 3 or not all(map(math.isfinite, u)):
        raise ValueError(f"u must be three finite numbers (ahead, to the left, turned), but it is {u!r}")
    return np.asarray(u)


def as_sightings(y: Sequence[Landmark], places: Container) -> Sequence[Landmark]:
    """Y, if all its sightings are of landmarks in `places` and made of finite numbers; raises ValueError."""
    for sighting in y:
        if sighting.id not in places:
            raise ValueError(f"y names a landmark that is not on the field: {sighting.id!r}")
        r, bearing = sighting.p
        if not (r > 0 and math.isfinite(r) and math.isfinite(bearing)):
            raise ValueError(f"y holds a sighting of {sighting.id} that is no range and bearing: {sighting.p!r}")
    return y
