"""Pictures of runs. Each panel sets up one matplotlib axes once and is then filled by `show`.

The same panels serve a static figure (`MapPanel(ax).show(log, history)`), the sliders and the
animation, where only `artists` are redrawn.  Colours are Okabe and Ito's, told apart by colour-blind
readers, and lines differ in style as well.
"""

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from .. import metrics
from ..geometry import Array, Covariance, Covariances, Point, Points, Pose, ellipse
from ..history import History, of_one_run
from ..log import Log
from ..world import Map, located, positions

Box = tuple[float, float, float, float]
"""(xmin, xmax, ymin, ymax) [m]."""
BOX = (-5.1, 5.1, -5.1, 5.1)  # what holds the handout's map

BLUE, VERMILION, GREEN, ORANGE, GREY = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#777777"
PURPLE, PALE = "#CC79A7", "#D5D5D5"  # the latter for the band that a consistent filter keeps to
HEIGHTS = np.outer([0.01, 0.1, 1.0], [1.0, 1.5, 2.0, 3.0, 5.0, 7.0]).ravel()  # [m] that an axis for errors may have


def arrow(pose: Pose, size: float = 0.35) -> Points:
    """Outline (5, 2) [m] of an arrow head, `size` [m] long, that stands for a robot at a pose."""
    outline = [size * np.array([1.0, 0.6, 0.25, 0.6, 1.0]), pose[2] + np.array([0.0, 2.6, np.pi, -2.6, 0.0])]
    return located(pose[:2], np.stack(outline, axis=-1), "rb")


def limits(log: Log, margin: float = 0.6) -> Box:
    """(xmin, xmax, ymin, ymax) [m] that hold the map and the true path of a log."""
    points = positions(log.map)
    if log.truth is not None:
        points = np.vstack([points, log.truth[np.isfinite(log.truth[:, 0]), :2]])
    if not len(points):
        return BOX
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    return low[0], high[0], low[1], high[1]


def legend_below(ax: Axes, gap: float = 0.17, ncols: int = 2, **options: Any) -> None:
    """A legend under the axes; gap: how far, as a fraction of their height."""
    where: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -gap), "frameon": False}
    ax.legend(ncols=ncols, **where | {"fontsize": 8} | options)


def outlines(means: Points, covs: Covariances) -> Points:
    """3-sigma ellipses of means (n, 2) [m] and covs (n, 2, 2) [m^2] as one line with gaps: (41 n, 2)."""
    gap = np.full((len(means), 1, 2), np.nan)  # lifts the pen between two ellipses
    return np.concatenate([ellipse(means, covs, points=40), gap], axis=1).reshape(-1, 2)


def _map_axes(ax, box):
    ax.set_aspect("equal")
    ax.set(xlim=box[:2], ylim=box[2:], xlabel="x [m]", ylabel="y [m]")


class MapPanel:
    """The whole run in the map: true path, estimated path, 3-sigma ellipses along it, and where the truth was then."""

    def __init__(self, ax: Axes, box: Box = BOX, title: str = "Map, with 3σ ellipses"):
        _map_axes(ax, box)
        ax.set_title(title, fontsize=11)
        (self.landmarks,) = ax.plot([], [], "k*", ms=7, label="landmarks")
        (self.truth,) = ax.plot([], [], "-", color=BLUE, lw=1.6, label="true path")
        (self.then,) = ax.plot([], [], ".", color=BLUE, ms=7, mec="white", mew=0.6, label="truth at an ellipse")
        (self.estimate,) = ax.plot([], [], "--", color=VERMILION, lw=1.3, label="estimate")
        (self.ellipses,) = ax.plot([], [], "-", color=VERMILION, lw=0.7, alpha=0.8, label="3σ ellipse")
        self.artists = [self.landmarks, self.ellipses, self.truth, self.estimate, self.then]
        legend_below(ax, handlelength=1.8, columnspacing=1.2)

    def show(self, log: Log, history: History, ellipses: int = 20) -> Self:
        """Fill the panel with a run; raises ValueError for another run's history, FilterError for a P that is none."""
        of_one_run(history, log)
        P = history.sound()
        every = np.unique(np.linspace(0, len(log), ellipses).astype(int))
        self.landmarks.set_data(*positions(log.map).T)
        if log.truth is not None:
            self.truth.set_data(*log.truth[:, :2].T)
            self.then.set_data(*log.truth[every, :2].T)
        self.estimate.set_data(*history.x[:, :2].T)
        self.ellipses.set_data(*outlines(history.x[every, :2], P[every, :2, :2]).T)
        return self


