"""What a filter believed along a recorded run: a student's filter made, run over the log, and its history kept."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .checks.feedback import FilterError, LabError, explain
from .geometry import Array, Covariance, Covariances, wrap
from .validation import as_covariance, as_numbers, fault

START = np.zeros(2)  # the handout's first estimate: anywhere near the middle ...
START_COV = 3.0 * np.eye(2)  # ... give or take 1.7 m


AnyLog = Any
"""A `labkit.log.Log` of one robot, or a team's `labkit.team.TeamLog`: both offer what a filter and metrics ask for."""


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

    def sound(self, prior: bool = False) -> Covariances:
        """P (N+1, n, n), or P_prior (N, n, n), if each is a covariance; FilterError says at which step one is none."""
        P, when = (self.P_prior, "after predict in") if prior else (self.P, "after")
        faults = self.__dict__.setdefault("_faults", {})  # sought once, since all that measures and draws asks
        if prior not in faults:
            faults[prior] = fault(P)
        if faults[prior]:
            k, what = faults[prior]
            raise FilterError(f"Your filter's P {when} step {k + prior} of {len(self.x) - 1} {what}.")
        return P


def of_one_run(history: History, log: AnyLog) -> None:
    """Raise TypeError unless these are a History and a log, ValueError unless they have the same steps."""
    if not (hasattr(history, "x_prior") and hasattr(log, "controls")):
        came = f"{type(history).__name__} and {type(log).__name__}"
        raise TypeError(f"a History (from replay) and its Log are needed, but these are {came}: in the other order?")
    if len(history.x) != len(log) + 1:
        raise ValueError(
            f"the history has {len(history.x) - 1} steps and the log '{log.name}' {len(log)}: "
            "they are of different runs, so replay the filter over this log"
        )


def truth_of(log: AnyLog) -> Array:
    """The truth (N+1, ...) of a log; ValueError if nothing of it is known."""
    if log.truth is None:
        raise ValueError(f"the log '{log.name}' has no ground truth to compare with")
    if not np.isfinite(log.truth).any():
        raise ValueError(f"the ground truth of '{log.name}' is unknown throughout")
    return np.asarray(log.truth)


