"""Pictures of Gaussian beliefs: one number's bell, two bells that meet, and in the plane a cloud with its ellipse."""

from typing import Self

import numpy as np
from matplotlib.axes import Axes

from ..geometry import Array, Covariance, Points, ellipse
from . import BLUE, GREY, VERMILION, legend_below

Bell = tuple[float, float]
"""(mean [m], variance [m^2])."""


def density(x: Array, bell: Bell) -> Array:
    """The height (n,) [1/m] of a bell at x (n,) [m]."""
    mean, variance = bell
    return np.exp(-((x - mean) ** 2) / (2 * variance)) / np.sqrt(2 * np.pi * variance)


def draw_bell(ax: Axes, readings: Array, bell: Bell) -> None:
    """How often readings (n,) [m] came, and the bell that they follow with its σ."""
    mean, sigma = bell[0], np.sqrt(bell[1])
    x = np.linspace(mean - 4 * sigma, mean + 4 * sigma, 200)
    ax.hist(readings, x[::5].tolist(), density=True, color=BLUE, alpha=0.35, label="readings")
    ax.plot(x, density(x, bell), color=BLUE, label="the bell")
    for n, style in ((1, "--"), (3, ":")):
        for side in (-n, n):
            ax.axvline(mean + side * sigma, color=GREY, ls=style, lw=1, label=f"mean ± {n}σ" if side > 0 else None)
    ax.set(xlabel="reading [m]", ylabel="how often", yticks=[])
    ax.legend(loc="upper left", bbox_to_anchor=(1, 1), fontsize=8, frameon=False)


def draw_cloud(ax: Axes, points: Points, P: Covariance) -> None:
    """Points (n, 2) [m] drawn from a belief about the origin, and its 3-sigma ellipse."""
    ax.plot(*points.T, ".", color=GREY, ms=2, alpha=0.5, label="possible places")
    ax.plot(*ellipse(np.zeros(2), P).T, color=VERMILION, label="3σ ellipse")
    ax.plot(0, 0, "+", color=VERMILION, ms=11, mew=2, label="estimate")
    ax.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    ax.legend(loc="upper left", bbox_to_anchor=(1, 1), fontsize=8, frameon=False)


class BellPanel:
    """A belief about a place on a line, what a sensor says, and the belief after it: three bells."""

    def __init__(self, ax: Axes, reach: float = 6.0):
        self.x = np.linspace(-reach, reach, 601)
        ax.set(xlim=(-reach, reach), ylim=(0, 1.85), yticks=[], xlabel="place on the line [m]", ylabel="how likely")
        (self.before,) = ax.plot([], [], "--", color=VERMILION, lw=1.4, label="belief before")
        (self.sensor,) = ax.plot([], [], "-.", color=BLUE, lw=1.4, label="what the sensor says")
        (self.after,) = ax.plot([], [], "-", color=VERMILION, lw=2.2, label="belief after")
        self.artists = [self.before, self.sensor, self.after]
        legend_below(ax, gap=0.2, ncols=3)

    def show(self, before: Bell, sensor: Bell, after: Bell) -> Self:
        """Fill the panel."""
        for line, bell in zip(self.artists, (before, sensor, after)):
            line.set_data(self.x, density(self.x, bell))
        return self
