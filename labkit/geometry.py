"""Angles, rotations and covariance ellipses in the plane; the aliases of types that signatures are written with."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
"""Numbers of a shape and unit that the docstring names."""
Point = NDArray[np.float64]
"""(2,) x and y [m]."""
Points = NDArray[np.float64]
"""(..., 2) x and y [m], world frame unless said otherwise."""
Pose = NDArray[np.float64]
"""(3,) x, y [m] and heading theta [rad], counter-clockwise from the x axis."""
Poses = NDArray[np.float64]
"""(..., 3) x, y [m] and heading theta [rad], world frame unless said otherwise."""
Motion = NDArray[np.float64]
"""(..., 3) how far ahead, to the left [m] and round [rad], in the frame of the pose that is left."""
Angle = float | NDArray[np.float64]
"""[rad], a number or an array of any shape."""
Mean = NDArray[np.float64]
"""(n,) an estimate: positions [m], then angles [rad]."""
Covariance = NDArray[np.float64]
"""(n, n) symmetric, no eigenvalue below zero; [m^2], [m rad], [rad^2] by the entries of the mean."""
Covariances = NDArray[np.float64]
"""(..., n, n) of them."""
Measurements = NDArray[np.float64]
"""(..., 2) offset (dx, dy) [m], or range [m] and bearing [rad]."""
Seed = int | np.random.Generator | None
"""What `numpy.random.default_rng` takes: a seed, a generator, or None for another run each time."""


def wrap(angle: ArrayLike) -> Array:
    """Bring angles (...,) [rad], of any shape, into (-pi, pi].

    Subtracting two bearings can give 359 degrees where the robot turned by -1: every *difference*
    of angles goes through here, nothing else does.
    """
    return np.pi - (np.pi - np.asarray(angle, dtype=float)) % (2 * np.pi)


def rotation(angle: float) -> Array:
    """Rotation matrix (2, 2) that turns a vector by `angle` [rad], counter-clockwise.

    `rotation(theta) @ v` takes `v` from a robot's frame with heading theta to the world frame.
    """
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def compose(pose: ArrayLike, motion: ArrayLike) -> Poses:
    """Poses (..., 3) after motions (..., 3) [m, m, rad], each in the frame of the pose that it leaves.

    Source: R. Smith, M. Self, P. Cheeseman, "Estimating uncertain spatial relationships in robotics" (1990), as are
    `inverse` and `relative`.
    """
    pose, motion = np.asarray(pose, dtype=float), np.asarray(motion, dtype=float)
    return _pose(pose[..., :2] + _turned(motion, pose[..., 2]), wrap(pose[..., 2] + motion[..., 2]))


def inverse(motion: ArrayLike) -> Motion:
    """The motions (..., 3) that undo these: composed with them, in either order, they lead nowhere."""
    motion = np.asarray(motion, dtype=float)
    return _pose(_turned(-motion, -motion[..., 2]), -motion[..., 2])


def relative(pose: ArrayLike, base: ArrayLike) -> Poses:
    """Poses (..., 3) in the frames of the poses `base` (..., 3): the motion from there to here."""
    pose, base = np.asarray(pose, dtype=float), np.asarray(base, dtype=float)
    return _pose(_turned(pose - base, -base[..., 2]), wrap(pose[..., 2] - base[..., 2]))


def transform(what: ArrayLike, angle: Angle, shift: ArrayLike = 0.0) -> Array:
    """Points (..., 2) or poses (..., 3) after a turn about the origin [rad] and then a shift (..., 2) [m]."""
    what = np.asarray(what, dtype=float)
    points = _turned(what, angle) + shift
    return points if what.shape[-1] == 2 else _pose(points, wrap(what[..., 2] + angle))


def align(a: ArrayLike, b: ArrayLike, weights: ArrayLike | None = None) -> tuple[float, Point]:
    """The (angle [rad], shift (2,) [m]) whose `transform` lays points a (N, 2) on b (N, 2) with the least squares.

    Rigid: no scale, no mirror; weights (N,), by default all alike.  Raises ValueError for fewer than two different
    points.  Source: K. Arun, T. Huang, S. Blostein, "Least-squares fitting of two 3-D point sets" (1987), in the plane.
    """
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    if a.shape != b.shape or a.ndim != 2 or a.shape[1] != 2:
        raise ValueError(f"a and b must have the same shape (N, 2), but have {a.shape} and {b.shape}")
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise ValueError("a and b must be finite numbers, but one of them is not")
    w = np.ones(len(a)) if weights is None else np.asarray(weights, dtype=float)
    w = w / w.sum()
    mean_a, mean_b = w @ a, w @ b
    p, q = a - mean_a, b - mean_b
    if len(a) < 2 or not min((p**2).sum(), (q**2).sum()) > 1e-12 * len(a):
        raise ValueError("two different points are the least that can be laid on others")
    angle = float(np.arctan2(w @ (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]), w @ (p * q).sum(axis=1)))
    return angle, mean_b - transform(mean_a, angle)


def _turned(points, angle):
    """The x and y of points or poses (..., 2 or more), turned by angles [rad] about the origin: (..., 2)."""
    c, s = np.cos(angle), np.sin(angle)
    x, y = points[..., 0], points[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def _pose(points, angle):
    return np.concatenate([points, np.asarray(angle)[..., None]], axis=-1)


def ellipse(mean: Points, cov: Covariances, sigmas: float = 3.0, points: int = 60) -> Points:
    """Outline (..., points, 2) [m] of the ellipse (x - mean)' cov^-1 (x - mean) = sigmas^2.

    `mean` (..., 2) and `cov` (..., 2, 2) may be stacked: many ellipses come in one call.
    In two dimensions the 3-sigma ellipse holds 98.9 % of the probability (not the 99.7 % that hold
    in one dimension).
    """
    angle = np.linspace(0.0, 2 * np.pi, points)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return np.asarray(mean)[..., None, :] + sigmas * circle @ np.swapaxes(root(cov), -1, -2)


def root(cov: Covariances) -> Array:
    """A matrix A (..., n, n) with A A' = cov: the one place where a covariance's root is taken.

    The eigenvalue form also takes a singular covariance (a robot without noise), where Cholesky
    would stop; tiny negative eigenvalues from rounding count as zero.
    """
    values, vectors = np.linalg.eigh(np.asarray(cov, dtype=float))
    return vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]


def weighted(poses: Poses, w: Array) -> tuple[Poses, Covariance]:
    """Mean (..., 3) and covariance of poses (m, ..., 3) with the weights w (m,), whose sum is 1.

    Headings are averaged as directions.  The covariance is (3n, 3n) of the n poses of each particle, in their order.
    """
    place, theta = np.tensordot(w, poses[..., :2], 1), poses[..., 2]
    heading = np.arctan2(w @ np.sin(theta), w @ np.cos(theta))
    mean = np.concatenate([place, np.asarray(heading)[..., None]], axis=-1)
    off = poses - mean
    off[..., 2] = wrap(off[..., 2])
    off = off.reshape(len(w), -1)
    return mean, (w * off.T) @ off


def resampled(w: Array, rng: np.random.Generator) -> np.ndarray:
    """Which (m,) of m particles with the weights w (m,) go on, each about m w times: low-variance resampling.

    Source: S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics" (2005), table 4.4.
    """
    m = len(w)
    return np.searchsorted(np.cumsum(w), (rng.random() + np.arange(m)) / m).clip(max=m - 1)
