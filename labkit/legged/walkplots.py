"""Pictures of the field and of walks on it: paths, errors, surprises. As in `labkit.plots`, a panel is set up once."""

from collections.abc import Sequence
from typing import Self

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle

from .. import metrics
from ..geometry import Array, Points
from ..history import History, of_one_run
from ..plots import BLUE, GREEN, GREY, ORANGE, VERMILION, arrow, legend_below, outlines
from .field import BEACONS, FIELD, GOALS, Field
from .robot import DT, FieldLog

YELLOW, SKY, PINK = "#F0C808", "#2E86DE", "#E377C2"
ERROR, TURNED = "k", "#CC79A7"  # blue is the truth here, orange-red the estimate; an error is neither


def draw_field(ax: Axes, field: Field = FIELD, title: str = "") -> None:
    """Lines, goals and beacons of a field, all that never moves."""
    x, y = field.length / 2, field.width / 2
    ax.add_patch(Rectangle((-x, -y), 2 * x, 2 * y, fill=False, ec="0.6", lw=1.2))
    ax.plot([0, 0], [-y, y], color="0.6", lw=1.2)
    ax.add_patch(Circle((0, 0), 0.18, fill=False, ec="0.6", lw=1.2))  # the league's centre circle
    colors = {"yellow": YELLOW, "blue": SKY, "pink": PINK}
    for landmark in field.map:
        if landmark.id in GOALS:
            mouth, color = [-field.goal / 2, field.goal / 2], colors[landmark.id.split()[0]]
            ax.plot([landmark.p[0]] * 2, mouth, color=color, lw=6, solid_capstyle="butt")
        elif landmark.id in BEACONS:
            upper, lower = landmark.id.split("-")
            ax.plot(*landmark.p, "o", ms=9, mfc=colors[upper], mec=colors[lower], mew=3)
    half = field.half + 0.25
    ax.set_aspect("equal")
    ax.set(xlim=(-half[0], half[0]), ylim=(-half[1], half[1]), xlabel="x [m]", ylabel="y [m]")
    ax.set_title(title, fontsize=11)


class WalkPanel:
    """A whole walk: true path, estimated path, 3-sigma ellipses along it."""

    def __init__(self, ax: Axes, field: Field = FIELD, title: str = "Walk, with 3σ ellipses", kidnapped: bool = True):
        draw_field(ax, field, title)
        self.ax, self.limits = ax, (ax.get_xlim(), ax.get_ylim())
        (self.truth,) = ax.plot([], [], "-", color=BLUE, lw=1.6, label="true path")
        (self.estimate,) = ax.plot([], [], "--", color=VERMILION, lw=1.2, label="estimate")
        (self.ellipses,) = ax.plot([], [], "-", color=VERMILION, lw=0.6, alpha=0.7)
        (self.start,) = ax.plot([], [], "o", color=BLUE, ms=6, label="start")
        (self.lifted,) = ax.plot([], [], "x", color=BLUE, ms=9, mew=2, label="picked up")
        (self.down,) = ax.plot([], [], "s", color=BLUE, ms=6, label="put down")
        self.artists = [self.ellipses, self.truth, self.estimate, self.start, self.lifted, self.down]
        drawn = [self.truth, self.estimate, self.start, *([self.lifted, self.down] if kidnapped else [])]
        legend_below(ax, 0.3, ncols=3, handles=drawn)

    def show(self, log: FieldLog, history: History, ellipses: int = 25) -> Self:
        """Fill the panel with a walk and what a filter believed of it."""
        of_one_run(history, log)
        P, path, kidnapped = history.sound(), np.asarray(log.truth)[:, :2], log.kidnapped
        self.truth.set_data(*pen_lifted(path, kidnapped).T)
        self.start.set_data(*path[:1].T)
        self.lifted.set_data(*path[list(kidnapped)].T)
        self.down.set_data(*path[[k + 1 for k in kidnapped]].T)
        # An estimate of "anywhere" is just the middle of the field.
        sure = P[:, 0, 0] + P[:, 1, 1] < 1.0
        self.estimate.set_data(*np.where(sure[:, None], history.x[:, :2], np.nan).T)
        every = np.unique(np.linspace(0, len(log), ellipses).astype(int))
        self._widen(history.x[sure, :2])
        # Wider ones would fill the picture.
        known = every[P[every, :2, :2].trace(axis1=1, axis2=2) < 1.0]
        self.ellipses.set_data(*outlines(history.x[known, :2], P[known, :2, :2]).T)
        return self

    def _widen(self, path):
        """Make room for an estimate that leaves the carpet: as far as it goes, but not beyond twice the field."""
        for axis, room in ((0, self.ax.set_xlim), (1, self.ax.set_ylim)):
            low, high = self.limits[axis]
            reach = [low, high, *np.clip(path[:, axis], 2 * low, 2 * high)]
            room(min(reach) - 0.1 * (min(reach) < low), max(reach) + 0.1 * (max(reach) > high))


