"""Pictures of a curve and the straight line in its place: what an extended Kalman filter puts up with."""

from collections.abc import Callable

import numpy as np

from .geometry import Array
from .plots import BLUE, GREY, VERMILION, legend_below

Sensor = Callable[[Array, Array], Array]
"""(position (2,) [m], landmark (2,) [m]) -> [range [m], bearing [rad]], or its derivatives (2, 2)."""


def show_tangent(h: Sensor, jacobian: Sensor, landmark: Array, at: float, sigma: float, samples: int = 20_000) -> None:
    """Draw the range to a landmark for a robot on the x axis, and a belief about it pushed through curve and tangent.

    h, jacobian: the student's own;  landmark (2,) [m];  at, sigma: mean and standard deviation of the belief [m].
    """
    import matplotlib.pyplot as plt  # here, so that importing the kit loads nothing that draws

    def curve(x):
        return np.array([h(np.array([one, 0.0]), landmark)[0] for one in np.ravel(x)])

    slope = jacobian(np.array([at, 0.0]), landmark)[0, 0]
    middle = curve([at])[0]
    x = np.linspace(at - 3.2 * sigma, at + 3.2 * sigma, 161)
    believed = at + sigma * np.random.default_rng(0).standard_normal(samples)
    curved, straight = curve(believed), middle + slope * (believed - at)

    _, (left, right) = plt.subplots(1, 2, figsize=(10, 3.8), layout="constrained")
    left.plot(x, curve(x), color=BLUE, label="the curve, h")
    left.plot(x, middle + slope * (x - at), "--", color=VERMILION, label="its tangent, by the Jacobian")
    left.plot(at, middle, "o", color=VERMILION, label="the estimate")
    left.axvspan(at - sigma, at + sigma, color=GREY, alpha=0.2, lw=0, label="belief about x, ±σ")
    left.set(xlabel="x of the robot [m]", ylabel="expected range [m]", title=f"a belief with σ = {sigma:g} m")
    bins = np.linspace(min(straight.min(), 0), max(curved.max(), straight.max()), 80)
    right.hist(curved, bins, color=BLUE, alpha=0.6, label="through the curve")
    right.hist(straight, bins, color=VERMILION, histtype="step", lw=1.8, label="through the tangent")
    right.axvline(0, color=GREY, lw=1)
    right.set(xlabel="expected range [m]", ylabel="how often", yticks=[], title="the belief, pushed through both")
    for ax in (left, right):
        legend_below(ax)
    plt.show()
