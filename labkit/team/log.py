"""What a team of robots did and saw of one another: one Log for each, with the same steps."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from numbers import Integral, Real
from typing import ClassVar

import numpy as np

from ..checks.feedback import FilterError
from ..geometry import Array, Poses, Seed, compose
from ..history import History
from ..log import Log
from ..world import Map
from .warning import warn_of

Reading = tuple[int, int, Array]
"""(observer, target, (2,) range [m] and bearing [rad]), robots counted from 0."""


@dataclass(frozen=True)
class TeamLog:
    """Logs of n robots that share their times; robot i is the one with the id `ids[i]`.

    Each log has sensor 'rb', frame 'robot', controls (N, 3): its odometry of each step, ahead [m], to the left
    [m], turned [rad]; what it saw are other robots, by their ids.
    Raises ValueError for logs that do not fit together.
    """

    logs: tuple
    ids: tuple
    name: str = "simulated team"

    fields: ClassVar = ("x", "P")  # where a filter for such a log has its mean and its covariance

    def __post_init__(self):
        if len(self.logs) < 2 or len(self.logs) != len(self.ids):
            raise ValueError(
                f"a team needs two logs or more and an id for each, but has {len(self.logs)} and {len(self.ids)}"
            )
        if len(set(self.ids)) != len(self.ids):
            raise ValueError(f"ids must differ, but they are {list(self.ids)}")
        first = self.logs[0]
        if not len(first):
            raise ValueError("a team's logs must have at least one step")
        for i, log in zip(self.ids, self.logs):
            if len(log) != len(first) or np.abs(log.times - first.times).max() > 0.1 * first.dt:
                raise ValueError(
                    f"the clock of robot {i} does not run with that of robot {self.ids[0]}: their times differ"
                )
            if log.controls.shape[1] != 3 or log.frame != "robot" or log.sensor != "rb":
                raise ValueError(
                    f"the log of robot {i} must hold odometry (N, 3), and ranges and bearings in its own frame"
                )
            strange = set(log.seen_id.tolist()) - set(self.ids) | ({i} & set(log.seen_id.tolist()))
            if strange:
                raise ValueError(f"robot {i} saw a robot {min(strange)!r} that is no other member of the team")

    def __len__(self) -> int:
        return len(self.logs[0])

    @property
    def n(self) -> int:
        """How many robots."""
        return len(self.ids)

    @property
    def times(self) -> Array:
        """(N+1,) [s]."""
        return self.logs[0].times

    @property
    def controls(self) -> Array:
        """(N, n, 3) odometry of each step and robot [m, m, rad]."""
        return np.stack([log.controls for log in self.logs], axis=1)

    @property
    def truth(self) -> Poses | None:
        """(N+1, n, 3) true poses in the hall, or None."""
        if any(log.truth is None for log in self.logs):
            return None
        return np.stack([log.truth for log in self.logs], axis=1)

    def measurements(self) -> list[list[Reading]]:
        """N lists of readings, fresh at each call."""
        place = {name: i for i, name in enumerate(self.ids)}
        lists: list[list[Reading]] = [[] for _ in range(len(self))]
        for i, log in enumerate(self.logs):
            for k, name, z in zip(log.seen_step.tolist(), log.seen_id.tolist(), log.seen.copy()):
                lists[k].append((i, place[name], z))
        return lists

    @property
    def shape(self) -> tuple[int, int]:
        """(n, 3): of a filter's mean."""
        return self.n, 3

    def judge(self, history: History) -> None:
        """Raise FilterError for a variance below zero; a FrameWarning where most readings contradict the estimate."""
        if (bad := np.diagonal(history.P, axis1=1, axis2=2).min(axis=1) < -1e-9).any():
            step = f"After step {int(bad.argmax())} of {len(self)}"
            raise FilterError(f"{step} a variance in your filter's P is negative.")
        warn_of(history, self.measurements(), self.ids)


def dead_reckoned(log: TeamLog, start: Poses | None = None) -> Poses:
    """Poses (N+1, n, 3) by odometry alone, from the poses `start` (n, 3), by default the true ones."""
    poses = [np.array(np.asarray(log.truth)[0] if start is None else start, dtype=float)]
    for u in log.controls:
        poses.append(compose(poses[-1], u))
    return np.array(poses)