class ErrorPanel:
    """Error of x and y over time, each within its own 3-sigma bounds, as high as these need after the first steps."""

    def __init__(self, ax: Axes, duration: float):
        self.ax = ax
        ax.set(xlim=(0, duration), xlabel="time [s]", ylabel="error [m]")
        ax.set_title("Error and its 3σ bounds", fontsize=11)
        ax.yaxis.set_label_coords(-0.23, 0.5)  # clear of the longest numbers, so that the layout can stay
        ax.axhline(0, color=GREY, lw=0.6)
        # The wide bounds of x lie under the narrow ones of y, since the two are often the same.
        wide: dict[str, Any] = {"lw": 4, "alpha": 0.35}
        narrow: dict[str, Any] = {"lw": 1.2, "ls": (0, (1, 1.2))}
        self.lines = []
        for name, color, style, bounds in (("x", GREEN, "-", wide), ("y", PURPLE, "--", narrow)):
            (bound,) = ax.plot([], [], color=color, label=f"±3σ of {name}", **bounds)
            (error,) = ax.plot([], [], style, color=color, lw=1.2, label=f"error in {name}")
            self.lines.append((error, bound))
        self.artists = [bound for _, bound in self.lines] + [error for error, _ in self.lines]
        legend_below(ax)

    def show(self, log: Log, history: History) -> Self:
        """Fill the panel with a run."""
        t = log.times - log.times[0]
        error, P = metrics.errors(history, log), history.sound()
        sigma = 3 * np.sqrt(np.maximum(np.diagonal(P, axis1=1, axis2=2)[:, :2], 0))
        both = np.concatenate([t, [np.nan], t])  # upper and lower bound in one line
        for i, (line, bound) in enumerate(self.lines):
            line.set_data(t, error[:, i])
            bound.set_data(both, np.concatenate([sigma[:, i], [np.nan], -sigma[:, i]]))
        settled = np.fmax(abs(error[:, :2]), sigma)[len(log) // 20 :]  # without the wide start
        height = HEIGHTS[min(np.searchsorted(HEIGHTS, 1.05 * settled.max()), len(HEIGHTS) - 1)]
        self.ax.set_ylim(-height, height)
        return self


class ConsistencyPanel:
    """NEES, or NIS per measured number, over time with its 95 % chi-square bounds (log scale)."""

    def __init__(self, ax: Axes, duration: float, kind: str = "nees", dof: int = 2):
        if kind not in ("nees", "nis"):
            raise ValueError(f"kind must be 'nees' or 'nis', but it is {kind!r}")
        self.kind, self.dof = kind, dof
        ylabel = {"nees": f"NEES ({dof} is consistent)", "nis": "NIS per number (1 is consistent)"}[kind]
        ax.set(xlim=(0, duration), ylim=(1e-3, 1e3), yscale="log", xlabel="time [s]", ylabel=ylabel)
        ax.set_title(f"{kind.upper()} and its 95 % bounds", fontsize=11)
        (self.value,) = ax.plot([], [], "-k", lw=0.8, marker=".", ms=2.5, label=kind.upper())
        self.bounds = PolyCollection([], facecolor=PALE, edgecolor=PALE, lw=0.5, label="within its 95 % bounds")
        ax.add_collection(self.bounds, autolim=False)
        self.artists = [self.bounds, self.value]
        legend_below(ax)

    def show(self, log: Log, history: History) -> Self:
        """Fill the panel with a run."""
        t = log.times - log.times[0]
        if self.kind == "nees":
            value, dof, scale = metrics.nees(history, log), np.full(len(t), self.dof), np.ones(len(t))
        else:
            value, dof = metrics.nis(history, log)
            seen = dof > 0  # a step without a landmark has no NIS
            t, value, scale, dof = t[1:][seen], value[seen], dof[seen], dof[seen]
        kinds, which = np.unique(dof, return_inverse=True)
        low, high = (bound[which] / scale for bound in metrics.chi2_bounds(kinds))
        # Each value and its bounds hold until the next, but not for more than two seconds: then there is a gap.
        end = np.minimum(np.append(t[1:], t[-1:] + log.dt), t + 2.0)
        gaps = np.flatnonzero(end[:-1] < t[1:]) + 1
        self.value.set_data(np.insert(t, gaps, t[gaps]), np.insert(value / scale, gaps, np.nan))
        self.value.set_marker("." if len(t) < 1000 else "")  # so many dots would be one blob
        self.bounds.set_verts(list(np.array([[t, low], [end, low], [end, high], [t, high]]).transpose(2, 0, 1)))
        return self


class ScenePanel:
    """One moment, drawn with the handout's signs.

    Black stars: the map.  Blue + and dashed blue circle: the robot and how far it sees.  Blue stars:
    what it measured.  Orange-red + and ellipse: the estimate and its 3-sigma ellipse
    (the handout's red, in the shade that colour-blind readers tell from the rest).
    """

    def __init__(self, ax: Axes, box: Box = BOX):
        _map_axes(ax, box)
        (self.landmarks,) = ax.plot([], [], "k*", ms=8, label="landmarks")
        (self.trail,) = ax.plot([], [], "-", color=BLUE, lw=0.8, alpha=0.6)
        (self.guess,) = ax.plot([], [], "--", color=VERMILION, lw=0.8, alpha=0.8)
        (self.robot,) = ax.plot([], [], "+", color=BLUE, ms=11, mew=2, label="robot")
        (self.circle,) = ax.plot([], [], "--", color=BLUE, lw=1, label="sensing range")
        (self.seen,) = ax.plot([], [], "*", color=BLUE, ms=8, mfc="none", label="measured")
        (self.mean,) = ax.plot([], [], "+", color=VERMILION, ms=11, mew=2, label="estimate")
        (self.ellipse,) = ax.plot([], [], "-", color=VERMILION, lw=1.5, label="3σ ellipse")
        self.artists = [self.landmarks, self.trail, self.guess, self.circle]
        self.artists += [self.seen, self.robot, self.ellipse, self.mean]
        ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=8, frameon=False)

    def show(self, map: Map, p: Point | None, reach: float | None, seen: Points, mean: Point, cov: Covariance) -> Self:
        """P (2,) true position or None; seen (n, 2) world positions of what was measured."""
        self.landmarks.set_data(*positions(map).T)
        if p is not None:
            self.robot.set_data([p[0]], [p[1]])
        if p is not None and reach:
            self.circle.set_data(*ellipse(p, np.eye(2), sigmas=reach).T)
        self.seen.set_data(*np.reshape(seen, (-1, 2)).T)
        self.mean.set_data([mean[0]], [mean[1]])
        self.ellipse.set_data(*ellipse(mean, cov).T)
        return self

    def show_step(self, log: Log, history: History, k: int) -> Self:
        """Step k of a run, 0 being the start, with the paths up to there."""
        truth = None if log.truth is None else log.truth[:, :2]
        p = None if truth is None or np.isnan(truth[k]).any() else truth[k]
        now = log.seen_step == k - 1
        start = history.x[k, :2] if p is None else p
        self.guess.set_data(*history.x[: k + 1, :2].T)
        if truth is not None:
            self.trail.set_data(*truth[: k + 1].T)
        seen = located(start, log.seen[now], log.sensor)
        return self.show(log.map, p, log.range, seen, history.x[k, :2], history.P[k, :2, :2])