def make_filter(
    KF: Callable,
    log: AnyLog,
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
    Raises ValueError, with the argument's name, for what cannot be, FilterError for what the class makes of the rest.
    """
    if not callable(KF):
        raise ValueError(f"KF must be a class, but it is an object of the class {type(KF).__name__}")
    if not np.isfinite(as_numbers(x0, "x0")).all():
        raise ValueError(f"x0 must be finite numbers, but it is {x0!r}")
    as_covariance(P0, "P0", np.size(x0))
    if noise is not None:
        known = [log.map] if hasattr(log, "map") else []  # a team has none
        return made(lambda: KF(np.array(x0), np.array(P0), *known, noise, **options))
    Q, R = (log.Q if Q is None else Q), (log.R if R is None else R)
    if Q is None or R is None:
        raise ValueError(f"the log '{log.name}' does not know its noise: give Q and R")
    as_covariance(Q, "Q", max(2, len(np.atleast_1d(Q))))
    as_covariance(R, "R")
    return made(lambda: KF(np.array(x0), np.array(P0), np.array(Q), np.array(R), log.map, dt=log.dt, **options))


def made(make: Callable[[], Any]) -> Any:
    """What make() gives, a filter of a student's class; raises FilterError with what went wrong and where."""
    try:
        return make()
    except Exception as error:
        raise FilterError(f"Your filter could not be made. {explain(error)}") from error


def replay(kf: Any, log: AnyLog) -> History:
    """Run a filter over a recorded log and return its History.

    kf: any object with `predict(u)`, `update(y)` and the two `fields` of such a log: `xk_k` (n,) and `Pk_k` (n, n), or
    of a team of n robots `x` (n, 3) and `P` (3n, 3n).
    Raises FilterError, with the step and the student's own line, when the filter raises or when what it leaves there
    is no estimate.
    """
    if isinstance(kf, type) or not hasattr(log, "controls"):
        raise TypeError("replay(kf, log) needs first a filter, say from make_filter(KF, log), no class, and then a Log")
    shapes, before, after, d2 = _shapes(log, 2), [], [], []
    try:
        shapes = _shapes(log, len(getattr(kf, log.fields[0])))
        after.append(_estimate(kf, shapes))
        for u, y in zip(log.controls.copy(), log.measurements()):
            kf.predict(u)
            before.append(_estimate(kf, shapes))
            kf.update(y)
            after.append(_estimate(kf, shapes))
            d2.append(_as_list(getattr(kf, "d2", ())))
    except NotImplementedError as error:
        raise FilterError(explain(error)) from error
    except Exception as error:
        problem = explain(error) if isinstance(error, LabError) else _shape_problem(kf, shapes) or explain(error)
        step = len(d2) + bool(after)
        raise FilterError(f"Your filter stopped in step {step} of {len(log)}.\n{problem}") from error
    x, P = _stacked(after, shapes)
    x_prior, P_prior = _stacked(before, shapes)
    bad = ~np.isfinite(np.concatenate([x.reshape(len(x), -1), P.reshape(len(x), -1)], axis=1)).all(axis=1)
    if bad.any():
        raise FilterError(
            f"After step {int(bad.argmax())} of {len(log)} your filter's estimate is not a number "
            "(NaN or infinite). Look for a division by zero or a covariance that grows without end."
        )
    R = None if getattr(kf, "R", None) is None else np.array(kf.R, dtype=float)
    history = History(log.times, x, P, x_prior, P_prior, R, d2, getattr(kf, "gate", np.inf))
    log.judge(history)
    return history


def _estimate(kf, shapes):
    """Copies of a filter's mean and covariance, which must have their shapes: numpy would spread others."""
    values = [getattr(kf, name) for name in shapes]
    if [np.shape(value) for value in values] != list(shapes.values()):
        raise ValueError(_shape_problem(kf, shapes))
    return [np.array(value, dtype=float) for value in values]


def _stacked(estimates, shapes):
    pairs = zip(*estimates) if estimates else ((), ())
    return [np.array(values).reshape(-1, *shape) for values, shape in zip(pairs, shapes.values())]


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


def by_filterpy(
    log: AnyLog, h: Callable[[Array, Any], Array], jacobian: Callable[[Array, Any], Array], like: Any
) -> History:
    """What filterpy's extended Kalman filter makes of a run with ranges and bearings, as `replay` would give it.

    h, jacobian: (x (2,) [m], landmark) -> [range [m], bearing [rad]] and its derivatives (2, 2);  like: a filter as
    `make_filter` makes it, not yet used, whose start, Q, R and map are taken.
    """
    from filterpy.kalman import ExtendedKalmanFilter  # slow to load, like all of scipy

    kf = ExtendedKalmanFilter(dim_x=2, dim_z=2)
    kf.x, kf.P, kf.Q = like.xk_k.copy(), like.Pk_k.copy(), like.Q
    x, P, x_prior, P_prior = [kf.x], [kf.P], [], []
    for u, y in zip(log.controls, log.measurements()):
        kf.x, kf.P = kf.x + log.dt * u, kf.P + kf.Q
        x_prior.append(kf.x)
        P_prior.append(kf.P)
        if y:
            _library_update(kf, y, [like.map[like.map.index(lm)] for lm in y], h, jacobian, like.R)
        x.append(kf.x)
        P.append(kf.P)
    return History(log.times, np.array(x), np.array(P), np.array(x_prior), np.array(P_prior), like.R)


def _library_update(kf, y, known, h, jacobian, R):
    kf.update(
        np.concatenate([lm.p for lm in y]),
        HJacobian=lambda x: np.vstack([jacobian(x, one) for one in known]),
        Hx=lambda x: np.concatenate([h(x, one) for one in known]),
        R=np.kron(np.eye(len(y)), R),
        residual=_residual,
    )


def _residual(a, b):
    d = a - b
    d[1::2] = wrap(d[1::2])
    return d
