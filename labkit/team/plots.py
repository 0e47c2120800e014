"""Pictures of a team: paths in the hall, errors over time, a formation with its slots."""

from collections.abc import Sequence
from itertools import cycle
from typing import Self

import numpy as np
from matplotlib.axes import Axes

from ..geometry import Array, Covariance, Poses, align, rotation, transform
from ..plots import BLUE, GREEN, GREY, ORANGE, VERMILION, arrow, outlines
from ..world import located
from .formation import FormationRun, lagging, slots
from .log import TeamLog

COLORS = (BLUE, VERMILION, GREEN, ORANGE, "#CC79A7", "#56B4E9")


def draw_paths(
    ax: Axes, truth: Poses, believed: Poses | None = None, title: str = "", what: str = "estimate", true: str = "truth"
) -> None:
    """True paths (N+1, n, 3), in lines, and what was believed of them, dashed; robots where they end.

    what, true: what the two are called in the legend.
    """
    for i in range(truth.shape[1]):
        ax.plot(*truth[:, i, :2].T, "-", color=GREY, lw=2.5, alpha=0.5, label=true if i == 0 else None)
        ax.plot(*arrow(truth[-1, i]).T, "-", color=GREY, lw=2, alpha=0.7)
    if believed is not None:
        for i in range(believed.shape[1]):
            color = COLORS[i % len(COLORS)]
            ax.plot(*believed[:, i, :2].T, "--", color=color, lw=1.2, label=f"{what}, robot {i}")
            ax.plot(*arrow(believed[-1, i]).T, "-", color=color, lw=1.4)
    ax.set_aspect("equal")
    ax.set(xlabel="x [m]", ylabel="y [m]")
    ax.set_title(title, fontsize=11)
    ax.margins(0.08)


def draw_readings(ax: Axes, log: TeamLog, poses: Poses, color: str = ORANGE) -> None:
    """Where each reading places its target, in the frame of the poses (N+1, n, 3) of those who saw it."""
    points = []
    for k, seen in enumerate(log.measurements(), 1):
        points += [located(poses[k, i, :2], z + [0, poses[k, i, 2]], "rb") for i, _, z in seen]
    ax.plot(*np.array(points).reshape(-1, 2).T, ".", color=color, ms=2, alpha=0.5, label="readings")


def draw_errors(
    ax: Axes, times: Array, errors: dict[str, Array], limit: float | None = None, of: str = "robot 0"
) -> None:
    """Several errors (N+1,) [m] over time: {name: values}; of whom, for the label."""
    for (name, values), color, style in zip(errors.items(), cycle(COLORS), cycle(["-", "--", "-.", ":"])):
        ax.plot(times[: len(values)], 100 * np.asarray(values), style, color=color, lw=1.2, label=name)
    ax.set(xlabel="time [s]", ylabel=f"error of {of} [cm]", xlim=(0, times[-1]), ylim=(0, limit))
    ax.legend(fontsize=8, frameon=False)


def draw_formation(ax: Axes, run: FormationRun, steps: Sequence[int], title: str = "") -> None:
    """A formation's way, and its triangle at some steps, by the true poses."""
    truth = run.truth
    for i in range(truth.shape[1]):
        ax.plot(
            *truth[:, i, :2].T, "-", color=COLORS[i], lw=1, alpha=0.7, label="leader" if i == 0 else f"follower {i}"
        )
    for k in steps:
        k = min(k, len(truth) - 1)
        for i, pose in enumerate(truth[k]):
            ax.plot(*arrow(pose, 0.3).T, "-", color=COLORS[i], lw=1.5)
        corners = truth[k][[0, 1, 2, 0], :2]
        ax.plot(*corners.T, ":", color=GREY, lw=1)
    ax.set_aspect("equal")
    ax.set(xlabel="x [m]", ylabel="y [m]")
    ax.set_title(title, fontsize=11)
    ax.margins(0.08)


class FormationPanel:
    """One moment of a formation in the common frame: robots, slots, and the filter's 3-sigma ellipses."""

    def __init__(self, ax: Axes, run: FormationRun, title: str = ""):
        points = run.truth[..., :2].reshape(-1, 2)
        low, high = points.min(axis=0) - 1, points.max(axis=0) + [1, 1.6]  # above, room for the legend
        ax.set_aspect("equal")
        ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x [m]", ylabel="y [m]")
        ax.set_title(title, fontsize=11)
        n = run.log.n
        self.trails = [ax.plot([], [], "-", color=COLORS[i], lw=0.8, alpha=0.6)[0] for i in range(n)]
        self.robots = [ax.plot([], [], "-", color=COLORS[i], lw=2)[0] for i in range(n)]
        (self.believed,) = ax.plot([], [], "+", color="k", ms=9, mew=1.5, label="believed position")
        (self.slots,) = ax.plot([], [], "o", color=GREY, ms=11, mfc="none", label="slots")
        known = run.covariances is not None
        (self.ellipses,) = ax.plot([], [], "-", color="k", lw=0.8, label="3σ ellipse" if known else None)
        self.artists = [*self.trails, self.slots, self.ellipses, *self.robots, self.believed]
        ax.legend(loc="upper center", fontsize=8, frameon=False, ncols=3)
        self.headings = lagging(run.believed[:, 0, 2])

    def show(self, run: FormationRun, k: int, P: Covariance | None = None) -> Self:
        """Fill the panel with step k, and with the ellipses of P (3n, 3n) if there is one."""
        truth, x = run.truth, run.believed[k]
        angle, shift = align(run.believed[: k + 2, :, :2].reshape(-1, 2), truth[: k + 2, :, :2].reshape(-1, 2))
        x = transform(x, angle, shift)
        for i, (trail, robot) in enumerate(zip(self.trails, self.robots)):
            trail.set_data(*truth[: k + 1, i, :2].T)
            robot.set_data(*arrow(truth[k, i], 0.3).T)
        self.believed.set_data(*x[:, :2].T)
        self.slots.set_data(*slots(x[0], self.headings[k] + angle).T)
        if P is not None:
            blocks = np.array([P[3 * i : 3 * i + 2, 3 * i : 3 * i + 2] for i in range(len(x))])
            turn = rotation(angle)
            self.ellipses.set_data(*outlines(x[:, :2], turn @ blocks @ turn.T).T)
        return self
