"""Triangulation: the pose that fits the latest sightings of a few landmarks, and nothing else."""

from collections.abc import Sequence

import numpy as np

from ..geometry import Motion, align, compose, transform
from .field import FIELD, Field
from .robot import Sighting
from .validation import as_motion, as_sightings

OLD = 20  # steps after which a sighting is forgotten


class Triangulation:
    """A localizer with `predict(u)`, `update(y)`, `xk_k` (3,), `Pk_k` (3, 3).

    Keeps where each landmark was last seen, in the robot's frame, and carries that along by odometry. With two
    or more landmarks their places and those of the map are laid on one another: see `labkit.geometry.align`.
    """

    def __init__(self, field: Field = FIELD):
        self.map = {lm.id: lm.p for lm in field.map}
        self.seen: dict[str, list] = {}  # id: [place in the robot's frame (2,), age, weight]
        self.xk_k, self.Pk_k = np.zeros(3), np.diag([*field.half**2, np.pi**2]) / 3

    def predict(self, u: Motion) -> None:
        """Carry what was seen along by the odometry u (3,) of one step."""
        u = as_motion(u)
        self.seen = {
            name: [transform(p - u[:2], -u[2]), age + 1, weight]
            for name, (p, age, weight) in self.seen.items()
            if age < OLD
        }
        self.xk_k = compose(self.xk_k, u)
        self.Pk_k = self.Pk_k + np.diag([0.02, 0.02, 0.05]) ** 2  # without a fit it knows less with every step

    def update(self, y: Sequence[Sighting]) -> None:
        """Note the sightings of one image, then fit, if there is anything new."""
        for sighting in as_sightings(y, self.map):
            r, bearing = sighting.p
            place = r * np.array([np.cos(bearing), np.sin(bearing)])
            self.seen[sighting.id] = [place, 0, (1.0 if sighting.complete else 0.1) / max(r, 0.3) ** 2]
        if len(self.seen) >= 2 and y:
            self._fit()

    def _fit(self):
        p = np.array([place for place, _, _ in self.seen.values()])
        m = np.array([self.map[name] for name in self.seen])
        w = np.array([weight for _, _, weight in self.seen.values()])
        w = w / w.sum()
        theta, shift = align(p, m, w)
        left = m - transform(p, theta, shift)
        self.xk_k = np.array([*shift, theta])
        spread = 0.1**2 + float(w @ (left**2).sum(axis=1))
        self.Pk_k = np.diag([spread, spread, spread / max(float(w @ ((p - w @ p) ** 2).sum(axis=1)), 0.01)])
