"""Pictures of a race: error over time, how soon a robot is found again, accuracy against cost."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.ticker import FixedLocator, NullLocator

from ..plots import BLUE, VERMILION
from .race import Result
from .robot import DT

SOON = 60  # steps after a kidnapping that are drawn
SHADES = LogNorm(0.03, 3)  # [m] of the errors: from what a tracker reaches to what a lost one has


def plot_race(axes: Sequence[Axes], results: Sequence[Result]) -> None:
    """Three axes, the first two with rows: median error over time, time until found again, accuracy against cost."""
    _errors(axes[0], results)
    _recoveries(axes[1], results)
    dots = [(1e3 * r.seconds, 100 * r.tracking.mean(), r.name) for r in results]
    for *dot, _ in dots:
        axes[2].plot(*dot, "o", color=BLUE, ms=8)
    _axes_of_cost(axes[2], dots)
    _name(axes[2], dots)


def _rows(ax, names):
    ax.set_yticks(range(len(names)), names)
    ax.set(ylim=(len(names) - 0.5, -0.5))


def _errors(ax, results):
    medians = np.array([np.median(r.distance, axis=0) for r in results])
    span, kidnapped = DT * medians.shape[1], results[0].kidnapped
    where: dict[str, Any] = {
        "aspect": "auto",
        "interpolation": "nearest",
        "extent": (0, span, len(results) - 0.5, -0.5),
    }
    image = ax.imshow(medians, cmap="viridis_r", norm=SHADES, **where)
    if kidnapped is not None:
        ax.axvline(DT * kidnapped, color=VERMILION, ls="-.", lw=1.5)
    _rows(ax, [r.name for r in results])
    ax.set(xlabel="time [s]" + (" (line: kidnapped)" if kidnapped is not None else ""))
    bar = ax.figure.colorbar(image, ax=ax, location="top", extend="both", label="median position error [m]")
    bar.ax.xaxis.set_major_locator(FixedLocator([0.03, 0.1, 0.3, 1, 3]))
    bar.ax.xaxis.set_major_formatter("{x:g}")
    bar.ax.xaxis.set_minor_locator(NullLocator())


def _recoveries(ax, results):
    """Of each localizer a line from the median to what 95 % do not exceed, and how many recover at all."""
    ax.set(xlim=(0, 1.4 * SOON * DT), xlabel="time after the kidnapping [s]")
    ax.set_title("found again: median to 95 %, runs", fontsize=10)
    _rows(ax, [""] * len(results))
    for row, r in enumerate(results if results[0].kidnapped is not None else ()):
        steps = r.recovered()
        known = DT * steps[np.isfinite(steps)]
        most = 0.5 < np.isfinite(steps).mean()
        ends = np.minimum([np.median(known), np.percentile(known, 95)], SOON * DT) if most else []
        ax.plot(ends, [row] * len(ends), "o-", color=BLUE, lw=2.5, ms=5, markevery=2)
        share = f"{100 * len(known) / len(steps):.0f} %"
        ax.annotate(
            share, (1, row), (-4, 0), ("axes fraction", "data"), textcoords="offset points", ha="right", va="center"
        )


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
        for x, value in zip(centimetres, values):
            ax.annotate(f"{value:.2g}", (x, value), (0, 5), textcoords="offset points", ha="center", fontsize=8)
        ax.set(xscale="log", ylim=(0, 1.2 * max(values)), xlabel="width of a cell [cm]", ylabel=label)
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
    """Names beside the dots, from the most accurate up; each at least a line above the one before.

    Of dots at about the same height the cheapest is named last.
    """
    look = {"fontsize": 7.5, "ha": "left", "va": "center"}
    look["arrowprops"] = {"arrowstyle": "-", "lw": 0.4, "color": "0.6", "shrinkB": 3}
    height, line = -np.inf, np.log10(np.divide(*ax.get_ylim()[::-1])) / 22
    beside = 2.15 * max(x for x, _, _ in dots)
    for x, y, name in sorted(dots, key=lambda dot: (round(np.log10(dot[1]) / line / 4), -dot[0])):  # no line crosses
        height = max(np.log10(y), height + line)
        ax.annotate(name, (x, y), (beside, 10**height), annotation_clip=False, **look)
