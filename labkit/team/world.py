"""Robots on wheels in an empty hall that see one another with laser scanners."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike

from ..geometry import Angle, Array, Motion, Seed, compose, wrap
from .log import Reading, TeamLog, recorded

DT = 0.2  # [s] the scanners turn five times a second
SPEED, TURN = 0.3, 0.6  # [m/s], [rad/s] of a robot on its way
RADIUS = 0.25  # [m] of a robot, which hides what is behind it


@dataclass(frozen=True)
class TeamNoise:
    """How good odometry and laser of a team are, as standard deviations; a filter may be told these too.

    walk, side  [m] along and across the way, of one metre driven;  turn [rad] of one metre and of one radian turned
    scale, turn_scale, drift  systematic, drawn once for each robot: fraction of the way, fraction of the turn, and
                [rad] turned by itself in each metre; no filter is told these
    range       [m];  bearing [rad];  lateral [m] by which the point that is seen lies beside the robot's middle

    Source of the figures: a SICK scanner and Pioneer robots, as in the paper's section 2, and the scatter of its
    figures 3 and 4.  Raises ValueError, with the argument's name, for numbers that cannot be.
    """

    walk: float = 0.01
    side: float = 0.005
    turn: float = 0.01
    scale: float = 0.02
    turn_scale: float = 0.01
    drift: float = np.deg2rad(0.15)
    range: float = 0.054
    bearing: float = np.deg2rad(0.75)
    lateral: float = 0.05

    def __post_init__(self):
        for name, value in vars(self).items():
            if not (isinstance(value, Real) and 0 <= value <= 10):
                raise ValueError(f"{name} must be a number from 0 to 10, but it is {value!r}")

    def of_bearing(self, r: float | Array) -> float | Array:
        """Standard deviation [rad] of a bearing at the range r [m], a number or (...,)."""
        return np.hypot(self.bearing, self.lateral / np.maximum(r, 0.1))

    def of_step(self, u: Motion) -> Array:
        """Standard deviations (..., 3) [m, m, rad] of the odometry u (..., 3) of one step."""
        u = np.asarray(u, dtype=float)
        way, turned = np.hypot(u[..., 0], u[..., 1]), np.abs(u[..., 2])
        return np.stack(
            [self.walk * np.sqrt(way), self.side * np.sqrt(way), self.turn * np.sqrt(way + turned)], axis=-1
        )


class Team:
    """Robots that drive, and look at each other.

    poses (n, 3): where they start, world frame.  sees: pairs (observer, target) of positions in the list, by default
    all.  fov: [rad] how wide scanners look ahead, of all or of each (n,).  reach: [m].
    spurious: (x, y, width, height, probability) of a region of the hall in which a reading is false with that
    probability.  dark: (first, last) steps without sight.  rng: a numpy Generator, or a seed for one.
    Raises ValueError, with the argument's name, for what cannot be.
    """

    def __init__(
        self,
        poses: ArrayLike,
        noise: TeamNoise | None = None,
        sees: Iterable[tuple[int, int]] | None = None,
        fov: Angle = np.pi,
        reach: float = 15.0,
        spurious: tuple | None = None,
        dark: tuple[int, int] | None = None,
        rng: Seed = None,
    ):
        self.poses = np.array(poses, dtype=float)
        if self.poses.ndim != 2 or self.poses.shape[1] != 3 or len(self.poses) < 2 or not np.isfinite(self.poses).all():
            raise ValueError(
                f"poses must be finite and have the shape (n, 3) with n of 2 or more, not {self.poses.shape}"
            )
        apart = np.linalg.norm(self.poses[:, None, :2] - self.poses[None, :, :2], axis=2)
        if (apart[np.triu_indices(len(self.poses), 1)] < RADIUS).any():
            raise ValueError("poses put two robots at one place")
        n = len(self.poses)
        pairs = [(i, j) for i in range(n) for j in range(n) if i != j] if sees is None else list(sees)
        if any(not (0 <= i < n and 0 <= j < n and i != j) for i, j in pairs):
            raise ValueError(f"sees must name two different robots from 0 to {n - 1} in each pair")
        self.noise, self.rng = noise or TeamNoise(), np.random.default_rng(rng)
        if np.shape(fov) not in ((), (n,)) or not (np.asarray(fov) > 0).all() or not reach > 0:
            raise ValueError(
                f"fov must be an angle, or one for each of the {n} robots, and reach a distance; both more than 0"
            )
        if spurious is not None and len(spurious) != 5:
            raise ValueError("spurious must be (x, y, width, height, probability)")
        self.sees, self.fov = pairs, np.broadcast_to(np.asarray(fov, dtype=float), n)
        self.reach, self.spurious, self.dark = reach, spurious, dark
        self.bias = self.rng.standard_normal((n, 3)) * [self.noise.scale, self.noise.turn_scale, self.noise.drift]
        self.step = 0

    @property
    def n(self) -> int:
        """How many robots."""
        return len(self.poses)

    def drive(self, commands: Array) -> Motion:
        """One step with commands (n, 2), forward velocity [m/s] and turn rate [rad/s]; the odometry (n, 3) of it."""
        way, turned = (np.asarray(commands, dtype=float) * DT).T
        u = np.stack([way * np.cos(turned / 2), way * np.sin(turned / 2), turned], axis=-1)
        self.poses = compose(self.poses, u)
        self.step += 1
        scale, turn_scale, drift = self.bias.T
        told = u * np.stack([1 + scale, 1 + scale, 1 + turn_scale], axis=-1)
        told[:, 2] += drift * abs(way)
        return told + self.noise.of_step(u) * self.rng.standard_normal(u.shape)

    def look(self) -> list[Reading]:
        """What is seen now: a list of (observer, target, (2,) range [m] and bearing [rad])."""
        if self.dark and self.dark[0] <= self.step < self.dark[1]:
            return []
        seen = []
        for i, j in self.sees:
            dx, dy = self.poses[j, :2] - self.poses[i, :2]
            r, bearing = np.hypot(dx, dy), wrap(np.arctan2(dy, dx) - self.poses[i, 2])
            if r == 0 or r > self.reach or abs(bearing) > self.fov[i] / 2 or self._hidden(i, j, r):
                continue
            z = np.array([r, bearing]) + self.rng.standard_normal(2) * [self.noise.range, self.noise.of_bearing(r)]
            if self.spurious and self._false(j):
                z = np.array([self.rng.uniform(0.5, 8.0), self.rng.uniform(-1, 1) * self.fov[i] / 2])
            seen.append((i, j, np.array([max(z[0], 0.05), wrap(z[1])])))
        return seen

    def _hidden(self, i, j, r):
        """Whether a third robot stands between i and j."""
        way = (self.poses[j, :2] - self.poses[i, :2]) / r
        others = np.delete(self.poses[:, :2], [i, j], axis=0) - self.poses[i, :2]
        along = others @ way
        across = abs(others @ np.array([-way[1], way[0]]))
        return bool(((along > 0) & (along < r) & (across < RADIUS)).any())

    def _false(self, j):
        x, y, width, height, probability = self.spurious
        px, py = self.poses[j, :2]
        return x <= px <= x + width and y <= py <= y + height and self.rng.random() < probability

    def record(self, control: Callable[["Team"], Array], steps: int, name: str = "simulated team") -> TeamLog:
        """A TeamLog of `steps` steps; control(team) gives the commands (n, 2) of each."""
        if steps < 1:
            raise ValueError(f"a run needs at least one step, but steps is {steps}")
        truth, odometry, looks = [self.poses], [], []
        for _ in range(steps):
            odometry.append(self.drive(control(self)))
            truth.append(self.poses)
            looks.append(self.look())
        return recorded(DT, odometry, truth, looks, name)


class Route:
    """Commands for a team: each robot drives through its way points, and stands where it has none left.

    ways: {robot: [(x, y), ...]};  start: {robot: step at which it sets off}.
    """

    def __init__(self, ways: Mapping[int, Sequence], start: dict[int, int] | None = None):
        self.ways, self.start = {i: list(way) for i, way in ways.items()}, start or {}

    def __call__(self, team: Team) -> Array:
        """Commands (n, 2) of a step, forward velocity [m/s] and turn rate [rad/s]; ValueError for a robot too many."""
        commands = np.zeros((team.n, 2))
        for i, way in self.ways.items():
            if not 0 <= i < team.n:
                raise ValueError(f"there is a way for robot {i}, but the team has robots 0 to {team.n - 1}")
            if team.step < self.start.get(i, 0):
                continue
            while way and np.hypot(*(way[0] - team.poses[i, :2])) < 0.05:
                way.pop(0)
            if way:
                dx, dy = way[0] - team.poses[i, :2]
                off = wrap(np.arctan2(dy, dx) - team.poses[i, 2])
                turn = np.clip(off / DT, -TURN, TURN)
                ahead = SPEED if abs(off) < 0.15 else 0.0
                commands[i] = min(ahead, np.hypot(dx, dy) / DT), turn
        return commands
