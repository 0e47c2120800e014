"""A legged robot that walks about on the field, turns its head, and sees some of the landmarks."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..geometry import Array, Seed, transform, wrap
from ..log import Log
from ..validation import as_count
from ..world import Landmark
from .field import FIELD, Field, is_goal
from .noise import Noise, as_noise

DT = 0.1  # [s] one step: one camera image in three, and the pace of the paper's motion commands
SPEED = 0.25  # [m/s] of a walk
TURN = 0.6  # [rad/s] at most
FOV = np.deg2rad(56.9)  # the ERS-7 camera's horizontal field of view (Sony's data sheet)
PAN = np.deg2rad(75)  # [rad] how far the head turns to either side ...
SWEEP = 3.0  # [s] ... and back again, in this time


class Sighting(Landmark):
    """What a camera reports of one landmark: p = (range [m], bearing [rad] from the robot's heading), id.

    complete: whether it was wholly in view; if only partly, its bearing is worth little.
    """

    __slots__ = ("complete",)

    def __init__(self, p: ArrayLike, id: Any, complete: bool = True):
        super().__init__(p, id)
        self.complete = bool(complete)

    def __repr__(self):
        return super().__repr__()[:-1].replace("Landmark", "Sighting", 1) + f", complete={self.complete})"


@dataclass(frozen=True)
class FieldLog(Log):
    """A Log of a legged robot: sensor 'rb', frame 'robot', controls (N, 3), truth (N+1, 3).

    complete (M,) whether each landmark was wholly in view;  pan (N,) [rad] where the head looked;
    noise    what the robot was made with;  field: where it walked;
    kidnapped: the steps in which somebody carried it away.
    """

    complete: NDArray[np.bool_] | None = None
    pan: Array | None = None
    noise: Noise | None = None
    field: Field = FIELD
    kidnapped: tuple = ()

    def __post_init__(self):
        super().__post_init__()
        if self.complete is None or len(self.complete) != len(self.seen):
            raise ValueError("complete must say of each of the sightings whether it was wholly in view")
        if self.pan is not None and len(self.pan) != len(self):
            raise ValueError(f"pan must have an angle for each of the {len(self)} steps, but it has {len(self.pan)}")
        for value in (self.complete, self.pan):
            if value is not None:
                value.setflags(write=False)
        strange = set(self.seen_id.tolist()) - set(self.map.ids)
        if strange:
            raise ValueError(f"seen_id names a landmark that is not in the map: {min(strange)!r}")

    def seen_by(self, *args: Any, **options: Any) -> Log:
        """Raises ValueError: nothing tells what another camera would have seen."""
        raise ValueError("a walk on the field cannot be seen by another sensor: record one of a robot with other noise")

    def measurements(self) -> list[list[Landmark]]:
        """N lists of Sighting, fresh at each call."""
        lists = super().measurements()
        complete = iter(np.asarray(self.complete).tolist())
        for seen in lists:
            seen[:] = [_sighting(lm, next(complete)) for lm in seen]
        return lists


def _sighting(landmark, complete):
    sighting = object.__new__(Sighting)
    sighting.p, sighting.id, sighting.complete = landmark.p, landmark.id, complete
    return sighting


class LeggedRobot:
    """Walks from one random place to the next, in any direction, and looks about on the way.

    noise: a Noise or the name of a preset ('paper', 'real', 'harsh').  field: a Field.
    pose:  (3,) start (x, y, heading) [m, m, rad], random unless given.
    rng:   a numpy Generator, or a seed for one: the same seed gives the same runs.
    """

    def __init__(
        self, noise: Noise | str = "real", field: Field = FIELD, pose: ArrayLike | None = None, rng: Seed = None
    ):
        self.noise, self.field = as_noise(noise), field
        self.rng = np.random.default_rng(rng)
        self.pose = self._anywhere() if pose is None else _as_pose(pose, field)

    def record(self, steps: int = 300, kidnap: ArrayLike = (), to: ArrayLike | None = None) -> FieldLog:
        """A FieldLog of `steps` steps from where the robot stands (which it does not change).

        kidnap: the step, or steps, at whose beginning the robot is carried to another place, at least 1.5 m
        away, or to the pose `to` (3,).  Its odometry does not notice.
        """
        kidnap = np.array(
            [as_count(k, "kidnap", 0) for k in np.atleast_1d(np.asarray(kidnap, dtype=float)).tolist()], dtype=int
        )
        steps = as_count(steps, "steps")
        if len(kidnap) and not (0 <= kidnap.min() and kidnap.max() < steps):
            raise ValueError(f"kidnap must name steps from 0 to {steps - 1}, but it is {kidnap.tolist()}")
        to = None if to is None else _as_pose(to, self.field)
        truth, moves = self._walk(steps, set(kidnap.tolist()), to)
        times = DT * np.arange(steps + 1.0)
        pan = PAN * _triangle(times[1:] / SWEEP)
        return FieldLog(
            times,
            self._odometry(moves),
            **self._look(truth[1:], pan),
            map=self.field.map,
            sensor="rb",
            frame="robot",
            truth=truth,
            name="a walk on the field",
            pan=pan,
            noise=self.noise,
            field=self.field,
            kidnapped=tuple(kidnap.tolist()),
        )

    def _anywhere(self):
        x, y = self.rng.uniform(-1, 1, 2) * (self.field.half - self.field.margin)
        return np.array([x, y, self.rng.uniform(-np.pi, np.pi)])

    def _walk(self, steps, kidnap, to):
        """True poses (steps+1, 3), and the motions (steps, 3) in the robot's frame between them."""
        pose, (goal, ball) = self.pose, (self._anywhere()[:2], self._anywhere()[:2])
        rest, truth, moves = 0, [pose], []
        for k in range(steps):
            if k in kidnap:
                pose = self._elsewhere(pose) if to is None else to
            away = goal - pose[:2]
            distance = np.hypot(*away)
            if distance < SPEED * DT and rest == 0:  # there: stand for up to a second, then go on
                goal, ball, rest = self._anywhere()[:2], self._anywhere()[:2], self.rng.integers(1, 11)
            rest = max(rest - 1, 0)
            step = away / max(distance, 1e-9) * (0.0 if rest else min(SPEED * DT, distance))
            facing = np.arctan2(*(ball - pose[:2])[::-1])
            turn = np.clip(wrap(facing - pose[2]), -TURN * DT, TURN * DT)
            moves.append([*transform(step, -pose[2]), turn])
            pose = np.array([*(pose[:2] + step), wrap(pose[2] + turn)])
            truth.append(pose)
        return np.array(truth), np.array(moves)

    def _elsewhere(self, pose):
        size = 2 * (self.field.half - self.field.margin)
        while True:
            other = self._anywhere()
            if np.hypot(*(other - pose)[:2]) >= min(1.5, np.hypot(*size) / 3):  # a small field has no place so far away
                return other

    def _odometry(self, moves):
        """What the legs report (N, 3) of the true motions."""
        noise = self.noise
        scale = 1 + noise.odometry_bias * self.rng.choice([-1, 1], 3)
        floor = np.repeat([noise.slip, noise.spin], [2, 1])
        return moves * scale + self._draw(moves.shape) * (noise.odometry * abs(moves) + floor)

    def _draw(self, shape):
        return self.rng.uniform(-1, 1, shape) if self.noise.uniform else self.rng.standard_normal(shape)

    def _look(self, poses, pan):
        """The measurement fields of a FieldLog."""
        noise, landmarks = self.noise, self.field.map
        offset = landmarks.positions - poses[:, None, :2]
        distance = np.hypot(offset[..., 0], offset[..., 1])
        bearing = wrap(np.arctan2(offset[..., 1], offset[..., 0]) - poses[:, 2:])
        goal = np.array([is_goal(lm) for lm in landmarks])
        # A goal seen from the side is narrow: what counts is its width across the line of sight.
        width = np.where(goal, self.field.goal * abs(offset[..., 0]) / distance, self.field.beacon)
        half, aside = np.arctan2(width / 2, distance), abs(wrap(bearing - pan[:, None]))
        hidden = self.rng.random(distance.shape) < noise.occlusion
        seen = (aside - half < FOV / 2) & ~hidden
        complete = aside + half <= FOV / 2

        error = self._draw((*distance.shape, 2))
        fraction = np.array([noise.of_range(lm) for lm in landmarks])
        scale = 1 + noise.range_bias * self.rng.choice([-1, 1])
        distance = distance * scale + (fraction * distance + noise.range_floor) * error[..., 0]
        bearing = bearing + np.where(complete, noise.bearing, noise.bearing_partial) * error[..., 1]

        ghost = self.rng.random(len(poses)) < noise.false_positives
        which = self.rng.integers(len(landmarks), size=len(poses))
        at = np.flatnonzero(ghost)[:, None], which[ghost][:, None]
        seen[at], complete[at] = True, True
        distance[at] = self.rng.uniform(0.3, 5.0, at[0].shape)
        bearing[at] = pan[at[0]] + self.rng.uniform(-FOV / 2, FOV / 2, at[0].shape)

        step, number = np.nonzero(seen)
        values = np.column_stack([np.maximum(distance[seen], 0.05), wrap(bearing[seen])])
        ids = np.array(landmarks.ids)
        return {"seen_step": step, "seen_id": ids[number], "seen": values, "complete": complete[seen]}


def _triangle(phase):
    """A triangle wave of period 1 between -1 and 1 that starts upward from 0."""
    return 1 - 4 * abs((phase - 0.25) % 1 - 0.5)


def _as_pose(value, field):
    try:
        pose = np.array(value, dtype=float).reshape(-1)
    except (TypeError, ValueError):
        pose = np.empty(0)
    if pose.shape != (3,) or not np.isfinite(pose).all():
        raise ValueError(f"a pose must be three finite numbers (x, y, heading), but it is {value!r}")
    if (abs(pose[:2]) > field.half).any():
        raise ValueError(f"the pose ({pose[0]:g}, {pose[1]:g}) is not on the field's carpet")
    return pose
