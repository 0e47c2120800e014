"""What every particle filter does with its weights: mean and covariance of weighted poses, and resampling."""

import numpy as np

from .geometry import Array, Covariance, Poses, wrap


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
