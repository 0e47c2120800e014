"""A leader and its followers: who should be where, and a run in which they try to be."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..geometry import Array, Covariances, Point, Points, Pose, Poses, Seed, transform, wrap
from ..validation import as_covariance, as_numbers, as_point
from .log import TeamLog, recorded
from .world import DT, TURN, Team

# [m] where the followers should be, ahead of the leader and to its left.
TRIANGLE = np.array([[-1.1, 0.9], [-1.1, -0.9]])
COLUMN = np.array([[-1.2, 0.0], [-2.4, 0.0]])
ABREAST = np.array([[0.0, 1.2], [0.0, -1.2]])
CRUISE = 0.25  # [m/s] of the leader at best
SLOW_HEADING = 1.5  # [s] by which the formation's heading lags behind the leader's
BLEND = 1 - np.exp(-DT / SLOW_HEADING)  # by which it comes nearer in a step
REACH = 0.3  # [m] a slot farther away pulls no harder than one at this distance
FORMED = 0.15  # [m] every follower this near to its slot: the formation stands
SETTLE = 9.0  # [s] in which what a turn has stirred up dies away


@dataclass(frozen=True)
class Rules:
    """How a follower drives.

    slot_velocity(arm, velocity, rate): how the slot moves (2,) [m/s] that lies at the arm (2,) [m] from a leader with
    a velocity (2,) [m/s], while the formation turns at the rate [rad/s];
    force(me, slot, velocity, others): the wanted velocity (2,) [m/s] of a follower at (2,) whose slot at (2,) moves
    with a velocity (2,), while others (m, 2) are in its way;
    steer(pose, velocity): the command (2,) [m/s, rad/s] of a robot at the pose (3,) that should have a velocity (2,).
    """

    slot_velocity: Callable[[Point, Point, float], Point]
    force: Callable[[Point, Point, Point, Points], Point]
    steer: Callable[[Pose, Point], Array]


@dataclass(frozen=True)
class FormationRun:
    """A TeamLog with what the robots believed, poses (N+1, n, 3), and how the formation held.

    errors (N+1, n-1) [m] each follower's distance from its slot, by the true poses;  corners: the steps in
    which the leader began to turn;  finished: whether it came to its last way point;  least [m] the smallest
    distance of two robots;  covariances (N+1, 3n, 3n): of what they believed, or None;  shape (n-1, 2): see `run`.
    """

    log: TeamLog
    believed: Poses
    errors: Array
    corners: tuple
    finished: bool
    least: float
    covariances: Covariances | None = None
    shape: Points = field(default_factory=lambda: TRIANGLE)

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

    def sight(self, i: int, j: int) -> float:
        """The share of all steps in which robot i sees robot j."""
        return int(np.sum(self.log.logs[i].seen_id == j)) / len(self.log)

    def recoveries(self) -> Array:
        """(corners,) seconds from each corner until the formation stands again."""
        ends = [*self.corners[1:], len(self.error)]
        return np.array([_after(self.error[a:b]) for a, b in zip(self.corners, ends)])

    @property
    def rms(self) -> float:
        """[m] root mean square distance from the slots, over all followers, while the leader goes straight ahead.

        The SETTLE seconds after the formation first stands and after each corner do not count.
        """
        return float(np.sqrt(np.mean(self.each_rms**2)))

    @property
    def each_rms(self) -> Array:
        """(m,) [m] the rms of each of m followers."""
        calm = np.ones(len(self.errors), dtype=bool)
        calm[: round((self.formed + SETTLE) / DT) if self.formed >= 0 else None] = False
        for corner in self.corners:
            calm[corner : corner + round(SETTLE / DT)] = False
        if not calm.any():
            return np.full(self.errors.shape[1], np.nan)
        return np.sqrt(np.mean(self.errors[calm] ** 2, axis=0))


def _seconds(good):
    return float(good.argmax() * DT) if good.any() else np.nan


def _after(error):
    """Seconds until the error is below FORMED for good; NaN if it never is."""
    bad = np.flatnonzero(error > FORMED)
    if not len(bad):
        return 0.0
    return float((bad[-1] + 1) * DT) if bad[-1] + 1 < len(error) else np.nan


def slots(leader: Pose, heading: float, offsets: Points = TRIANGLE) -> Points:
    """Where the followers should be (n, 2) [m], for a leader at (2,) and the formation's heading [rad]."""
    return transform(offsets, heading, leader[:2])


