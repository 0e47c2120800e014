"""How good an estimate is, and how honest its covariance.

NEES and NIS: Bar-Shalom, Li, Kirubarajan, "Estimation with Applications to Tracking and
Navigation" (2001), section 5.4.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .checks.feedback import FilterError
from .geometry import Array, Covariances, wrap
from .history import AnyLog, History, of_one_run, truth_of
from .log import Log
from .validation import as_count, as_covariance, is_number
from .world import difference, places, sensed


def errors(history: History, log: AnyLog) -> Array:
    """(N+1, n) estimate minus truth, of a team (N+1, robots, 3); the third of the numbers is an angle, and wrapped.

    Raises ValueError for a history of another run, and for an estimate of other numbers than the truth's.
    """
    of_one_run(history, log)
    truth, n = truth_of(log), history.x.shape[-1]
    if history.x.shape[:-1] != truth.shape[:-1] or not 2 <= n <= truth.shape[-1]:
        raise ValueError(
            f"at each step the estimate has the shape {history.x.shape[1:]}, but the truth of '{log.name}' the shape "
            f"{truth.shape[1:]}: compare what both have, as in dataclasses.replace(history, x=history.x[:, :2], "
            "P=history.P[:, :2, :2])"
        )
    error = history.x - truth[..., :n]
    if n > 2:
        error[..., 2] = wrap(error[..., 2])
    return error


def distances(history: History, log: Log) -> Array:
    """(N+1,) [m] distance between estimate and truth; NaN where the truth is unknown."""
    return np.hypot(*errors(history, log)[:, :2].T)


def rmse(history: History, log: Log) -> float:
    """Root mean square position error [m] over the steps whose truth is known."""
    return float(np.sqrt(np.nanmean(distances(history, log) ** 2)))


def heading_rmse(history: History, log: Log) -> float:
    """Root mean square error of the heading [rad], the third component, over the steps whose truth is known."""
    error = errors(history, log)
    if error.shape[1] < 3:
        raise ValueError("this filter estimates a position only: there is no heading to compare")
    return float(np.sqrt(np.nanmean(error[:, 2] ** 2)))


def nees(history: History, log: AnyLog) -> Array:
    """(N+1,) normalized estimation error squared e' P^-1 e: chi-square with n degrees of freedom."""
    return squared(_joint_errors(history, log), history.sound())


def nees_per_dimension(history: History, log: AnyLog, part: Sequence[int] | np.ndarray | None = None) -> Array:
    """(N+1,) the NEES divided by its degrees of freedom: 1 on average for a consistent filter.

    part: which of the n numbers to look at, by default all.  Raises ValueError for numbers that there are not.
    """
    e = _joint_errors(history, log)
    part = np.arange(e.shape[1]) if part is None else np.asarray(part)
    if part.ndim != 1 or not len(part) or not np.isin(part, np.arange(e.shape[1])).all():
        raise ValueError(f"part must be a list of positions from 0 to {e.shape[1] - 1}, but it is {part.tolist()}")
    # A team's origin is known exactly: a micrometre and a microradian on top keep its rows regular.
    P = history.sound()[:, part[:, None], part] + 1e-12 * np.eye(len(part))
    return squared(e[:, part], P) / len(part)


def _joint_errors(history, log):
    return errors(history, log).reshape(len(history.x), -1)


def nis(history: History, log: Log) -> tuple[Array, np.ndarray]:
    """Normalized innovation squared (N,) and its degrees of freedom (N,), 2 for each landmark in view.

    Computed without the filter's S, from what it believed before and after the update: the update
    moves the estimate by d and leaves the residuals r_j, and then
        innovation' S^-1 innovation = d' P_prior^-1 d + sum_j r_j' R^-1 r_j,
    exactly so for a linear sensor and up to its curvature for range and bearing (the two sides are
    the least squares cost at its minimum).  NaN where nothing was in view.
    Raises ValueError for a history without R, a log in the robot's frame, and a landmark that the map lacks.
    """
    of_one_run(history, log)
    if history.R is None:
        raise ValueError("the NIS needs the filter's field R, the covariance of one landmark")
    if log.frame != "world":
        raise ValueError("the NIS is for measurements in the world frame, but these are in the robot's")
    step, R = log.seen_step, as_covariance(history.R, "the filter's R")
    offset = places(log.map, log.seen_id) - history.x[step + 1, :2]
    residual = difference(log.seen, sensed(offset, log.sensor), log.sensor)
    cost = squared(history.x[1:] - history.x_prior, history.sound(prior=True), "in step {}", 1)
    fit = squared(residual, np.broadcast_to(R, (len(step), 2, 2)), "for measurement {}")
    cost = cost + np.bincount(step, fit, minlength=len(log))
    return np.where(log.count > 0, cost, np.nan), 2 * log.count


