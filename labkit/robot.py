"""The handout's robot: a point that drives a square and looks at landmarks."""

import numpy as np
from numpy.typing import ArrayLike

from .geometry import Array, Covariance, Measurements, Point, Seed, root, wrap
from .validation import as_covariance, as_point, is_number
from .world import SENSORS, Landmark, Map, positions, sensed

DT = 0.25  # [s] one step of the handout's simulation
# The noise of the handout's scripts: Q per second, R of one landmark times one second.
HANDOUT_Q = np.diag([0.25**2, 0.25**2])
HANDOUT_R = {"xy": np.diag([0.2**2, 0.2**2]), "rb": np.diag([0.2**2, np.deg2rad(5) ** 2])}
# Up, left, down, right; then one more side's time standing still.
SIDES = np.array([[0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [1.0, 0.0], [0.0, 0.0]])


class Robot:
    """A point robot whose velocity is commanded: x_{k+1} = x_k + T v_k + w,  w ~ N(0, Q T).

    pose:  (2,) start [m], world frame.
    Q:     (2, 2) process noise covariance per second [m^2/s].
    R:     (2, 2) measurement noise covariance of one landmark times one second;
           [m^2 s], for 'rb' diag([m^2 s], [rad^2 s]).
    range: how far it sees [m].  type: 'xy' (relative position) or 'rb' (range and bearing).
    rng:   a numpy Generator, or a seed for one: the same seed gives the same run.

    Fields `p` (true position), `Q` = Q*dt and `R` = R/dt (covariances of one step), `dt`, `t`, `v`,
    `ti` (time a side), `tf` (whole run), `range`, `type`, `objs` (what was last seen).
    Source: the practice handout, section 2.  Unlike its script, noise is drawn from the covariance,
    not with the variance used as a standard deviation.
    """

    def __init__(
        self, pose: Point, Q: Covariance, R: Covariance, range: float = 2.5, type: str = "xy", rng: Seed = None
    ):
        if type not in SENSORS:
            raise ValueError(f"type must be 'xy' or 'rb', but it is {type!r}")
        if not (range == np.inf or is_number(range)) or not range > 0:
            raise ValueError(f"range must be a positive distance in metres, but it is {range!r}")
        self.dt, self.v, self.ti, self.tf = DT, 0.5, 8.0, 40.0
        self.p = as_point(pose, "pose")
        self.Q = as_covariance(Q, "Q") * self.dt
        self.R = as_covariance(R, "R") / self.dt
        self.range, self.type = float(range), type
        self.rng = np.random.default_rng(rng)
        self.t = 0.0
        self.objs: list[Landmark] = []

    def velocity(self, t: ArrayLike) -> Array:
        """Commanded velocity (..., 2) [m/s] at times t [s]."""
        side = np.minimum(np.asarray(t) // self.ti, len(SIDES) - 1).astype(int)
        return self.v * SIDES[side]

    def action(self) -> Array:
        """Drive one step; return the commanded velocity (2,) [m/s], which is all a filter may know."""
        u = self.velocity(self.t)
        self.p = self.p + self.dt * u + root(self.Q) @ self.rng.standard_normal(2)
        self.t += self.dt
        return u

    def measure(self, m: Map) -> list[Landmark]:
        """Landmarks of `m` within range, as a list of Landmark with noisy relative `p` (maybe [])."""
        offset = positions(m) - self.p
        seen = np.flatnonzero(np.hypot(*offset.T) <= self.range)
        values = add_noise(sensed(offset[seen], self.type), self.R, self.type, self.rng)
        self.objs = [Landmark._of(p, m[i].id) for i, p in zip(seen, values)]
        return self.objs


def add_noise(values: Measurements, R: Covariance, sensor: str, rng: np.random.Generator) -> Measurements:
    """Measurements (n, 2) with noise from N(0, R); bearings stay in (-pi, pi]."""
    noisy = values + rng.standard_normal(values.shape) @ root(R).T
    if sensor == "rb":
        noisy[:, 1] = wrap(noisy[:, 1])
    return noisy