def pen_lifted(path: Points, kidnapped: Sequence[int]) -> Points:
    """A path (N+1, 2) [m] with the pen lifted where the robot was carried."""
    return np.insert(path, [k + 1 for k in kidnapped], np.nan, axis=0)


class DistancePanel:
    """Error of the position (left scale) and of the heading (right scale) over time."""

    def __init__(self, ax: Axes, duration: float, limit: float = 8.0, kidnapped: bool = True):
        ax.set(xlim=(0, duration), ylim=(0.005, limit), yscale="log", xlabel="time [s]", ylabel="position error [m]")
        ax.set_title("Error of the estimate", fontsize=11)
        self.ax, self.right = ax, ax.twinx()
        self.right.set(ylim=(0.1, 200), yscale="log", ylabel="heading error [°]")
        self.right.yaxis.set_major_formatter("{x:g}")
        ax.yaxis.set_major_formatter("{x:g}")
        (self.distance,) = ax.plot([], [], "-", color=ERROR, lw=1.2, label="position")
        (self.kidnap,) = ax.plot([], [], "-.", color=GREY, lw=1.2, label="kidnapped" if kidnapped else None)
        (self.heading,) = self.right.plot([], [], ":", color=TURNED, lw=1.2, label="heading")
        self.artists = [self.kidnap, self.distance, self.heading]
        drawn = [self.distance, self.heading, *([self.kidnap] if kidnapped else [])]
        legend_below(ax, 0.2, ncols=3, columnspacing=1.0, handles=drawn)

    def show(self, log: FieldLog, history: History) -> Self:
        """Fill the panel with the errors along a walk."""
        error, (low, high) = metrics.errors(history, log), self.ax.get_ylim()
        self.distance.set_data(log.times, np.hypot(*error[:, :2].T).clip(low, high))
        self.heading.set_data(log.times, np.rad2deg(abs(error[:, 2])).clip(*self.right.get_ylim()))
        at = log.times[list(log.kidnapped)]
        self.kidnap.set_data(np.repeat(at, 3), np.tile([low, high, np.nan], len(at)))
        return self


