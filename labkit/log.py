"""One recorded run of a robot, simulated or real."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from .checks.kinds import KINDS, run
from .geometry import Array, Covariance, Measurements, Points, Seed, root
from .history import History
from .robot import Robot, add_noise
from .validation import as_count, as_covariance, as_numbers
from .world import SENSORS, Landmark, Map, positions, sensed


@dataclass(frozen=True)
class Log:
    """What one robot did and saw in N steps; a simulated and a real run are the same type.

    times     (N+1,) [s]; step k leads from times[k] to times[k+1].
    controls  (N, m) motion of each step: commanded velocity (vx, vy) [m/s] in the world frame; or
              (forward velocity [m/s], turn rate [rad/s]) of a robot with wheels; or the odometry of a robot
              with legs, how far it came ahead [m], to the left [m] and round [rad] in this step.
    seen_step (M,) which step each measurement belongs to, ascending; it is taken at the step's end.
    seen_id   (M,) which landmark it is.
    seen      (M, 2) the measurement, as Robot.measure gives it.
    map       the landmarks that may be known to a filter.
    sensor    'xy' or 'rb';  frame: 'world' or 'robot', the frame that bearings (or offsets) are in.
    truth     (N+1, d) true position (x, y) or pose (x, y, theta), NaN where unknown; or None.
    Q, R      the covariances a Robot was made with (per second / times one second), or None.
    range     [m] how far the sensor sees, or None.
    name      where the run comes from, for titles.
    """

    times: Array
    controls: Array
    seen_step: np.ndarray
    seen_id: np.ndarray
    seen: Measurements
    map: Map
    sensor: str = "xy"
    frame: str = "world"
    truth: Array | None = None
    Q: Covariance | None = None
    R: Covariance | None = None
    range: float | None = None
    name: str = "simulated run"
    notes: tuple = field(default=())

    fields: ClassVar = ("xk_k", "Pk_k")  # where a filter for such a log has its mean and its covariance
    shape: ClassVar = None  # of that mean: as many numbers as the filter has

    def __post_init__(self):
        n, m = len(self.controls), len(self.seen)
        # {field: its shape, where None is any number}
        shapes = {"times": (n + 1,), "controls": (n, None), "seen": (m, 2), "truth": (n + 1, None)}
        for name, shape in (shapes | {"seen_step": (m,), "seen_id": (m,)}).items():
            value = getattr(self, name)
            if value is None and name == "truth":
                continue
            value = as_numbers(value, f"{name} of a log") if name in shapes else np.asarray(value)
            if len(value) != shape[0]:
                raise ValueError(f"a log of {n} steps needs {shape[0]} {name}, but there are {len(value)}")
            if value.ndim != len(shape) or shape[1:] not in ((), (None,), value.shape[1:]):
                raise ValueError(
                    f"{name} of a log cannot have the shape {value.shape}: help(Log) tells what it must be"
                )
            if name in ("times", "controls", "seen") and not np.isfinite(value).all():
                raise ValueError(f"{name} of a log must be finite numbers, but one of them is not")
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        if self.sensor not in SENSORS:
            raise ValueError(f"sensor must be 'xy' or 'rb', but it is {self.sensor!r}")
        if self.frame not in ("world", "robot"):
            raise ValueError(f"frame must be 'world' or 'robot', but it is {self.frame!r}")
        if n and not (np.diff(self.times) > 0).all():
            raise ValueError("the times of a log must increase from step to step")
        self._see_to_the_steps()

    def _see_to_the_steps(self):
        """Raise ValueError unless each measurement is of a step of the run, one after the other."""
        steps, n = self.seen_step, len(self)
        if not len(steps):
            return
        if steps.dtype.kind not in "iu":
            raise ValueError(f"seen_step must be whole numbers, but it is an array of {steps.dtype}")
        beyond, back = (steps < 0) | (steps >= n), np.append(False, np.diff(steps) < 0)
        k = int((beyond if beyond.any() else back).argmax())
        if beyond.any():
            which = f"measurement {k} is of step {steps[k]}, as are {beyond.sum() - 1} more of the {len(steps)}"
            raise ValueError(f"seen_step must name steps from 0 to {n - 1}, those of the run, but {which}")
        if back.any():
            raise ValueError(
                f"seen_step must ascend, but measurement {k} is of step {steps[k]} and the one before it of step "
                f"{steps[k - 1]}: sort seen_step, seen_id and seen by np.argsort(seen_step, kind='stable')"
            )

    def __len__(self) -> int:
        return len(self.controls)

    @property
    def dt(self) -> float:
        """Mean duration of a step [s]."""
        return float(self.times[-1] - self.times[0]) / len(self)

    @property
    def count(self) -> np.ndarray:
        """(N,) how many landmarks were in view at each step."""
        return np.bincount(self.seen_step, minlength=len(self))

    def measurements(self) -> list[list[Landmark]]:
        """N lists of Landmark, fresh at each call: a filter that spoils them spoils its own only."""
        values = self.seen.copy()
        landmarks = [Landmark._of(p, i) for p, i in zip(values, self.seen_id.tolist())]
        ends = np.cumsum(self.count).tolist()
        return [landmarks[a:b] for a, b in zip([0, *ends], ends)]

    def judge(self, history: History) -> None:
        """What `replay` asks of what a filter believed: of one robot, nothing more than numbers."""

    def save(self, folder: str | Path) -> Path:
        """Write the run into a new folder as CSV files, from which `Log.load` gives it back to the last bit; the Path.

        steps.csv:        start [s], end [s]; forward [m/s], turn rate [rad/s], or vx [m/s], vy [m/s] in the world
                          frame, or ahead [m], left [m], turned [rad] of each step
        measurements.csv: time [s], id; range [m], bearing [rad], or dx [m], dy [m]: of the step whose end is nearest
        landmarks.csv:    id, x [m], y [m]
        truth.csv:        time [s], x [m], y [m], heading [rad], empty where unknown; may lack, and so may the heading
        about.json:       name, frame, range, Q, R, notes, others (ids of what is no landmark); each of them may lack

        Raises ValueError for what cannot be saved, or if the folder is there already.
        """
        from .recorded.plain import save

        if type(self) is not Log:
            raise ValueError(f"a {type(self).__name__} has more than the plain form holds: only a Log can be saved")
        return save(self, folder)

    @staticmethod
    def load(folder: str | Path) -> "Log":
        """The Log in a folder, or in the one of that name in the data folder: as `save` writes it, or Freiburg's.

        Raises DataError, with the file and the line, for what is wrong in there.
        """
        from .recorded import fields

        return Log(**fields(folder))

    def seen_by(self, sensor: str, R: Covariance, range: float | None = None, rng: Seed = None) -> "Log":
        """The same drive seen by another sensor: same truth and controls, new measurements."""
        if self.truth is None:
            raise ValueError("only a run whose true path is known can be seen by another sensor")
        R, reach = as_covariance(R, "R"), range or self.range or np.inf
        seen = look(self.truth[1:, :2], self.map, sensor, R / self.dt, reach, np.random.default_rng(rng))
        return replace(self, **seen, sensor=sensor, R=R, range=reach)


def simulate(robot: Robot, map: Map, steps: int | None = None) -> Log:
    """Record a run of `robot` among the landmarks of `map`: a Log of `steps` (default: to `robot.tf`).

    Starts where the robot stands and draws from its rng, but does not move it, so that calling it
    again gives another run from the same start.  Same distribution as calling `action` and
    `measure` in a loop, without the loop.
    """
    if not isinstance(robot, Robot):
        raise TypeError(f"simulate(robot, map) needs a Robot first, but it was given {robot!r}")
    steps = as_count(round((robot.tf - robot.t) / robot.dt) if steps is None else steps, "a run's steps")
    times = robot.t + robot.dt * np.arange(steps + 1.0)
    controls = robot.velocity(times[:-1])
    moves = robot.dt * controls + robot.rng.standard_normal((steps, 2)) @ root(robot.Q).T
    truth = robot.p + np.vstack([np.zeros(2), np.cumsum(moves, axis=0)])
    seen = look(truth[1:], map, robot.type, robot.R, robot.range, robot.rng)
    return Log(
        times,
        controls,
        **seen,
        map=map,
        sensor=robot.type,
        truth=truth,
        Q=robot.Q / robot.dt,
        R=robot.R * robot.dt,
        range=robot.range,
    )


def look(path: Points, map: Map, sensor: str, R: Covariance, range: float, rng: np.random.Generator) -> dict:
    """The measurement fields of a Log for a sensor carried along `path` (N, 2); R of one look."""
    offset = positions(map) - np.asarray(path)[:, None, :]
    step, which = np.nonzero(np.hypot(offset[..., 0], offset[..., 1]) <= range)
    values = add_noise(sensed(offset[step, which], sensor), R, sensor, rng)
    ids = np.array([landmark.id for landmark in map])
    return {"seen_step": step, "seen_id": ids[which] if len(ids) else which, "seen": values}


KINDS["log"] = run(Log)  # it can travel to where a student's code runs
