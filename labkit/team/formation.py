"""A leader and its followers: who should be where, and a run in which they try to be."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..geometry import Array, Covariances, Point, Points, Pose, Poses, Seed, transform, wrap
from ..validation import as_covariance, as_numbers, as_point
from .log import TeamLog, recorded
from .world import DT, TURN, Team

SLOTS = np.array([[-1.1, 0.9], [-1.1, -0.9]])  # [m] behind the leader, to its left and right: a triangle
CRUISE, FASTEST = 0.25, 0.5  # [m/s] of the leader at best, of a follower at most
SLOW_HEADING = 1.5  # [s] by which the formation's heading lags behind the leader's
BLEND = 1 - np.exp(-DT / SLOW_HEADING)  # by which it comes nearer in a step
REACH = 0.3  # [m] a slot farther away pulls no harder than one at this distance
FORMED = 0.15  # [m] every follower this near to its slot: the formation stands
SETTLE = 9.0  # [s] in which what a turn has stirred up dies away
Force = Callable[[Point, Point, Point, Points], Point]
"""(me, slot, velocity of the slot, others) -> wanted velocity: see `run`."""


@dataclass(frozen=True)
class FormationRun:
    """A TeamLog with what the robots believed, poses (N+1, n, 3), and how the formation held.

    errors (N+1, n-1) [m] each follower's distance from its slot, by the true poses;  corners: the steps in
    which the leader began to turn;  finished: whether it came to its last way point;  least [m] the smallest
    distance of two robots;  covariances (N+1, 3n, 3n): of what they believed, or None.
    """

    log: TeamLog
    believed: Poses
    errors: Array
    corners: tuple
    finished: bool
    least: float
    covariances: Covariances | None = None

    @property
    def truth(self) -> Poses:
        """(N+1, n, 3) the true poses."""
        return np.asarray(self.log.truth)

    @property
    def error(self) -> Array:
        """(N+1,) [m] of the follower that is farthest from its slot."""
        return self.errors.max(axis=1)

    @property
    def formed(self) -> float:
        """Seconds until the formation first stands; NaN if it never does."""
        return _seconds(self.error <= FORMED)

    def recoveries(self) -> Array:
        """(corners,) seconds from each corner until the formation stands again."""
        ends = [*self.corners[1:], len(self.error)]
        return np.array([_after(self.error[a:b]) for a, b in zip(self.corners, ends)])

    @property
    def rms(self) -> float:
        """[m] root mean square over all followers while the leader goes straight ahead.

        The SETTLE seconds after the formation first stands and after each corner do not count.
        """
        if np.isnan(self.formed):
            return np.nan
        calm = np.ones(len(self.errors), dtype=bool)
        calm[: round((self.formed + SETTLE) / DT)] = False
        for corner in self.corners:
            calm[corner : corner + round(SETTLE / DT)] = False
        return float(np.sqrt(np.mean(self.errors[calm] ** 2))) if calm.any() else np.nan


def _seconds(good):
    return float(good.argmax() * DT) if good.any() else np.nan


def _after(error):
    """Seconds until the error is below FORMED for good; NaN if it never is."""
    bad = np.flatnonzero(error > FORMED)
    if not len(bad):
        return 0.0
    return float((bad[-1] + 1) * DT) if bad[-1] + 1 < len(error) else np.nan


def slots(leader: Pose, heading: float, offsets: Points = SLOTS) -> Points:
    """Where the followers should be (n, 2) [m], for a leader at (2,) and the formation's heading [rad]."""
    return transform(offsets, heading, leader[:2])


def lagging(heading: Array) -> Array:
    """The formation's heading (N+1,) [rad], which lags behind the leader's (N+1,): it is what the slots go by."""
    lags = [heading[0]]
    for now in heading[1:]:
        lags.append(lags[-1] + BLEND * wrap(now - lags[-1]))
    return np.array(lags)


def run(
    team: Team, estimator: Any, force: Force, way: Sequence, steps: int = 900, name: str = "a triangle"
) -> FormationRun:
    """Drive a leader (robot 0) through the way points, followers by `force`, all in the estimated frame.

    estimator: has predict(u (n, 3)), update(seen), x (n, 3), P (3n, 3n); None: the followers know the true poses.
    force(me, slot, velocity, others): the wanted velocity (2,) [m/s] of a follower at (2,) whose slot at (2,) moves
    with a velocity (2,), while others (m, 2) are in its way.
    way: points (2,) in the frame in which the leader starts at its own pose.
    Raises ValueError for a team of another size.
    """
    if team.n != 1 + len(SLOTS):
        raise ValueError(f"a triangle has a leader and {len(SLOTS)} followers, but the team has {team.n} robots")
    beliefs, pilot = [_belief(estimator, team)], _Pilot(_belief(estimator, team)[0], force, way)
    path, odometry, looks = [team.poses], [], []  # type: tuple[list, list, list]
    while len(looks) < steps and not (pilot.arrived and len(looks) > 51):
        odometry.append(team.drive(pilot(beliefs[-1][0])))
        looks.append(team.look())
        path.append(team.poses)
        if estimator is not None:
            estimator.predict(odometry[-1])
            estimator.update(looks[-1])
        beliefs.append(_belief(estimator, team))
    truth = np.array(path)
    errors = [_from_slots(poses, heading) for poses, heading in zip(truth, lagging(truth[:, 0, 2]))]
    return FormationRun(
        recorded(DT, odometry, path, looks, name),
        np.array([x for x, _ in beliefs]),
        np.array(errors),
        tuple(pilot.corners),
        not pilot.way,
        _least_distance(truth[..., :2]),
        None if estimator is None else np.array([P for _, P in beliefs]),
    )


