"""One recorded run of a robot, simulated or real."""

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from .checks.kinds import KINDS, run
from .geometry import Array, Covariance, Measurements, Points, Seed, as_covariance, root
from .history import History
from .robot import Robot, add_noise
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
        n = len(self.controls)
        for name, value, length in [
            ("times", self.times, n + 1),
            ("truth", self.truth, n + 1),
            ("seen_id", self.seen_id, len(self.seen)),
            ("seen_step", self.seen_step, len(self.seen)),
        ]:
            if value is not None and len(value) != length:
                raise ValueError(f"a log of {n} steps needs {length} {name}, but there are {len(value)}")
        if self.sensor not in SENSORS:
            raise ValueError(f"sensor must be 'xy' or 'rb', but it is {self.sensor!r}")
        if len(self.seen_step) and not 0 <= min(self.seen_step) <= max(self.seen_step) < n:
            raise ValueError(
                f"seen_step must name steps from 0 to {n - 1}, "
                f"but goes from {min(self.seen_step)} to {max(self.seen_step)}"
            )
        if n and not (np.diff(self.times) > 0).all():
            raise ValueError("the times of a log must increase from step to step")
        for name in ("times", "controls", "seen"):
            if not np.isfinite(getattr(self, name)).all():
                raise ValueError(f"{name} of a log must be finite numbers, but one of them is not")
        for value in (self.times, self.controls, self.seen_step, self.seen_id, self.seen, self.truth):
            if value is not None:
                value.setflags(write=False)

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
    steps = round((robot.tf - robot.t) / robot.dt) if steps is None else int(steps)
    if steps < 1:
        raise ValueError(f"a run needs at least one step, but steps is {steps}")
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