def mean_nis(history: History, log: Log) -> float:
    """NIS per measured number over the whole run: 1 for a consistent filter."""
    value, dof = nis(history, log)
    if not dof.any():
        raise ValueError(f"nothing was ever in view in '{log.name}': there is no NIS")
    return float(np.nansum(value) / dof.sum())


def squared(e: Array, P: Covariances, when: str = "after step {}", first: int = 0) -> Array:
    """E' P^-1 e (N,) of differences e (N, n) with covariances P (N, n, n); NaN where e is.

    Raises FilterError where P says 0 in a direction in which e is not (as a filter does that was told R = 0).
    when: the words for such a place, which are counted from `first`.
    """
    try:
        value = np.einsum("ki,ki->k", e, np.linalg.solve(P, e[..., None])[..., 0])
        if not ((value < 0) | (value > 1e12)).any():
            return value
    except np.linalg.LinAlgError:
        pass
    values, vectors = np.linalg.eigh(P)
    along, certain = np.einsum("kij,ki->kj", vectors, e), values <= 1e-12
    off = np.where(certain, abs(along), 0.0).max(axis=1)
    if (wrong := off > 1e-6).any():
        k = int(wrong.argmax())
        raise FilterError(
            f"Your filter has the variance 0 {when.format(k + first)}, in a direction in which it is {off[k]:.2g} "
            "off. No number of standard deviations is that: was it told Q, R or P0 as 0?"
        )
    return np.sum(np.where(certain, 0.0, along**2 / np.where(certain, 1.0, values)), axis=1)


def chi2_bounds(dof: ArrayLike, level: float = 0.95, runs: int = 1) -> tuple[Any, Any]:
    """(low, high): where the mean of `runs` chi-square values falls with probability `level`."""
    if not (is_number(level) and 0 < level < 1):
        raise ValueError(f"level must be a probability between 0 and 1, but it is {level!r}")
    runs = as_count(runs, "runs")
    # The same numbers as scipy.stats.chi2.ppf, whose import alone costs a student two seconds.
    from scipy.special import gammaincinv

    half = np.asarray(dof) * runs / 2
    tail = (1 - level) / 2
    return 2 * gammaincinv(half, tail) / runs, 2 * gammaincinv(half, 1 - tail) / runs


def inside(history: History, log: Log, sigmas: float = 3.0) -> np.ndarray:
    """(N+1,) whether the truth lies in the filter's `sigmas`-ellipse; False where it is unknown."""
    return squared(errors(history, log)[:, :2], history.sound()[:, :2, :2]) <= sigmas**2


def steps_to_converge(history: History, log: Log, hold: int = 10, sigmas: float = 3.0) -> int | None:
    """First step from which the truth stays in the `sigmas`-ellipse for `hold` steps, or None."""
    ok = inside(history, log, sigmas).astype(int)
    held = np.convolve(ok, np.ones(as_count(hold, "hold"), dtype=int), mode="valid") == hold
    return int(held.argmax()) if held.any() else None


def semi_axis(history: History, sigmas: float = 3.0) -> Array:
    """(N+1,) [m] the longer half axis of the filter's `sigmas`-ellipse of the position."""
    return sigmas * np.sqrt(np.linalg.eigvalsh(history.sound()[:, :2, :2])[:, -1])


def summary(history: History, log: Log) -> str:
    """The figures that matter in one line of text, with units."""
    if log.truth is None:
        return f"mean NIS per measured number {mean_nis(history, log):.2f} (1 is consistent)"
    steps = steps_to_converge(history, log)
    known = np.isfinite(distances(history, log))
    held = "never ten in a row" if steps is None else f"ten in a row from step {steps} on"
    share = 100 * inside(history, log)[known].mean()
    error = rmse(history, log)
    return (
        (f"RMSE {error:.2f} m" if error < 100 else "the estimate runs away: run the check of KF")
        + f" · inside 3σ in {share:.0f} % of steps, {held} · "
        f"mean NEES {np.nanmean(nees(history, log)):.3g} ({history.x.shape[1]} is consistent)"
    )