def lagging(heading: Array) -> Array:
    """The formation's heading (N+1,) [rad], which lags behind the leader's (N+1,): it is what the slots go by."""
    lags = [heading[0]]
    for now in heading[1:]:
        lags.append(lags[-1] + BLEND * wrap(now - lags[-1]))
    return np.array(lags)


def run(
    team: Team, estimator: Any, rules: Rules, way: Sequence, shape: Points = TRIANGLE, steps: int = 900
) -> FormationRun:
    """Drive a leader (robot 0) through the way points, followers by `rules`, all in the estimated frame.

    estimator: has predict(u (n, 3)), update(seen), x (n, 3), P (3n, 3n); None: the followers know the true poses.
    way: points (2,) in the frame in which the leader starts at its own pose.
    shape (n-1, 2): the followers' slots, ahead of the leader and to its left [m].
    Raises ValueError for a team of another size.
    """
    if team.n != 1 + len(shape):
        raise ValueError(f"the shape has a leader and {len(shape)} followers, but the team has {team.n} robots")
    beliefs, pilot = [_belief(estimator, team)], _Pilot(_belief(estimator, team)[0], rules, way, shape)
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
    errors = [_from_slots(poses, heading, shape) for poses, heading in zip(truth, lagging(truth[:, 0, 2]))]
    return FormationRun(
        recorded(DT, odometry, path, looks, "a formation"),
        np.array([x for x, _ in beliefs]),
        np.array(errors),
        tuple(pilot.corners),
        not pilot.way,
        _least_distance(truth[..., :2]),
        None if estimator is None else np.array([P for _, P in beliefs]),
        shape,
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

    def __init__(self, x, rules, way, shape):
        self.heading, self.rules, self.way, self.shape = x[0, 2], rules, list(way), shape
        self.step, self.corners, self.arrived = 0, [], False

    def __call__(self, x):
        self.step += 1
        before, self.heading = self.heading, self.heading + BLEND * wrap(x[0, 2] - self.heading)
        wanted, rate = slots(x[0], self.heading, self.shape), (self.heading - before) / DT
        worst = np.linalg.norm(x[1:, :2] - wanted, axis=1).max()
        leader = self._lead(x[0], worst)
        self.arrived = not self.way and not leader[0] and worst < FORMED
        ahead = leader[0] * np.array([np.cos(x[0, 2]), np.sin(x[0, 2])])
        return np.array([leader, *(self._follow(x, i, slot, ahead, rate) for i, slot in enumerate(wanted, 1))])

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

    def _follow(self, x, i, slot, ahead, rate):
        me, others = x[i, :2], np.delete(x[:, :2], i, axis=0)
        velocity = as_point(self.rules.slot_velocity(slot - x[0, :2], ahead, rate), "what slot_velocity gives")
        wanted = as_point(self.rules.force(me, _within_reach(me, slot), velocity, others), "what force gives")
        return as_point(self.rules.steer(x[i], wanted), "what steer gives")


def _within_reach(me, slot):
    """The slot, or a point on the way to it: a slot far away must not pull harder than another robot pushes."""
    away = slot - me
    return me + away * min(1.0, REACH / max(np.hypot(*away), 1e-9))


def _from_slots(poses, heading, shape):
    """(n-1,) [m]"""
    return np.linalg.norm(poses[1:, :2] - slots(poses[0], heading, shape), axis=1)


def _least_distance(places):
    """[m] of two robots at any step, by their places (N+1, n, 2)."""
    apart = np.linalg.norm(places[:, :, None] - places[:, None], axis=3)
    return float(apart[:, *np.triu_indices(places.shape[1], 1)].min())


START = ((0, 0, 0), (-1.8, 1.6, 0.3), (-2.0, -1.5, -0.2))
CROSSING = ((0, 0, 0), (-1.8, -1.6, 0.3), (-2.0, 1.5, -0.2))  # each follower starts on the other's side


def three(rng: Seed = None, start: ArrayLike = START, **more: Any) -> Team:
    """S4: the Team of a leader and two followers, which see what is ahead; start (3, 3): their poses."""
    return Team(start, **{"sees": [(1, 0), (2, 0), (1, 2), (2, 1)], "rng": rng, **more})


WAY = [(4.0, 0.0), (4.0, -4.0), (0.0, -4.0)]  # two turns of 90 degrees, clockwise (the paper's figure 7)
