"""The paper's experiments as teams that drive: two and four observers, standing and moving."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..geometry import Seed
from .log import TeamLog, later
from .world import Route, Team

CROSS = [(-3.5, 0), (0, 0), (0, 3.5), (0, 0), (3.5, 0), (0, 0), (0, -3.5), (0, 0)]
RECTANGLE = [(-3, 2), (-3, -2), (3, -2), (3, 2)]  # the first side is 6 m, without a turn

POSTS = [(-8.5, -7), (8.5, -7), (8.5, 7), (-8.5, 7)]


def cross(rng: Seed = None, steps: int = 620, **more: Any) -> TeamLog:
    """S1: robot 0 drives a cross; robots 1 and 2 stand and watch (the paper's figure 3); steps: 620 are all of it."""
    poses = [(0, 0, np.pi), (-4.5, -4.0, np.deg2rad(40)), (4.5, -4.0, np.deg2rad(135))]
    team = Team(poses, sees=[(1, 0), (2, 0)], rng=rng, **more)
    return team.record(Route({0: CROSS}), steps, "two observers, a cross")


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


def parted(minutes: float, rng: Seed = None, **more: Any) -> tuple[TeamLog, TeamLog]:
    """S2 without false readings, but after a minute nobody sees anybody for so long: the run until then, and after."""
    dark = 300, 300 + round(300 * minutes)
    team = Team(_four(), sees=[(i, 0) for i in range(1, 5)], rng=rng, dark=dark, **more)
    log = team.record(Route({0: RECTANGLE * (dark[1] // 385 + 2)}), dark[1] + 150, "four observers that lose sight")
    return later(log, 0, dark[1] - 1), later(log, dark[1] - 1)


def passed(log: TeamLog, points: Sequence) -> list[int]:
    """The steps in which robot 0 comes to these points (2,) [m], one after the other."""
    steps, way = [0], np.asarray(log.truth)[:, 0, :2]
    for point in points:
        steps.append(steps[-1] + int((np.linalg.norm(way[steps[-1] :] - point, axis=1) < 0.06).argmax()))
    return steps[1:]


def _four():
    corners = [(-5, -4), (5, -4), (5, 4), (-5, 4)]
    return [(3, 2, np.pi)] + [(x, y, np.arctan2(-y, -x)) for x, y in corners]
