"""What labkit is given, checked before it does harm: numbers, points, covariances."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .geometry import Array, Covariance, Covariances, Point


def as_covariance(value: ArrayLike, name: str, size: int = 2) -> Covariance:
    """`value` as a float (size, size) covariance; ValueError names the argument if it is not one."""
    cov = as_numbers(value, name)
    if cov.shape != (size, size):
        raise ValueError(f"{name} must be a {size} x {size} covariance, but its shape is {cov.shape}")
    if found := fault(cov[None]):
        raise ValueError(f"{name} {found[1]}")
    return cov


def fault(covs: Covariances) -> tuple[int, str] | None:
    """Of covariances (N, n, n) the number of one that is none, with what is wrong with it; None if there is none such.

    What rounding may leave of a filter's covariance is no fault: a micrometre squared, or 10^-9 of the largest entry.
    """
    finite = np.isfinite(covs).all(axis=(1, 2))
    if not finite.all():
        return int(finite.argmin()), "has an entry that is not a finite number"
    spare = 1e-12 + 1e-9 * abs(covs).max(axis=(1, 2), initial=0.0)
    even = abs(covs - covs.swapaxes(1, 2)).max(axis=(1, 2), initial=0.0) <= 1e4 * spare
    if not even.all():
        return int(even.argmin()), "must be symmetric, as every covariance is"
    try:
        np.linalg.cholesky(covs + spare[:, None, None] * np.eye(covs.shape[1]))  # far quicker than eigenvalues
    except np.linalg.LinAlgError:
        negative = np.linalg.eigvalsh(covs)[:, 0] < -spare
        if negative.any():
            return int(negative.argmax()), "has a negative variance in some direction: no covariance has that"
    return None


def as_point(value: ArrayLike, name: str) -> Point:
    """`value` as a float (2,) point [m]; ValueError names the argument if it is not one."""
    try:
        point = np.array(value, dtype=float).reshape(-1)
    except (TypeError, ValueError):
        point = np.empty(0)
    if point.shape != (2,) or not np.isfinite(point).all():
        raise ValueError(f"{name} must be two finite numbers (x, y), but it is {value!r}")
    return point


def as_numbers(value: ArrayLike, name: str) -> Array:
    """`value` as a float array (...,); ValueError names the argument if it is not made of numbers."""
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be made of numbers, in rows of one length, but it is {value!r}") from None


def is_number(value: Any) -> bool:
    """Whether value is one finite number."""
    try:
        return math.isfinite(value) and not isinstance(value, str)
    except TypeError:
        return False


def as_count(value: Any, name: str, least: int = 1) -> int:
    """Value as an int, if it is a whole number of at least `least`; raises ValueError that names the argument."""
    if not is_number(value) or value != int(value) or value < least:
        raise ValueError(f"{name} must be a whole number, {least} or more, but it is {value!r}")
    return int(value)
