"""Readings turned into points, and how uncertain such a point is: two ways to take the bias out, and none.

sigma_d [m] and sigma [rad] are the standard deviations of range and bearing; points are in the observer's frame.
"""

import numpy as np
from numpy.typing import ArrayLike

from ..geometry import Array, Covariance, Covariances, Point, Poses

WAYS = ("raw", "additive", "multiplicative")


def shift(d: float | Array, sigma: float) -> float | Array:
    """By how much [m] a raw point at the range d is too near on average, as seen from the reading itself.

    The additive way adds it in the direction of the reading.
    Source: D. Lerro, Y. Bar-Shalom, "Tracking with debiased consistent converted measurements versus EKF" (1993),
    eq. 10.
    """
    return d * (np.exp(-(sigma**2) / 2) - np.exp(-(sigma**2)))


def spread(d: ArrayLike, alpha: ArrayLike, sigma_d: float, sigma: float, way: str = "multiplicative") -> Covariances:
    """Covariances (N, 2, 2) [m^2] of points from readings d (N,) [m], alpha (N,) [rad].

    way: 'raw', by the tangent; 'additive' (Lerro and Bar-Shalom 1993, eq. 13); 'multiplicative' (L. Mo, X. Song,
    Y. Zhou, Z. Sun, Y. Bar-Shalom, "Unbiased converted measurements for tracking" (1998), eq. 10).
    Raises ValueError for another way.
    """
    d, s = np.asarray(d, dtype=float), sigma**2
    if way == "raw":
        along, across = sigma_d**2 + 0 * d, d**2 * s
    elif way == "additive":
        a, b = d**2 * np.exp(-2 * s), sigma_d**2 * np.exp(-2 * s)
        along = a * (np.cosh(2 * s) - np.cosh(s)) + b * (2 * np.cosh(2 * s) - np.cosh(s))
        across = a * (np.sinh(2 * s) - np.sinh(s)) + b * (2 * np.sinh(2 * s) - np.sinh(s))
    elif way == "multiplicative":
        half = (d**2 + sigma_d**2) / 2
        along = (np.exp(s) - 2) * d**2 + half * (1 + np.exp(-2 * s))
        across = half * (1 - np.exp(-2 * s))
    else:
        raise ValueError(f"way must be one of {', '.join(WAYS)}, but it is {way!r}")
    return _turned(along, across, alpha)


def expected_spread(d: float, alpha: float, sigma_d: float, sigma: float) -> Covariance:
    """Covariance (2, 2) [m^2] of a multiplicatively converted point of a target that *is* at d [m], alpha [rad].

    For a filter: taken where the target is expected, it has nothing to do with the error of the reading. Taken from
    the reading (`spread`), it makes the filter trust those readings more that err to one side.
    Source: S. Bordonaro, P. Willett, Y. Bar-Shalom, "Decorrelated unbiased converted measurement Kalman filter" (2014).
    """
    s = sigma**2
    half = np.exp(s) * (d**2 + sigma_d**2) / 2
    return _turned(half * (1 + np.exp(-2 * s)) - d**2, half * (1 - np.exp(-2 * s)), alpha)


def point_seen(poses: Poses, i: int, j: int) -> tuple[Point, Array]:
    """Where robot i has robot j in its own frame (2,) [m], of poses (n, 3), and the Jacobian (2, 3n) of that."""
    c, s = np.cos(poses[i, 2]), np.sin(poses[i, 2])
    to = np.array([[c, s], [-s, c]])  # from the common frame to the observer's
    point, A = to @ (poses[j] - poses[i])[:2], np.zeros((2, len(poses), 3))
    A[:, j, :2], A[:, i, :2], A[:, i, 2] = to, -to, (point[1], -point[0])
    return point, A.reshape(2, -1)


def _turned(along, across, alpha):
    """Covariances with these variances along and across the direction alpha."""
    c, s = np.cos(alpha), np.sin(alpha)
    xy = (along - across) * c * s
    rows = [along * c**2 + across * s**2, xy, xy, along * s**2 + across * c**2]
    return np.stack(np.broadcast_arrays(*rows), axis=-1).reshape(*np.shape(xy), 2, 2)