class SurprisePanel:
    """d2 of each sighting over time, and the bound above which one counts as a surprise."""

    def __init__(self, ax: Axes, duration: float):
        ax.set(xlim=(0, duration), ylim=(1e-2, 1e3), yscale="log", xlabel="time [s]", ylabel="d² of a sighting")
        ax.set_title("How surprising are the sightings?", fontsize=11)
        self.ax = ax
        (self.dots,) = ax.plot([], [], ".", color=ERROR, ms=3, label="one sighting")
        (self.bound,) = ax.plot([], [], "--", color=ORANGE, lw=1.3, label="bound")
        (self.find,) = ax.plot([], [], "-", color=GREEN, lw=6, solid_capstyle="butt", label="grid at work")
        self.artists = [self.dots, self.bound, self.find]
        legend_below(ax, 0.2, ncols=3, columnspacing=1.0)

    def show(self, times: Array, d2: Array, bound: float, finding: Array) -> Self:
        """Fill the panel: times (n,) [s] and d2 (n,) of sightings, times (m,) [s] at which the grid was at work."""
        low, high = self.ax.get_ylim()
        self.dots.set_data(times, np.clip(d2, low, high))
        self.bound.set_data(self.ax.get_xlim(), [bound, bound])
        gaps = np.flatnonzero(np.diff(finding) > 1.5 * DT) + 1
        finding = np.insert(finding, gaps, np.nan)  # the pen is lifted between two times at work
        self.find.set_data(finding, np.full(len(finding), 1.6 * low))
        return self


def plot_experiment(axes: Sequence[Axes], log: FieldLog, history: History) -> None:
    """The paper's figures 6 to 8: error of (x, y), with what it says is never exceeded, and of the heading over time.

    The heading has a scale of its own, of 4 degrees or as much as it needs: the paper's bound, 60, is far above.
    """
    error = metrics.errors(history, log)
    far, turned = 100 * np.hypot(*error[:, :2].T), np.rad2deg(abs(error[:, 2]))
    axes[0].plot(log.times, far, "-", color=ERROR, lw=1.1)
    axes[0].axhline(7, color=ORANGE, ls="--", lw=1.3)
    axes[1].plot(log.times, turned, "-", color=TURNED, lw=1.1)
    axes[0].set(ylim=(0, 1.15 * max(7, far.max())), ylabel="position error [cm]")
    axes[1].set(ylim=(0, max(4, 1.15 * turned.max())), ylabel="heading error [°]")
    for ax in axes:
        ax.set(xlim=(0, log.times[-1]), xlabel="time [s]")


def show_walk(log: FieldLog, history: History | None = None, title: str = "") -> None:
    """A walk on the field and, with the History of a filter, its error over time."""
    import matplotlib.pyplot as plt  # here only: the panels need no pyplot

    if history is None:
        figure, ax = plt.subplots(figsize=(6.4, 4.6), layout="constrained")
        _draw_walk(ax, log, title)
    else:
        figure, axes = plt.subplots(1, 2, figsize=(10, 3.9), layout="constrained", width_ratios=[1.3, 1])
        carried = bool(log.kidnapped)
        WalkPanel(axes[0], log.field, kidnapped=carried).show(log, history)
        DistancePanel(axes[1], log.times[-1], 8.0 if carried else 1.0, carried).show(log, history)
        for panel in axes:
            panel.get_legend().set(loc="upper center", bbox_to_anchor=(0.5, -0.16))
        figure.suptitle(title)
    plt.show()


def _draw_walk(ax, log, title):
    """A field whose landmarks have their names, the true path and the heading on it."""
    draw_field(ax, log.field, title)
    style = {"textcoords": "offset points", "ha": "center", "va": "center", "fontsize": 8, "color": "0.35"}
    for landmark in log.map:  # all names stand where no robot walks
        x, y = landmark.p
        where = {"rotation": 90, "xytext": (10 * np.sign(x), 0)} if not y else {"xytext": (42, 0)}
        ax.annotate(landmark.id, (x, y), **where, **style)
    ax.plot(*log.truth[0, :2], "o", color=BLUE, ms=7, label="start", zorder=4)
    ax.plot(*pen_lifted(log.truth[:, :2], log.kidnapped).T, "-", color=BLUE, lw=1.6, label="true path")
    for k in range(0, len(log) + 1, 20):
        label = "heading, every 2 s" if k == 0 else None
        ax.fill(*arrow(log.truth[k], 0.24).T, color=VERMILION, lw=0, label=label, zorder=3)
    legend_below(ax, 0.14, ncols=3, fontsize=9)