def recorded(dt: float, odometry: Sequence, truth: Sequence, looks: Sequence[list[Reading]], name: str) -> TeamLog:
    """The TeamLog of a run with steps of dt [s]: odometry (N, n, 3), truth (N+1, n, 3), and what each one saw.

    looks: N lists of readings.
    """
    u, poses = np.array(odometry), np.array(truth)
    members = range(poses.shape[1])
    times = dt * np.arange(len(poses))
    logs = [_member(times, u[:, i], poses[:, i], _seen_by(i, looks), f"{name}, robot {i}") for i in members]
    return TeamLog(tuple(logs), tuple(members), name)


def _seen_by(member, looks):
    return [(k, j, *z) for k, seen in enumerate(looks) for i, j, z in seen if i == member]


def _member(times, controls, truth, seen, name):
    return Log(
        times.copy(),
        controls.copy(),
        np.array([s[0] for s in seen], dtype=int),
        np.array([s[1] for s in seen]),
        np.array([s[2:] for s in seen], dtype=float).reshape(-1, 2),
        Map(),
        sensor="rb",
        frame="robot",
        truth=truth.copy(),
        name=name,
    )


def of_logs(logs: Sequence[Log], ids: Sequence | None = None, name: str = "team") -> TeamLog:
    """A TeamLog of logs of real robots: what they share of their times, and only what they saw of each other.

    logs: Logs with odometry, say from `mrclam.with_odometry(mrclam.load(robot, robots=True))`, of the same rate.
    """
    ids = tuple(range(1, len(logs) + 1)) if ids is None else tuple(ids)
    if len(logs) < 2 or len(ids) != len(logs):
        raise ValueError(f"a team needs two logs or more and an id for each, but has {len(logs)} and {len(ids)}")
    rate = 1 / logs[0].dt
    first = max(round(log.times[0] * rate) for log in logs)
    last = min(round(log.times[-1] * rate) for log in logs)
    if last <= first:
        raise ValueError("the logs share no time")
    firsts = [first - round(log.times[0] * rate) for log in logs]
    cut = [_cut(log, a, a + last - first, [j for j in ids if j != i]) for i, log, a in zip(ids, logs, firsts)]
    return TeamLog(tuple(cut), ids, name)


def later(log: TeamLog, first: int, last: int | None = None) -> TeamLog:
    """The TeamLog from step `first` on, to step `last` if told.  Raises ValueError if there is no such step."""
    if not 0 <= first < len(log):
        raise ValueError(f"first must be a step from 0 to {len(log) - 1}, but it is {first}")
    cut = [_cut(one, first, last or len(one), [j for j in log.ids if j != i]) for i, one in zip(log.ids, log.logs)]
    return replace(log, logs=tuple(cut))


def _cut(log, a, b, others):
    """Steps a to b of one member's log, with what it saw of these others."""
    here = (log.seen_step >= a) & (log.seen_step < b) & np.isin(log.seen_id, others)
    return Log(
        log.times[a : b + 1].copy(),
        log.controls[a:b].copy(),
        log.seen_step[here] - a,
        log.seen_id[here],
        log.seen[here].copy(),
        Map(),
        sensor="rb",
        frame="robot",
        truth=None if log.truth is None else log.truth[a : b + 1].copy(),
        name=log.name,
    )


def delayed(log: TeamLog, steps: int = 0, lost: float = 0.0, rng: Seed = None) -> TeamLog:
    """The same run with readings that arrive `steps` steps late, and of which the share `lost` never arrives.

    rng: a numpy Generator, or a seed for one.  Raises ValueError for a delay or a share that cannot be.
    """
    if not (isinstance(steps, Integral) and steps >= 0):
        raise ValueError(f"steps must be a whole number, 0 or more, but it is {steps!r}")
    if not (isinstance(lost, Real) and 0 <= lost <= 1):
        raise ValueError(f"lost must be a share from 0 to 1, but it is {lost!r}")
    rng = np.random.default_rng(rng)
    logs = []
    for one in log.logs:
        arrives = one.seen_step + int(steps)
        here = (arrives < len(one)) & (rng.random(len(arrives)) >= lost)
        logs.append(replace(one, seen_step=arrives[here], seen_id=one.seen_id[here], seen=one.seen[here]))
    return replace(log, logs=tuple(logs), name=f"{log.name}, {steps} steps late")
