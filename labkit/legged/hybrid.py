"""Two localizers that take turns: one that finds itself anywhere, and a quick one that follows."""

import numpy as np

from ..geometry import compose
from .inputs import as_count, as_motion, is_number, known


class Hybrid:
    """A localizer that switches: `predict(u)`, `update(y)`, `xk_k` (3,), `Pk_k` (3, 3), `mode`.

    finder:  a localizer that can start from nothing (a FuzzyGrid, a ParticleFilter); it has `reset()`.
    follow:  makes the quick one: called as follow(x0, P0), with the finder's estimate; it keeps in `d2` the
             squared distances of the sightings of its last update, in standard deviations.
    lost:    lost(P, d2) -> bool: whether the quick one should give up; P (3, 3), and d2 the last `memory` of them.
    background: with n > 0 the finder goes on working at every n-th step, so that it is ready when it is needed;
             with 0 it sleeps, and starts from nothing.

    Source: the paper, section 5.
    """

    def __init__(self, finder, follow, lost, background=0, quality=0.6, size=1.0, frames=3, memory=8):
        for name, value in (("frames", frames), ("memory", memory)):
            as_count(value, name)
        as_count(background, "background", 0)
        if not (is_number(quality) and is_number(size)):
            raise ValueError(f"quality and size must be numbers, but they are {quality!r} and {size!r}")
        self.finder, self.follow, self.lost = finder, follow, lost
        self.background, self.quality, self.size, self.frames, self.memory = (background, quality, size, frames, memory)
        self.quick, self.good, self.d2 = None, 0, []
        self._step, self._odometry, self._images = 0, np.zeros(3), []

    @property
    def mode(self):
        return "find" if self.quick is None else "follow"

    @property
    def xk_k(self):
        return (self.quick or self.finder).xk_k

    @property
    def Pk_k(self):
        return (self.quick or self.finder).Pk_k

    def predict(self, u):
        u = np.asarray(as_motion(u))
        self._step += 1
        if self.quick is None:
            self.finder.predict(u)
            return
        self.quick.predict(u)
        if self.background:
            self._odometry = compose(self._odometry, u)

    def update(self, y):
        if self.quick is None:
            self.finder.update(y)
            self._is_found(y)
            return
        known(y, self.finder.map)
        self.quick.update(y)
        self.d2 = (self.d2 + list(self.quick.d2))[-self.memory :]
        if self.background and self._step % self.background == 0:
            self.finder.predict(self._odometry)
            self.finder.update(y)
            self._odometry = np.zeros(3)
        if self.lost(self.quick.Pk_k, np.array(self.d2)):
            self._give_up()

    def _is_found(self, y):
        fits = self.finder.quality > self.quality and self.finder.size < self.size
        self.good = (self.good + 1 if fits else 0) if y else self.good
        if self.good >= self.frames:
            self.quick = self.follow(self.finder.xk_k, self.finder.Pk_k)
            self.good, self.d2, self._odometry = 0, [], np.zeros(3)

    def _give_up(self):
        if self.background:
            self.finder.predict(self._odometry)
            self._odometry = np.zeros(3)
        else:
            self.finder.reset()
        self.quick, self.good, self.d2 = None, 0, []
