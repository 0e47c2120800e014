"""Pictures of a race: error over time, how soon a robot is found again, accuracy against cost."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, NullLocator

from ..plots import BLUE, GREEN, GREY, ORANGE, VERMILION
from .race import Result
from .robot import DT

SOON = 60  # steps after a kidnapping that are drawn
COLORS = (BLUE, VERMILION, GREEN, ORANGE, "#CC79A7", "#56B4E9", GREY, "k")
LINES: tuple[Any, ...] = ("-", "--", "-.", ":", (0, (5, 1)), (0, (1, 1)), "-", (0, (4, 1, 1, 1)))


def plot_race(axes: Sequence[Axes], results: Sequence[Result]) -> None:
    """Three axes: median error over time, share of runs recovered over time, accuracy against cost."""
    left, middle, right = axes
    kidnapped, dots = results[0].kidnapped, []
    for i, r in enumerate(results):
        style = {"color": COLORS[i % len(COLORS)], "ls": LINES[i % len(LINES)]}
        median = np.median(r.distance, axis=0)
        left.plot(DT * np.arange(len(median)), median, lw=1.3, label=r.name, **style)
        if kidnapped is not None:
            steps = np.sort(r.recovered())  # NaN, of those that never did, is last
            soon = steps[steps <= SOON]
            share = 100 * np.arange(len(soon) + 1) / len(steps)
            x, y = np.array([0, *soon, SOON]) * DT, [*share, share[-1]]
            middle.step(x, y, where="post", lw=1.3, **style)
        dots.append((1e3 * r.seconds, 100 * r.tracking.mean(), r.name))
        right.plot(*dots[-1][:2], "o", color=style["color"], ms=8)
    if kidnapped is not None:
        left.axvline(DT * kidnapped, color=GREY, ls="-.", lw=1)
    left.set(yscale="log", xlabel="time [s]", ylabel="median position error [m]")
    middle.set(xlim=(0, SOON * DT), ylim=(0, 104), xlabel="time after the kidnapping [s]", ylabel="runs recovered [%]")
    _axes_of_cost(right, dots)
    _name(right, dots)
    left.figure.legend(loc="outside lower center", ncols=min(4, len(results)), fontsize=9, frameon=False)


def plot_cells(sizes: Sequence[float], results: Sequence[Result]) -> None:
    """Mean tracking error and computing time of grids whose cells are `sizes` [m] wide."""
    import matplotlib.pyplot as plt

    centimetres = [100 * size for size in sizes]
    _, axes = plt.subplots(1, 2, figsize=(9, 2.9), layout="constrained")
    for ax, values, color, label in [
        (axes[0], [100 * r.tracking.mean() for r in results], VERMILION, "mean error [cm]"),
        (axes[1], [1e3 * r.seconds for r in results], BLUE, "computing time per step [ms]"),
    ]:
        ax.plot(centimetres, values, "o-", color=color)
        ax.set(xscale="log", ylim=(0, 1.15 * max(values)), xlabel="width of a cell [cm]", ylabel=label)
        ax.set_xticks(centimetres, [f"{size:g}" for size in centimetres])
        ax.xaxis.set_minor_locator(NullLocator())
    plt.show()


def _axes_of_cost(ax, dots):
    """Logarithmic axes with plain numbers, and room beside the dots."""
    x, y = zip(*((x, y) for x, y, _ in dots))
    ax.set(
        xscale="log",
        yscale="log",
        xlabel="computing time per step [ms]",
        ylabel="mean tracking error [cm]",
        xlim=(min(x) / 1.6, max(x) * 2),
        ylim=(min(min(y) / 1.3, 3), max(max(y) * 1.3, 30)),
    )
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(FixedLocator([d * 10.0**e for e in range(-3, 4) for d in (1, 3)]))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_locator(NullLocator())


def _name(ax, dots):
    """Names beside the dots, from the most accurate up; each at least a line above the one before."""
    look = {"fontsize": 7.5, "ha": "left", "va": "center"}
    look["arrowprops"] = {"arrowstyle": "-", "lw": 0.4, "color": "0.6", "shrinkB": 3}
    height, line = -np.inf, np.log10(np.divide(*ax.get_ylim()[::-1])) / 22
    beside = 2.15 * max(x for x, _, _ in dots)
    for x, y, name in sorted(dots, key=lambda dot: dot[1]):
        height = max(np.log10(y), height + line)
        ax.annotate(name, (x, y), (beside, 10**height), annotation_clip=False, **look)
