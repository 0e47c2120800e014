"""Two localizers that take turns: a finder that starts from anywhere, and a quick tracker."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..geometry import Covariance, Motion, Pose, compose
from ..validation import as_count, is_number
from ..world import Landmark
from .validation import as_motion, as_sightings


class Hybrid:
    """A localizer that switches: `predict(u)`, `update(y)`, `xk_k` (3,), `Pk_k` (3, 3), `mode`.

    finder:  a localizer that can start from nothing and knows how good its estimate is (a FuzzyGrid, a ParticleFilter):
             it has `reset()`, `quality` and `size`.
    follow:  makes the tracker: called as follow(x0, P0), with the finder's estimate; it keeps in `d2` the
             squared distances of the sightings of its last update, in standard deviations.
    lost:    lost(P, d2) -> bool: whether the tracker should give up; P (3, 3), and d2 the last `memory` of them.
    background: with n > 0 the finder goes on working at every n-th step, so that it is ready when it is needed;
             with 0 it sleeps, and starts from nothing.

    `switches` counts how often one has handed over to the other.

    Source: the paper, section 5.
    """

    def __init__(
        self,
        finder: Any,
        follow: Callable[[Pose, Covariance], Any],
        lost: Callable[..., bool],
        background: int = 0,
        quality: float = 0.6,
        size: float = 1.0,
        frames: int = 3,
        memory: int = 8,
    ):
        for name, value in (("frames", frames), ("memory", memory)):
            as_count(value, name)
        as_count(background, "background", 0)
        if not (is_number(quality) and is_number(size)):
            raise ValueError(f"quality and size must be numbers, but they are {quality!r} and {size!r}")
        if missing := [name for name in ("reset", "quality", "size") if not hasattr(finder, name)]:
            raise ValueError(f"finder must be a FuzzyGrid or a ParticleFilter; {finder!r} has no `{missing[0]}`")
        self.finder, self.follow, self.lost = finder, follow, lost
        self.background, self.quality, self.size, self.frames, self.memory = (background, quality, size, frames, memory)
        self.tracker: Any = None
        self.d2: list[float] = []
        self.good, self.switches, self._step, self._odometry = 0, 0, 0, np.zeros(3)

    @property
    def mode(self) -> str:
        """Which of the two is at work: 'find' or 'follow'."""
        return "find" if self.tracker is None else "follow"

    @property
    def xk_k(self) -> Pose:
        """Estimate (3,) of whichever is at work."""
        return (self.tracker or self.finder).xk_k

    @property
    def Pk_k(self) -> Covariance:
        """Its covariance (3, 3)."""
        return (self.tracker or self.finder).Pk_k

    def predict(self, u: Motion) -> None:
        """Pass the odometry u (3,) of a step on to whoever needs it."""
        u = as_motion(u)
        self._step += 1
        if self.tracker is None:
            self.finder.predict(u)
            return
        self.tracker.predict(u)
        if self.background:
            self._odometry = compose(self._odometry, u)

    def update(self, y: Sequence[Landmark]) -> None:
        """Pass the sightings of an image on, then switch if there is reason to."""
        if self.tracker is None:
            self.finder.update(y)
            self._is_found(y)
            return
        as_sightings(y, self.finder.map)
        self.tracker.update(y)
        self.d2 = (self.d2 + list(self.tracker.d2))[-self.memory :]
        if self.background and self._step % self.background == 0:
            self.finder.predict(self._odometry)
            self.finder.update(y)
            self._odometry = np.zeros(3)
        if self.lost(self.tracker.Pk_k, np.array(self.d2)):
            self._give_up()

    def _is_found(self, y):
        fits = self.finder.quality > self.quality and self.finder.size < self.size
        self.good = (self.good + 1 if fits else 0) if y else self.good
        if self.good >= self.frames:
            self.tracker = self.follow(self.finder.xk_k, self.finder.Pk_k)
            self.good, self.d2, self._odometry = 0, [], np.zeros(3)
            self.switches += 1

    def _give_up(self):
        if self.background:
            self.finder.predict(self._odometry)
            self._odometry = np.zeros(3)
        else:
            self.finder.reset()
        self.tracker, self.good, self.d2 = None, 0, []
        self.switches += 1
