"""One recorded run, simulated or real, and a filter's history over it."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from .checks.feedback import FilterError, LabError, explain
from .geometry import Array, Covariance, Covariances, Measurements, Points, Seed, as_covariance, root
from .robot import Robot, add_noise
from .world import SENSORS, Landmark, Map, positions, sensed

if TYPE_CHECKING:
    from .team.log import TeamLog

START = np.zeros(2)  # the handout's first estimate: anywhere near the middle ...
START_COV = 3.0 * np.eye(2)  # ... give or take 1.7 m


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

    def judge(self, history: "History") -> None:
        """What `replay` asks of what a filter believed: of one robot, nothing more than numbers."""

    def seen_by(self, sensor: str, R: Covariance, range: float | None = None, rng: Seed = None) -> "Log":
        """The same drive seen by another sensor: same truth and controls, new measurements."""
        if self.truth is None:
            raise ValueError("only a run whose true path is known can be seen by another sensor")
        R, reach = as_covariance(R, "R"), range or self.range or np.inf
        seen = look(self.truth[1:, :2], self.map, sensor, R / self.dt, reach, np.random.default_rng(rng))
        return replace(self, **seen, sensor=sensor, R=R, range=reach)


@dataclass(frozen=True)
class History:
    """What a filter believed along a log of N steps.

    times (N+1,) [s];  x (N+1, n) means;  P (N+1, n, n) covariances; entry 0 is the start.
    x_prior (N, n), P_prior (N, n, n): after `predict`, before `update`.
    R (2, 2): the covariance of one landmark that the filter used, or None if it has no field R.
    d2, gate: N lists of the squared distances of each step's readings, and the gate, if it has these fields.
    Of a team of robots: x (N+1, robots, 3) and x_prior (N, robots, 3), with covariances of all their numbers.
    """

    times: Array
    x: Array
    P: Covariances
    x_prior: Array
    P_prior: Covariances
    R: Covariance | None
    d2: Sequence[list] = ()
    gate: float = np.inf


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


def make_filter(
    KF: Callable,
    log: Any,
    Q: Covariance | None = None,
    R: Covariance | None = None,
    x0: Array = START,
    P0: Covariance = START_COV,
    noise: Any = None,
    **options: Any,
) -> Any:
    """An object of the student's class for this log: its map and dt, the robot's own Q and R unless given.

    noise: for robots with odometry, whose filters are made as KF(x0, P0, map, noise), of a team as KF(x0, P0, noise):
    see labkit.legged.Noise and labkit.team.TeamNoise.  options: what else the class takes by name.
    """
    if noise is not None:
        known = [log.map] if isinstance(log, Log) else []
        return made(lambda: KF(np.array(x0), np.array(P0), *known, noise, **options))
    Q, R = (log.Q if Q is None else Q), (log.R if R is None else R)
    if Q is None or R is None:
        raise ValueError(f"the log '{log.name}' does not know its noise: give Q and R")
    return made(lambda: KF(np.array(x0), np.array(P0), np.array(Q), np.array(R), log.map, dt=log.dt, **options))


def made(make: Callable[[], Any]) -> Any:
    """What make() gives, a filter of a student's class; raises FilterError with what went wrong and where."""
    try:
        return make()
    except Exception as error:
        raise FilterError(f"Your filter could not be made. {explain(error)}") from error


def replay(kf: Any, log: "Log | TeamLog") -> History:
    """Run a filter over a recorded log and return its History.

    kf: any object with `predict(u)`, `update(y)` and the two `fields` of such a log: `xk_k` (n,) and `Pk_k` (n, n), or
    of a team of n robots `x` (n, 3) and `P` (3n, 3n).
    Raises FilterError, with the step and the student's own line, when the filter raises or when what it leaves there
    is no estimate.
    """
    steps, k, shapes, d2 = len(log), -1, _shapes(log, 2), []

    def keep(row, *into):
        for name, array in zip(log.fields, into):
            value = getattr(kf, name)
            if np.shape(value) != shapes[name]:
                raise ValueError(_shape_problem(kf, shapes))
            array[row] = value

    try:
        shapes = _shapes(log, len(getattr(kf, log.fields[0])))
        x, P = (np.empty((steps + 1, *shape)) for shape in shapes.values())
        x_prior, P_prior = np.empty_like(x[1:]), np.empty_like(P[1:])
        keep(0, x, P)
        for k, (u, y) in enumerate(zip(log.controls.copy(), log.measurements())):
            kf.predict(u)
            keep(k, x_prior, P_prior)
            kf.update(y)
            keep(k + 1, x, P)
            d2.append(_as_list(getattr(kf, "d2", ())))
    except NotImplementedError as error:
        raise FilterError(explain(error)) from error
    except Exception as error:
        problem = explain(error) if isinstance(error, LabError) else _shape_problem(kf, shapes) or explain(error)
        raise FilterError(f"Your filter stopped in step {k + 1} of {steps}.\n{problem}") from error
    bad = ~np.isfinite(np.concatenate([x.reshape(steps + 1, -1), P.reshape(steps + 1, -1)], axis=1)).all(axis=1)
    if bad.any():
        raise FilterError(
            f"After step {int(bad.argmax())} of {steps} your filter's estimate is not a number "
            "(NaN or infinite). Look for a division by zero or a covariance that grows without end."
        )
    R = getattr(kf, "R", None)
    R = None if R is None else np.array(R, dtype=float)
    history = History(log.times, x, P, x_prior, P_prior, R, d2, getattr(kf, "gate", np.inf))
    log.judge(history)
    return history


def _shapes(log, n):
    """{field: shape} of mean and covariance: as the log has it, or of n numbers."""
    shape = log.shape or (n,)
    return dict(zip(log.fields, (shape, 2 * (math.prod(shape),))))


def _as_list(value):
    return list(value) if isinstance(value, list | tuple | np.ndarray) else []


def _shape_problem(kf, shapes):
    for name, due in shapes.items():
        try:
            shape = np.shape(getattr(kf, name))
        except Exception:
            return f"{name} is missing or not an array of numbers."
        if shape != due:
            return f"{name} should have shape {due}, but it has shape {shape}."
    return ""
