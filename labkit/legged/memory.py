"""Poses that explain a sighting, and a memory of the last sightings for whoever has to start anew."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks.feedback import FilterError, explain
from ..geometry import Array, Covariance, Motion, Points, Pose, Poses, compose, inverse, relative, wrap
from ..validation import as_count, as_covariance
from ..world import Landmark
from .field import FIELD, Field
from .noise import Noise, as_noise
from .robot import Sighting
from .validation import as_motion, as_sightings


def poses_around(place: Points, r: Array | float, bearing: Array | float, directions: Array) -> Poses:
    """Poses (n, 3) from which a landmark at `place` (2,) [m] is seen at range r [m] and bearing [rad], numbers or (n,).

    directions (n,) [rad]: of the robot as seen from the landmark, in the world frame.
    """
    x = place[0] + r * np.cos(directions)
    y = place[1] + r * np.sin(directions)
    return np.stack([x, y, wrap(directions + np.pi - bearing)], axis=-1)


@dataclass(frozen=True)
class PastSightings:
    """The last n sightings, the oldest first, as seen from now.

    places (n, 2) [m] of the landmarks in the map;  seen (n, 2) (range [m], bearing [rad]);
    sigma  (n, 2) [m], [rad] standard deviations of those;
    since  (n, 3) the motion from then to now;  before (n, 3) the motion back, from now to then.
    """

    places: Points
    seen: Array
    sigma: Array
    since: Motion
    before: Motion

    def __len__(self):
        return len(self.seen)


def walked(pose: Pose, metres: float = 1.0, field: Field = FIELD) -> PastSightings:
    """What a robot remembers that has walked to a pose (3,) in a bow, and saw each landmark once, without any noise."""
    places = np.array([lm.p for lm in field.map])
    back = np.linspace(-metres, 0, len(places))[:, None] * [1.0, 0.2, 0.6]  # ahead, left [m], round [rad]
    x, y, _ = relative(np.column_stack([places, np.zeros(len(places))]), compose(pose, back)).T
    seen = np.column_stack([np.hypot(x, y), np.arctan2(y, x)])
    sigma = np.column_stack([0.1 * seen[:, 0] + 0.05, np.full(len(places), 0.05)])
    return PastSightings(places, seen, sigma, inverse(back), back)


class Memory:
    """A finder for a Hybrid that only remembers, and is asked for a pose only when one is wanted.

    restart: restart(past) -> (x0 (3,), P0 (3, 3)), or None as long as the sightings leave it open.
    most:    how many sightings are kept.
    """

    def __init__(
        self, restart: Callable[[PastSightings], Any], noise: Noise | str = "real", field: Field = FIELD, most: int = 10
    ):
        self.restart, self.noise, self.most = restart, as_noise(noise), as_count(most, "most")
        self.map = {lm.id: lm.p for lm in field.map}
        self._wide = np.diag([*field.half**2, np.pi**2]) / 3
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._seen: list[tuple[Landmark, Pose]] = []
        self._now, self._answer, self._fresh = np.zeros(3), None, True

    def predict(self, u: Motion) -> None:
        """Add the odometry u (3,) of one step to the motion since each sighting."""
        self._now = compose(self._now, as_motion(u))  # in the frame of where the memory begins
        self._fresh = False

    def update(self, y: Sequence[Sighting]) -> None:
        """Remember the sightings of one image."""
        self._seen += [(sighting, self._now) for sighting in as_sightings(y, self.map)]
        self._seen = self._seen[-self.most :]
        self._fresh = self._fresh and not y

    def remembered(self) -> PastSightings:
        """What is kept, as seen from now."""
        noise, sightings = self.noise, [s for s, _ in self._seen]
        seen = np.reshape([s.p for s in sightings], (-1, 2))
        places = np.reshape([self.map[s.id] for s in sightings], (-1, 2))
        sigma = [(noise.of_range(s) * s.p[0] + noise.range_floor, noise.of_bearing(s)) for s in sightings]
        since = relative(self._now, np.reshape([pose for _, pose in self._seen], (-1, 3)))
        return PastSightings(places, seen, np.reshape(sigma, (-1, 2)) + 1e-6, since, inverse(since))

    def _ask(self):
        if not self._fresh:
            self._answer = self._asked() if self._seen else None
            self._fresh = True
        return self._answer

    def _asked(self):
        """(x0, P0) from `restart`, or None; raises FilterError that names it if it gives anything else."""
        try:
            found = self.restart(self.remembered())
        except NotImplementedError:
            raise
        except Exception as error:
            raise FilterError(f"`restart` stopped. {explain(error)}") from error
        if found is None:
            return None
        try:
            x0, P0 = found
            x0, P0 = np.array(x0, dtype=float), np.array(P0, dtype=float)
            if x0.shape != (3,) or not np.isfinite(x0).all():
                raise ValueError("x0 is no pose (3,)")
            return x0, as_covariance(P0, "P0", 3)
        except (TypeError, ValueError) as error:
            what = f"it returned {found!r:.200}"
            raise FilterError(f"`restart` should return (x0 (3,), P0 (3, 3)) or None, but {what}: {error}.") from error

    @property
    def quality(self) -> float:
        """1 if `restart` has an answer, else 0."""
        return 1.0 if self._ask() is not None else 0.0

    @property
    def size(self) -> float:
        """Standard deviation of the answer's position [m], infinite without one."""
        found = self._ask()
        return np.inf if found is None else float(np.sqrt(np.trace(found[1][:2, :2])))

    @property
    def xk_k(self) -> Pose:
        """The answer's pose (3,), or the middle of the field."""
        found = self._ask()
        return np.zeros(3) if found is None else found[0]

    @property
    def Pk_k(self) -> Covariance:
        """The answer's covariance (3, 3), or that of a pose anywhere on the field."""
        found = self._ask()
        return self._wide if found is None else found[1]