def plot_run(axes: Sequence[Axes], log: Log, history: History, kind: str = "nees") -> None:
    """Fill three axes: map with paths, error within its bounds, NEES or NIS within its bounds."""
    of_one_run(history, log)
    duration = log.times[-1] - log.times[0]
    MapPanel(axes[0], limits(log)).show(log, history)
    ErrorPanel(axes[1], duration).show(log, history)
    ConsistencyPanel(axes[2], duration, kind, history.x.shape[1]).show(log, history)


def show_run(log: Log, history: History, kind: str = "nees", title: str = "") -> None:
    """Make the figure of `plot_run` and show it, in a notebook or in a window."""
    import matplotlib.pyplot as plt  # here only: the panels need no pyplot

    figure, axes = plt.subplots(1, 3, figsize=(11, 4.1), layout="constrained", width_ratios=[1.1, 1, 1])
    plot_run(axes, log, history, kind)
    figure.suptitle(title)
    plt.show()


def plot_mean_nees(ax: Axes, times: Array, values: Array, dof: int = 2) -> None:
    """Mean NEES over runs, values (runs, N+1), within the bounds that 95 % of such means keep."""
    if np.ndim(values) != 2 or np.shape(values)[1] != len(times):
        raise ValueError(f"values must have the shape (runs, {len(times)}), as many as times, not {np.shape(values)}")
    low, high = metrics.chi2_bounds(dof, runs=len(values))
    ax.plot(times, np.mean(values, axis=0), "-k", lw=1, label=f"mean of {len(values)} runs")
    ax.axhspan(low, high, color=PALE, label="within its 95 % bounds")
    ax.axhline(dof, color=GREY, lw=0.8, ls=":")
    ax.set(xlim=(times[0], times[-1]), xlabel="time [s]", ylabel="mean NEES")
    ax.legend(fontsize=8)
