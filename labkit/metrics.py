"""How good an estimate is, and how honest its covariance.

NEES and NIS: Bar-Shalom, Li, Kirubarajan, "Estimation with Applications to Tracking and
Navigation" (2001), section 5.4.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .geometry import Array, wrap
from .history import AnyLog, History
from .log import Log
from .world import difference, sensed


def errors(history: History, log: AnyLog) -> Array:
    """(N+1, n) estimate minus truth, of a team (N+1, robots, 3); the third of the numbers is an angle, and wrapped."""
    if log.truth is None:
        raise ValueError(f"the log '{log.name}' has no ground truth to compare with")
    n = history.x.shape[-1]
    error = history.x - log.truth[..., :n]
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
    return float(np.sqrt(np.nanmean(errors(history, log)[:, 2] ** 2)))


def nees(history: History, log: AnyLog) -> Array:
    """(N+1,) normalized estimation error squared e' P^-1 e: chi-square with n degrees of freedom."""
    return _squared(_joint_errors(history, log), history.P)


def nees_per_dimension(history: History, log: AnyLog, part: Sequence[int] | np.ndarray | None = None) -> Array:
    """(N+1,) the NEES divided by its degrees of freedom: 1 on average for a consistent filter.

    part: which of the n numbers to look at, by default all.
    """
    e = _joint_errors(history, log)
    part = np.arange(e.shape[1]) if part is None else np.asarray(part)
    # A team's origin is known exactly: a micrometre and a microradian on top keep its rows regular.
    P = history.P[:, part[:, None], part] + 1e-12 * np.eye(len(part))
    return _squared(e[:, part], P) / len(part)


def _joint_errors(history, log):
    return errors(history, log).reshape(len(history.x), -1)


def nis(history: History, log: Log) -> tuple[Array, np.ndarray]:
    """Normalized innovation squared (N,) and its degrees of freedom (N,), 2 for each landmark in view.

    Computed without the filter's S, from what it believed before and after the update: the update
    moves the estimate by d and leaves the residuals r_j, and then
        innovation' S^-1 innovation = d' P_prior^-1 d + sum_j r_j' R^-1 r_j,
    exactly so for a linear sensor and up to its curvature for range and bearing (the two sides are
    the least squares cost at its minimum).  NaN where nothing was in view.
    """
    if history.R is None:
        raise ValueError("the NIS needs the filter's field R, the covariance of one landmark")
    if log.frame != "world":
        raise ValueError("the NIS is for measurements in the world frame, but these are in the robot's")
    step = log.seen_step
    landmark = {lm.id: lm.p for lm in log.map}
    p = np.array([landmark[i] for i in log.seen_id.tolist()]).reshape(-1, 2)
    residual = difference(log.seen, sensed(p - history.x[step + 1], log.sensor), log.sensor)
    cost = _squared(history.x[1:] - history.x_prior, history.P_prior)
    fit = _squared(residual, np.broadcast_to(history.R, (len(step), 2, 2)))
    cost = cost + np.bincount(step, fit, minlength=len(log))
    return np.where(log.count > 0, cost, np.nan), 2 * log.count


def mean_nis(history: History, log: Log) -> float:
    """NIS per measured number over the whole run: 1 for a consistent filter."""
    value, dof = nis(history, log)
    return float(np.nansum(value) / max(dof.sum(), 1))


def _squared(e, P):
    try:
        return np.einsum("ki,ki->k", e, np.linalg.solve(P, e[..., None])[..., 0])
    except np.linalg.LinAlgError:  # a filter told Q = 0 and R = 0 is infinitely sure
        return np.einsum("ki,kij,kj->k", e, np.linalg.pinv(P, hermitian=True), e)


def chi2_bounds(dof: ArrayLike, level: float = 0.95, runs: int = 1) -> tuple[Any, Any]:
    """(low, high): where the mean of `runs` chi-square values falls with probability `level`."""
    # The same numbers as scipy.stats.chi2.ppf, whose import alone costs a student two seconds.
    from scipy.special import gammaincinv

    half = np.asarray(dof) * runs / 2
    tail = (1 - level) / 2
    return 2 * gammaincinv(half, tail) / runs, 2 * gammaincinv(half, 1 - tail) / runs


def inside(history: History, log: Log, sigmas: float = 3.0) -> np.ndarray:
    """(N+1,) whether the truth lies in the filter's `sigmas`-ellipse; False where it is unknown."""
    return _squared(errors(history, log)[:, :2], history.P[:, :2, :2]) <= sigmas**2


def steps_to_converge(history: History, log: Log, hold: int = 10, sigmas: float = 3.0) -> int | None:
    """First step from which the truth stays in the `sigmas`-ellipse for `hold` steps, or None."""
    ok = inside(history, log, sigmas).astype(int)
    held = np.convolve(ok, np.ones(hold, dtype=int), mode="valid") == hold
    return int(held.argmax()) if held.any() else None


def semi_axis(history: History, sigmas: float = 3.0) -> Array:
    """(N+1,) [m] the longer half axis of the filter's `sigmas`-ellipse of the position."""
    return sigmas * np.sqrt(np.linalg.eigvalsh(history.P[:, :2, :2])[:, -1])


def summary(history: History, log: Log) -> str:
    """The figures that matter in one line of text, with units."""
    if log.truth is None:
        return f"mean NIS per measured number {mean_nis(history, log):.2f} (1 is consistent)"
    steps = steps_to_converge(history, log)
    known = np.isfinite(distances(history, log))
    share = 100 * inside(history, log)[known].mean()
    error = rmse(history, log)
    return (
        (f"RMSE {error:.2f} m" if error < 100 else "the estimate runs away: run the check of KF")
        + f" · inside 3σ in {share:.0f} % of steps · "
        f"mean NEES {np.nanmean(nees(history, log)):.3g} ({history.x.shape[1]} is consistent) · "
        + ("never stays inside" if steps is None else f"stays inside from step {steps}")
    )
