"""How noisy a legged robot is: the knobs of the paper's simulator, and three ways to set them."""

from dataclasses import asdict, dataclass, replace

import numpy as np

from ..geometry import Covariance, Motion
from ..validation import is_number
from ..world import Landmark
from .field import is_goal


@dataclass(frozen=True)
class Noise:
    """What a simulated robot suffers, and what a filter may be told of it.

    Of one step, or of one sighting, as standard deviations (as bounds, if `uniform`):
    odometry        fraction of each component of the step's motion
    slip, spin      [m], [rad] on top of that, also of a robot that stands still
    range_beacon, range_goal   fractions of the range;  range_floor [m] on top of them
    bearing, bearing_partial   [rad] of a landmark that is wholly, or only partly, in view

    Of a whole run:
    odometry_bias, range_bias  fractions that stay the same throughout, with either sign

    What no filter is told:
    occlusion       how probable it is that something hides a landmark in view
    false_positives how probable it is that an image shows a landmark where there is none
    uniform         errors are uniform within bounds (as in the paper's simulator), not normal

    Raises ValueError, with the argument's name, for numbers that cannot be.
    """

    odometry: float = 0.0
    range_beacon: float = 0.0
    range_goal: float = 0.0
    bearing: float = 0.0
    bearing_partial: float = 0.0
    odometry_bias: float = 0.0
    range_bias: float = 0.0
    occlusion: float = 0.0
    false_positives: float = 0.0
    slip: float = 0.001
    spin: float = 0.002
    range_floor: float = 0.0
    uniform: bool = False

    def __post_init__(self):
        for name, value in asdict(self).items():
            if name == "uniform":
                if not isinstance(value, bool | np.bool_):
                    raise ValueError(f"uniform must be True or False, but it is {value!r}")
                continue
            probability = name in ("occlusion", "false_positives")
            if not (is_number(value) and 0 <= value <= (1 if probability else 10)):
                what = "a probability from 0 to 1" if probability else "a number from 0 to 10"
                raise ValueError(f"{name} must be {what}, but it is {value!r}")

    def __repr__(self):
        used = {name: value for name, value in asdict(self).items() if value}
        return f"Noise({', '.join(f'{k}={v:.3g}' if v is not True else f'{k}=True' for k, v in used.items())})"

    def told(self) -> "Noise":
        """What to tell a filter. A bias that nobody knows is noise to it, and must be told as such.

        The noise of ten steps partly cancels out, their common bias does not: the bias of odometry counts twice.
        """
        a, b = 2 * self.odometry_bias, self.range_bias
        return replace(
            self,
            odometry=self.odometry + a,
            range_beacon=self.range_beacon + b,
            range_goal=self.range_goal + b,
            odometry_bias=0.0,
            range_bias=0.0,
            occlusion=0.0,
            false_positives=0.0,
        )

    def motion_covariance(self, u: Motion, heading: float) -> Covariance:
        """Covariance (3, 3) that odometry u (3,) adds to a pose whose heading has the variance `heading` [rad^2]."""
        far, turn = np.hypot(u[0], u[1]), abs(u[2])
        xy = (self.odometry * far + self.slip) ** 2 + far**2 * min(heading, 1.0)
        return np.diag([xy, xy, (self.odometry * turn + self.spin) ** 2])

    def of_range(self, landmark: Landmark) -> float:
        """Standard deviation of a range to this landmark, as a fraction of the range."""
        return self.range_goal if is_goal(landmark) else self.range_beacon

    def of_bearing(self, landmark: Landmark) -> float:
        """Standard deviation of a bearing to this landmark [rad], which may be only partly in view."""
        return self.bearing if landmark.complete else self.bearing_partial


WHOLE, PARTLY = np.deg2rad([2.0, 18.0]).tolist()  # the paper's section 4.2: a landmark wholly in view, and partly
PAPER = Noise(0.10, 0.05, 0.08, WHOLE, PARTLY, uniform=True)
REAL = Noise(0.20, 0.10, 0.15, WHOLE, PARTLY, 0.05, 0.03, 0.20, 0.01)
HARSH = Noise(0.30, 0.20, 0.30, 2 * WHOLE, PARTLY, 0.10, 0.08, 0.40, 0.05)
PRESETS = {"paper": PAPER, "real": REAL, "harsh": HARSH}


def as_noise(value: Noise | str) -> Noise:
    """A Noise, or the one that a preset's name stands for; raises ValueError for anything else."""
    if isinstance(value, Noise):
        return value
    if not isinstance(value, str) or value not in PRESETS:
        raise ValueError(f"noise must be a Noise or one of {', '.join(PRESETS)}, but it is {value!r}")
    return PRESETS[value]