def _belief(estimator, team):
    if estimator is None:
        return team.poses, None
    x = np.array(as_numbers(estimator.x, "the estimator's x"))
    if x.shape != (team.n, 3) or not np.isfinite(x).all():
        raise ValueError(f"the estimator's x must be finite poses ({team.n}, 3) of the team, but it is {x!r}")
    return x, np.array(as_covariance(estimator.P, "the estimator's P", x.size))


class _Pilot:
    """Called with the believed poses (n, 3) of a step, it gives the commands (n, 2) of leader and followers.

    corners: the steps at whose beginning the leader began to turn;  arrived: whether it stands at its last way point,
    with all followers in their slots.
    """

    def __init__(self, x, force, way):
        self.heading, self.force, self.way = x[0, 2], force, list(way)
        self.step, self.corners, self.arrived = 0, [], False

    def __call__(self, x):
        self.step += 1
        before, self.heading = self.heading, self.heading + BLEND * wrap(x[0, 2] - self.heading)
        wanted, rate = slots(x[0], self.heading), (self.heading - before) / DT
        worst = np.linalg.norm(x[1:, :2] - wanted, axis=1).max()
        leader = self._lead(x[0], worst)
        self.arrived = not self.way and not leader[0] and worst < FORMED
        ahead = leader[0] * np.array([np.cos(x[0, 2]), np.sin(x[0, 2])])
        arms = wanted - x[0, :2]
        velocities = ahead + rate * np.stack([-arms[:, 1], arms[:, 0]], axis=-1)
        return np.array([leader, *(self._follow(x, i, wanted[i - 1], velocities[i - 1]) for i in range(1, len(x)))])

    def _lead(self, pose, worst):
        """The leader's command: slower, the farther the worst follower is from its slot [m]; it turns on the spot."""
        if not self.way:
            return np.zeros(2)
        dx, dy = self.way[0] - pose[:2]
        off = wrap(np.arctan2(dy, dx) - pose[2])
        if np.hypot(dx, dy) < 0.1:
            self.way.pop(0)
            self.corners += [self.step] * bool(self.way)
            return np.zeros(2)
        if abs(off) > 0.3:
            return np.array([0.0, np.clip(off / DT, -TURN / 2, TURN / 2)])
        pace = CRUISE * np.clip(1.2 - worst / 0.6, 0.1, 1.0)
        return np.array([pace, np.clip(off / (2 * DT), -TURN, TURN)])

    def _follow(self, x, i, slot, velocity):
        me, others = x[i, :2], np.delete(x[:, :2], i, axis=0)
        return steer(x[i], as_point(self.force(me, _within_reach(me, slot), velocity, others), "what force gives"))


def _within_reach(me, slot):
    """The slot, or a point on the way to it: a slot far away must not pull harder than another robot pushes."""
    away = slot - me
    return me + away * min(1.0, REACH / max(np.hypot(*away), 1e-9))


def _from_slots(poses, heading):
    """(n-1,) [m]"""
    return np.linalg.norm(poses[1:, :2] - slots(poses[0], heading), axis=1)


def _least_distance(places):
    """[m] of two robots at any step, by their places (N+1, n, 2)."""
    apart = np.linalg.norm(places[:, :, None] - places[:, None], axis=3)
    return float(apart[:, *np.triu_indices(places.shape[1], 1)].min())


def steer(pose: Pose, velocity: Point) -> Array:
    """Command (forward velocity [m/s], turn rate [rad/s]) of a robot on wheels that should move at `velocity` (2,)."""
    speed = np.hypot(*velocity)
    if speed < 0.01:
        return np.zeros(2)
    off = wrap(np.arctan2(velocity[1], velocity[0]) - pose[2])
    return np.array([min(speed, FASTEST) * max(np.cos(off), 0.0), np.clip(2.0 * off, -2 * TURN, 2 * TURN)])


START = ((0, 0, 0), (-1.8, 1.6, 0.3), (-2.0, -1.5, -0.2))
CROSSING = ((0, 0, 0), (-1.8, -1.6, 0.3), (-2.0, 1.5, -0.2))  # each follower starts on the other's side


def triangle(rng: Seed = None, start: ArrayLike = START, **more: Any) -> Team:
    """S4: the Team of a leader and two followers, which see what is ahead; start (3, 3): their poses."""
    return Team(start, sees=[(1, 0), (2, 0), (1, 2), (2, 1)], rng=rng, **more)


WAY = [(4.0, 0.0), (4.0, -4.0), (0.0, -4.0)]  # two turns of 90 degrees, clockwise (the paper's figure 7)
