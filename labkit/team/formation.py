"""A leader and its followers: who should be where, and a run in which they try to be."""

from dataclasses import dataclass

import numpy as np

from ..geometry import transform, wrap
from .hall import DT, TURN, Team
from .log import TeamLog, recorded

SLOTS = np.array([[-1.1, 0.9], [-1.1, -0.9]])  # [m] behind the leader, to its left and right: a triangle
CRUISE, FASTEST = 0.25, 0.5  # [m/s] of the leader at best, of a follower at most
SLOW_HEADING = 1.5  # [s] by which the formation's heading lags behind the leader's
REACH = 0.3  # [m] a slot farther away pulls no harder than one at this distance
FORMED = 0.15  # [m] every follower this near to its slot: the formation stands
SETTLE = 9.0  # [s] in which what a turn has stirred up dies away


@dataclass(frozen=True)
class FormationRun:
    """A TeamLog with what the robots believed, poses (N+1, n, 3), and how the formation held.

    errors (N+1, n-1) [m] each follower's distance from its slot, by the true poses;  corners: the steps in
    which the leader began to turn;  finished: whether it came to its last way point;  least [m] the smallest
    distance of two robots;  covariances (N+1, 3n, 3n): of what they believed, or None.
    """

    log: TeamLog
    believed: np.ndarray
    errors: np.ndarray
    corners: tuple
    finished: bool
    least: float
    covariances: np.ndarray | None = None

    @property
    def error(self):
        """(N+1,) [m] of the follower that is farthest from its slot."""
        return self.errors.max(axis=1)

    @property
    def formed(self):
        """Seconds until the formation first stands; NaN if it never does."""
        return _seconds(self.error <= FORMED)

    def recoveries(self):
        """Seconds from each corner until the formation stands again."""
        ends = [*self.corners[1:], len(self.error)]
        return np.array([_after(self.error[a:b]) for a, b in zip(self.corners, ends)])

    @property
    def rms(self):
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


def slots(leader, heading, offsets=SLOTS):
    """Where the followers should be (n, 2) [m], for a leader at (2,) and the formation's heading [rad]."""
    return transform(offsets, heading, leader[:2])


def run(team, estimator, force, way, steps=900, name="a triangle"):
    """Drive a leader (robot 0) through the way points, followers by `force`, all in the estimated frame.

    estimator: has predict(u (n, 3)), update(seen), x (n, 3); None lets the followers know the true poses.
    force(me, slot, velocity, others): the wanted velocity (2,) [m/s] of a follower at (2,) whose slot at (2,) moves
    with a velocity (2,), while others (m, 2) are in its way.
    way: points (2,) in the frame in which the leader starts at its own pose.
    """
    n, way = team.n, list(way)
    if n != 1 + len(SLOTS):
        raise ValueError(f"a triangle has a leader and {len(SLOTS)} followers, but the team has {n} robots")
    x = team.poses if estimator is None else np.array(estimator.x)
    truth, believed, odometry, seen = [team.poses], [x], [], [[] for _ in range(n)]
    spread = [] if estimator is None else [np.array(estimator.P)]
    heading, true_heading = x[0, 2], team.poses[0, 2]
    corners, errors = [], [_from_slots(team.poses, true_heading)]
    blend = 1 - np.exp(-DT / SLOW_HEADING)
    for k in range(steps):
        before = heading
        heading = heading + blend * wrap(x[0, 2] - heading)
        rate = (heading - before) / DT
        wanted = slots(x[0], heading)
        worst = np.linalg.norm(x[1:, :2] - wanted, axis=1).max()
        commands = np.zeros((n, 2))
        if way:
            dx, dy = way[0] - x[0, :2]
            off = wrap(np.arctan2(dy, dx) - x[0, 2])
            pace = CRUISE * np.clip(1.2 - worst / 0.6, 0.1, 1.0)
            if np.hypot(dx, dy) < 0.1:
                way.pop(0)
                corners += [k + 1] * bool(way)
            elif abs(off) > 0.3:
                commands[0] = 0.0, np.clip(off / DT, -TURN / 2, TURN / 2)
            else:
                commands[0] = pace, np.clip(off / (2 * DT), -TURN, TURN)
        ahead = commands[0, 0] * np.array([np.cos(x[0, 2]), np.sin(x[0, 2])])
        for i in range(1, n):
            arm = wanted[i - 1] - x[0, :2]
            velocity = ahead + rate * np.array([-arm[1], arm[0]])
            others = np.delete(x[:, :2], i, axis=0)
            commands[i] = steer(
                x[i], np.asarray(force(x[i, :2], _within_reach(x[i, :2], wanted[i - 1]), velocity, others), dtype=float)
            )
        u = team.drive(commands)
        looks = team.look()
        if estimator is None:
            x = team.poses
        else:
            estimator.predict(u)
            estimator.update(looks)
            x = np.array(estimator.x)
            spread.append(np.array(estimator.P))
        odometry.append(u)
        truth.append(team.poses)
        believed.append(x)
        for i, j, z in looks:
            seen[i].append((k, j, *z))
        true_heading = true_heading + blend * wrap(team.poses[0, 2] - true_heading)
        errors.append(_from_slots(team.poses, true_heading))
        if not way and commands[0].any() == 0 and k > 50 and worst < FORMED:
            break
    truth = np.array(truth)
    apart = np.linalg.norm(truth[:, :, None, :2] - truth[:, None, :, :2], axis=3)[:, *np.triu_indices(n, 1)]
    return FormationRun(
        recorded(DT, odometry, truth, seen, name),
        np.array(believed),
        np.array(errors),
        tuple(corners),
        not way,
        float(apart.min()),
        np.array(spread) if spread else None,
    )


def _within_reach(me, slot):
    """The slot, or a point on the way to it: a slot far away must not pull harder than another robot pushes."""
    away = slot - me
    return me + away * min(1.0, REACH / max(np.hypot(*away), 1e-9))


def _from_slots(poses, heading):
    """(n-1,) [m]"""
    return np.linalg.norm(poses[1:, :2] - slots(poses[0], heading), axis=1)


def steer(pose, velocity):
    """Command (forward velocity [m/s], turn rate [rad/s]) of a robot with wheels that should move with `velocity` (2,)."""
    speed = np.hypot(*velocity)
    if speed < 0.01:
        return np.zeros(2)
    off = wrap(np.arctan2(velocity[1], velocity[0]) - pose[2])
    return np.array([min(speed, FASTEST) * max(np.cos(off), 0.0), np.clip(2.0 * off, -2 * TURN, 2 * TURN)])


START = ((0, 0, 0), (-1.8, 1.6, 0.3), (-2.0, -1.5, -0.2))
CROSSING = ((0, 0, 0), (-1.8, -1.6, 0.3), (-2.0, 1.5, -0.2))  # each follower starts on the other's side


def triangle(rng=None, start=START, **more):
    """S4: the Team of a leader and two followers, which see what is ahead of them."""
    return Team(start, sees=[(1, 0), (2, 0), (1, 2), (2, 1)], rng=rng, **more)


WAY = [(4.0, 0.0), (4.0, -4.0), (0.0, -4.0)]  # two turns of 90 degrees, clockwise (the paper's figure 7)
