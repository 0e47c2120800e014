"""Monte Carlo localization: many guesses, kept or dropped by how well they explain what is seen."""

from collections.abc import Sequence

import numpy as np

from ..geometry import Covariance, Motion, Pose, Seed, compose, resampled, weighted, wrap
from ..validation import as_count
from .field import FIELD, Field
from .memory import poses_around
from .noise import Noise, as_noise
from .robot import Sighting
from .validation import as_motion, as_sightings

OUTLIER = 0.05  # how far a sighting may be from all sense: likelihood that is always left
SLOW, FAST = 0.05, 0.5  # rates of the two averages of the likelihood that the filter compares
DOUBT = 1.5  # particles are drawn anew when DOUBT times the fast average is below the slow one
USUAL = 0.5  # what the slow average starts from, so that the first sightings already place particles


class ParticleFilter:
    """A localizer with `predict(u)`, `update(y)`, `xk_k` (3,), `Pk_k` (3, 3), and its particles (n, 3).

    n: how many.  noise, field: as for a FuzzyGrid.  rng: a numpy Generator, or a seed for one.

    When the likelihood of what is seen drops below its long-term average, part of the particles are drawn anew,
    from poses that explain a present sighting.  Source: S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics"
    (2005), table 8.3 (augmented MCL); S. Lenser, M. Veloso, "Sensor resetting localization for poorly modelled
    mobile robots" (2000).
    """

    xk_k: Pose
    Pk_k: Covariance

    def __init__(self, n: int = 500, noise: Noise | str = "real", field: Field = FIELD, rng: Seed = None):
        self.noise, self.field, self.rng = as_noise(noise), field, np.random.default_rng(rng)
        self.map = {lm.id: lm.p for lm in field.map}
        self.n = as_count(n, "n", 10)
        self.reset()

    def reset(self) -> None:
        """Anywhere, with any heading."""
        half = np.array([*self.field.half, np.pi])
        self.particles = self.rng.uniform(-half, half, (self.n, 3))
        self.w = np.full(self.n, 1 / self.n)
        self.slow, self.fast = USUAL, 0.0
        self._locate()

    @property
    def quality(self) -> float:
        """From 0 to 1: how well the particles explain what was seen lately, compared with their long-term average."""
        return min(1.0, self.fast / self.slow)

    @property
    def size(self) -> float:
        """How far the particles are spread [m]: four standard deviations."""
        return 4 * float(np.sqrt(np.trace(self.Pk_k[:2, :2])))

    def predict(self, u: Motion) -> None:
        """Move each particle by the odometry u (3,) of one step and an error of its own."""
        noise, u = self.noise, as_motion(u)
        sigma = noise.odometry * abs(u) + [noise.slip, noise.slip, noise.spin]
        sigma = np.maximum(sigma, [0.004, 0.004, 0.01])
        self.particles = compose(self.particles, u + sigma * self.rng.standard_normal((self.n, 3)))
        self.xk_k = compose(self.xk_k, u)  # the particles' mean would count those that are quite elsewhere
        self.Pk_k = self.Pk_k + noise.motion_covariance(u, self.Pk_k[2, 2])

    def update(self, y: Sequence[Sighting]) -> None:
        """Weigh the particles by the sightings of one image, and draw them anew when few of them count."""
        if not as_sightings(y, self.map):
            return
        w = self.w
        for sighting in y:
            w = w * self._likelihood(sighting)
        mean = float(w.sum()) ** (1 / len(y))
        self.slow += SLOW * (mean - self.slow)
        self.fast += FAST * (mean - self.fast)
        self.w = w / w.sum()
        self._locate()
        if 1 / (self.w @ self.w) < self.n / 2 or DOUBT * self.fast < self.slow:
            self._resample(y)

    def _likelihood(self, sighting):
        r, bearing = sighting.p
        dx, dy = (self.map[sighting.id] - self.particles[:, :2]).T
        distance = np.hypot(dx, dy)
        sigma_r = self.noise.of_range(sighting) * distance + self.noise.range_floor + 0.05
        sigma = self.noise.of_bearing(sighting) + 0.02
        off = wrap(np.arctan2(dy, dx) - self.particles[:, 2] - bearing)
        d2 = ((distance - r) / sigma_r) ** 2 + (off / sigma) ** 2
        return np.exp(-d2 / 2) + OUTLIER / 10

    def _resample(self, y):
        self.particles = self.particles[resampled(self.w, self.rng)]
        self.w = np.full(self.n, 1 / self.n)
        anew = int(self.n * max(0.0, 1 - DOUBT * self.fast / self.slow))
        if anew:
            self._draw(self.rng.choice(self.n, anew, replace=False), y)

    def _draw(self, which, y):
        for part, sighting in zip(np.array_split(which, len(y)), y):
            n = len(part)
            r = sighting.p[0] * (1 + self.noise.of_range(sighting) * self.rng.standard_normal(n))
            bearing = sighting.p[1] + self.noise.of_bearing(sighting) * self.rng.standard_normal(n)
            self.particles[part] = poses_around(self.map[sighting.id], r, bearing, self.rng.uniform(-np.pi, np.pi, n))

    def _locate(self):
        self.xk_k, P = weighted(self.particles, self.w)
        self.Pk_k = P + 1e-9 * np.eye(3)
