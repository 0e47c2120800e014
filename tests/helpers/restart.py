"""A `restart` for a Memory: the pose that explains the last sightings, by particles that are drawn anew."""

import numpy as np

from labkit import wrap
from labkit.geometry import compose
from labkit.legged import FIELD, poses_around


def restart(past, rounds=4, n=200):
    """(x0 (3,), P0 (3, 3)) of the pose that explains what is remembered, or None."""
    if len(past) < 4:
        return None
    rng = np.random.default_rng(len(past))
    around = np.linspace(-np.pi, np.pi, 48, endpoint=False)
    latest = list(zip(past.places, past.seen, past.since))[-4:]
    poses = np.vstack([compose(poses_around(place, *seen, around), since) for place, seen, since in latest])
    poses = poses[(np.abs(poses[:, :2]) < FIELD.half).all(axis=1)]
    if not len(poses):
        return None
    for k in range(rounds):
        then = compose(poses[:, None], past.before)  # where each of these would have been at each sighting
        dx, dy = np.moveaxis(past.places - then[..., :2], -1, 0)
        off = wrap(np.arctan2(dy, dx) - then[..., 2] - past.seen[:, 1])
        d2 = ((np.hypot(dx, dy) - past.seen[:, 0]) / past.sigma[:, 0]) ** 2 + (off / past.sigma[:, 1]) ** 2
        cost = np.minimum(d2, 13.8).sum(axis=1)
        w = np.exp(-(cost - cost.min()) / 2 / 4.0 ** (rounds - 1 - k))  # at first many are worth a look
        w = w / w.sum()
        if k < rounds - 1:
            pick = np.searchsorted(np.cumsum(w), (rng.random() + np.arange(n)) / n)
            poses = poses[np.minimum(pick, len(poses) - 1)] + 0.3 / 2**k * rng.standard_normal((n, 3))
    fits = d2[cost.argmin()] < 9.2
    if fits.sum() < 4 or fits.mean() < 0.6:
        return None
    x0 = np.array([w @ poses[:, 0], w @ poses[:, 1], np.arctan2(w @ np.sin(poses[:, 2]), w @ np.cos(poses[:, 2]))])
    e = poses - x0
    e[:, 2] = wrap(e[:, 2])
    P0 = (w * e.T) @ e + 0.05**2 * np.eye(3)
    return (x0, P0) if np.sqrt(P0[0, 0] + P0[1, 1]) < 0.35 and P0[2, 2] < 0.35**2 else None
