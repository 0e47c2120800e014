"""The paper's experiments as teams that drive: two and four observers, standing and moving."""

from typing import Any

import numpy as np

from ..geometry import Seed
from .log import TeamLog
from .world import Route, Team

CROSS = [(-3.5, 0), (0, 0), (0, 3.5), (0, 0), (3.5, 0), (0, 0), (0, -3.5), (0, 0)]
RECTANGLE = [(-3, 2), (-3, -2), (3, -2), (3, 2)]  # the first side is 6 m, without a turn

POSTS = [(-8.5, -7), (8.5, -7), (8.5, 7), (-8.5, 7)]


def cross(rng: Seed = None, **more: Any) -> TeamLog:
    """S1: robot 0 drives a cross; robots 1 and 2 stand and watch (the paper's figure 3)."""
    poses = [(0, 0, np.pi), (-4.5, -4.0, np.deg2rad(40)), (4.5, -4.0, np.deg2rad(135))]
    team = Team(poses, sees=[(1, 0), (2, 0)], rng=rng, **more)
    return team.record(Route({0: CROSS}), 620, "two observers, a cross")


def rectangle(rng: Seed = None, laps: int = 3, probability: float = 0.3, posts: bool = False, **more: Any) -> TeamLog:
    """S2: robot 0 drives round a rectangle, four robots watch; false readings in one quadrant (figure 4).

    posts: whether there are four posts in the corners of the hall, members 5 to 8, which robot 0 sees on all sides:
    a map for comparison.
    """
    poses, sees = _four(), [(i, 0) for i in range(1, 5)]
    if posts:
        poses += [(x, y, 0) for x, y in POSTS]
        sees += [(0, i) for i in range(5, 9)]
        more = {"fov": [2 * np.pi] + 8 * [np.pi], **more}
    team = Team(poses, sees=sees, rng=rng, spurious=(-4, -3, 4, 3, probability), **more)
    return team.record(Route({0: RECTANGLE * laps}), 385 * laps, "four observers, a rectangle")


def moving(rng: Seed = None, **more: Any) -> TeamLog:
    """S3: as S2 without false readings, and two of the observers set off midway (figure 6)."""
    team = Team(_four(), sees=[(i, 0) for i in range(1, 5)], rng=rng, **more)
    ways: dict[int, list] = {0: RECTANGLE * 2, 1: [(-5.5, 0), (-5.0, 2.0)], 3: [(5.5, 1.0), (5.0, -1.5)]}
    return team.record(Route(ways, {1: 350, 3: 350}), 800, "four observers, two set off")


def _four():
    corners = [(-5, -4), (5, -4), (5, 4), (-5, 4)]
    return [(3, 2, np.pi)] + [(x, y, np.arctan2(-y, -x)) for x, y in corners]
