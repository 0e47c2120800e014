"""Fuzzy grid localization: for each cell of the field, how possible it is, and which heading goes with it."""

from collections.abc import Sequence

import numpy as np

from ..geometry import Covariance, Motion, Pose, compose, transform
from ..validation import is_number
from .field import FIELD, Field
from .noise import Noise, as_noise
from .robot import Sighting
from .trapezoid import Trapezoids, fast_wrap, fused
from .validation import as_motion, as_sightings

FLOOR = 0.01  # no cell is ever ruled out: what is now impossible may be true after a kidnapping
RELIABILITY = 0.2  # bias of one sighting: what a cell keeps that contradicts it
ALPHA = 0.7  # cells at least this possible make up the estimate
STEADY = 0.6  # weight of the quality's past at each image with a landmark in it


class FuzzyGrid:
    """A localizer with `predict(u)`, `update(y)`, and the estimate in `xk_k` (3,), `Pk_k` (3, 3).

    noise: a Noise, or the name of a preset: what to expect of range and bearing.
    field: a Field.  cell: size of a cell [m].

    h (ny, nx) is how possible each cell is, theta (ny, nx) the heading in it, c and s half the core and half
    the support of its trapezoid [rad]; quality (from 0 to 1) and size [m] tell how good the estimate is.
    Source: the paper, section 3, after P. Buschka, A. Saffiotti, Z. Wasik, "Fuzzy landmark-based localization
    for a legged robot" (2000), and D. Herrero-Pérez, H. Martínez-Barberá, A. Saffiotti, "Fuzzy
    self-localization using natural features in the four-legged league" (2005).
    """

    xk_k: Pose
    Pk_k: Covariance

    def __init__(self, noise: Noise | str = "real", field: Field = FIELD, cell: float = 0.1):
        self.noise, self.field = as_noise(noise), field
        if not (is_number(cell) and 0.02 <= cell <= field.half.min()):
            raise ValueError(f"cell must be from 0.02 to {field.half.min():g} m, but it is {cell!r}")
        self.cell, self.map = float(cell), {lm.id: lm.p for lm in field.map}
        self.x, self.y = (np.arange(-half + cell / 2, half, cell) for half in field.half)
        self.reset()

    def reset(self) -> None:
        """Anywhere, with any heading."""
        self.px, self.py = np.meshgrid(self.x, self.y)
        shape = self.px.shape
        self.h, self.theta = np.ones(shape), np.zeros(shape)
        self.c, self.s = np.full(shape, np.pi), np.full(shape, np.pi)
        self.quality, self._walk = 0.0, np.zeros(2)
        self._locate()

    def predict(self, u: Motion) -> None:
        """Turn and walk by the odometry u (3,) of one step [m, m, rad], in the robot's frame."""
        turn, far = as_motion(u)[2], np.hypot(u[0], u[1])
        self.theta = fast_wrap(self.theta + turn)
        more = 0.15 * abs(turn) + 0.06 * far + 0.001
        self.c, self.s = np.minimum(self.c + more, np.pi), np.minimum(self.s + 2 * more, np.pi)
        # A step is much shorter than a cell: it is kept, in the frame of the robot as it now stands, until a
        # whole cell has come together. Shifting at every step would smear the grid.
        self._walk = transform(self._walk + u[:2], -turn)
        if np.hypot(*self._walk) >= self.cell:
            self._dilate()
            self._shift(self._walk)
            self._walk = np.zeros(2)
        self.xk_k = compose(self.xk_k, u)  # as the cells will, once a whole cell has come together
        # Until the next sighting the cells do not tell how far odometry has led astray; this does.
        self.Pk_k = self.Pk_k + self.noise.motion_covariance(u, self.Pk_k[2, 2])

    def update(self, y: Sequence[Sighting]) -> None:
        """Fuse the sightings of one image, a list, maybe empty."""
        best = 1.0
        for sighting in as_sightings(y, self.map):
            self.theta, self.c, self.s, self.h = fused(self._belief(), self._observed(sighting))
            top = self.h.max()
            self.h = np.maximum(self.h / top, FLOOR)
            best *= top
        if y:
            self._locate(best)

    def _belief(self):
        return Trapezoids(self.theta, self.c, self.s, self.h, FLOOR)

    def _observed(self, sighting):
        """What one sighting says of each cell: a trapezoid of headings, as high as the range fits."""
        r, bearing = sighting.p
        x, y = self.map[sighting.id]
        x, y = x - self.px, y - self.py
        distance = np.maximum(np.sqrt(x * x + y * y), 0.05)
        sigma_r = self.noise.of_range(sighting) * r + self.noise.range_floor
        core, flank = sigma_r + 0.3 * self.cell, 2 * sigma_r + 1e-9
        fits = np.clip(1 - 0.9 * (abs(distance - r) - core) / flank, RELIABILITY, 1.0)
        sigma = self.noise.of_bearing(sighting)
        blur = self.cell / distance  # by as much the direction changes within a cell [rad]
        c = np.minimum(sigma + 0.4 * blur, np.pi)
        s = np.minimum(3 * sigma + 0.8 * blur + 0.05, np.pi)
        theta = np.arctan2(y, x) - bearing
        return Trapezoids(theta, c, np.maximum(s, c), fits, RELIABILITY)

    def _dilate(self):
        """Grey dilation: a neighbour that is much more possible lends its height and its heading."""
        padded = np.pad(self.h, 1)
        ny, nx = self.h.shape
        best, source = self.h.copy(), np.arange(ny * nx).reshape(ny, nx)
        own = np.pad(source, 1)
        for dy, dx in [(0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)]:
            window = np.s_[1 + dy : 1 + dy + ny, 1 + dx : 1 + dx + nx]
            other = padded[window] * (0.3 if dx * dy == 0 else 0.3 * 0.71)
            better = other > best
            best[better], source[better] = other[better], own[window][better]
        self.h = best
        self.theta, self.c, self.s = (a.ravel()[source] for a in (self.theta, self.c, self.s))

    def _shift(self, walk):
        """Move what is in each cell by `walk` (2,) [m] along its own heading, into another cell."""
        dx, dy = np.moveaxis(transform(walk, self.theta), -1, 0)
        self.px, self.py = self.px + dx, self.py + dy
        column, row = (np.rint((p - ax[0]) / self.cell).astype(int) for p, ax in ((self.px, self.x), (self.py, self.y)))
        ny, nx = self.h.shape
        inside = (row >= 0) & (row < ny) & (column >= 0) & (column < nx)
        # Where two meet, the more possible one is written last; of two alike the same one on every processor.
        order = np.argsort(self.h[inside], kind="stable")
        to = (row * nx + column)[inside][order]
        centre = np.meshgrid(self.x, self.y)
        empty = {"h": FLOOR, "theta": 0.0, "c": np.pi, "s": np.pi, "px": centre[0], "py": centre[1]}
        for name, value in empty.items():
            new = np.broadcast_to(value, (ny, nx)).flatten()
            new[to] = getattr(self, name)[inside][order]
            setattr(self, name, new.reshape(ny, nx))

    def _locate(self, best=None):
        """Estimate, covariance, size, and quality from the cells that are possible enough."""
        row, column = np.nonzero(self.h > ALPHA * self.h.max())
        w, theta = self.h[row, column], self.theta[row, column]
        w = w / w.sum()
        x, y = self.px[row, column], self.py[row, column]
        heading = np.arctan2(w @ np.sin(theta), w @ np.cos(theta))
        mean = np.array([w @ x, w @ y, heading])
        off = np.stack([x - mean[0], y - mean[1], fast_wrap(theta - heading)])
        P = (w * off) @ off.T + np.diag([self.cell**2 / 12, self.cell**2 / 12, 0.0])
        P[2, 2] += float(w @ self.c[row, column]) ** 2 / 3 + 1e-6
        mean[:2] += transform(self._walk, heading)
        box = np.array([np.ptp(x), np.ptp(y)]) + self.cell
        self.size = float(box.max())
        if best is not None:
            share = best * (1 - min(box.prod() / self.field.area, 1.0))
            self.quality = STEADY * self.quality + (1 - STEADY) * share
            doubt = max(0.0, 0.6 - self.quality)  # cells that hardly fit what is seen are a guess, however few
            P[[0, 1], [0, 1]] += (doubt * self.field.half) ** 2
        self.xk_k, self.Pk_k = mean, P
