"""Pictures of a team: paths in the hall, errors over time, a formation with its slots."""

from collections.abc import Sequence
from itertools import cycle
from typing import Any, Self

import numpy as np
from matplotlib.axes import Axes

from ..geometry import Array, Covariance, Poses, align, rotation, transform
from ..plots import BLUE, GREEN, GREY, ORANGE, VERMILION, arrow, outlines
from ..world import located
from .formation import FormationRun, lagging, slots
from .log import TeamLog
from .particles import TeamParticles
from .scenarios import POSTS
from .world import TeamNoise

COLORS = (BLUE, VERMILION, GREEN, ORANGE, "#CC79A7", "#56B4E9")


def draw_paths(
    ax: Axes,
    truth: Poses,
    believed: Poses | None = None,
    title: str = "",
    true: str = "truth",
    loc: Any = "center",
    odometry: Poses | None = None,
) -> None:
    """True paths (N+1, n, 3), in lines, and what was believed of them, dashed; robots where they end.

    A robot that only stands is a mark at its last believed place.  true: what it is called in the legend, which
    stands at loc;  odometry: poses as the truth, of which those of robot 0 are drawn too, dotted.
    """
    for i in range(truth.shape[1]):
        ax.plot(*truth[:, i, :2].T, "-", color=GREY, lw=2.5, alpha=0.5, label=true if i == 0 else None)
        ax.plot(*arrow(truth[-1, i]).T, "-", color=GREY, lw=2, alpha=0.7)
    for i in range(truth.shape[1] if believed is not None else 0):
        color, poses = COLORS[i % len(COLORS)], np.asarray(believed)[:, i]
        stands = np.ptp(truth[:, i, :2], axis=0).max() < 1e-9
        last, style = (poses[-1:], "o") if stands else (poses, "--")
        label = f"robot {i}, stands" if stands else f"estimate, robot {i}"
        ax.plot(*last[:, :2].T, style, color=color, lw=1.2, ms=4, label=label)
        ax.plot(*arrow(poses[-1]).T, "-", color=color, lw=1.4)
    if odometry is not None:
        ax.plot(*odometry[:, 0, :2].T, ":", color="k", lw=1.2, label="odometry, robot 0")
    ax.legend(loc=loc, fontsize=7, frameon=False)
    _in_metres(ax, title)


def draw_plan(ax: Axes, log: TeamLog, title: str = "") -> None:
    """The hall, 18 by 15 m: where robot 0 drives, with arrows, and who stands and watches."""
    truth = np.asarray(log.truth)
    ax.plot([-9, 9, 9, -9, -9], [-7.5, -7.5, 7.5, 7.5, -7.5], "-", color="k", lw=2)
    way = truth[:, 0, :2]
    ax.plot(*way.T, "-", color=BLUE, lw=1.2, label="robot 0 drives")
    for k in range(15, len(way) - 10, 60):
        ax.annotate("", way[k + 8], way[k], arrowprops={"arrowstyle": "->", "color": BLUE})
    ax.plot(*way[0], "o", color=BLUE, ms=6)
    ax.text(way[0, 0] + 0.3, way[0, 1] + 0.3, "0", color=BLUE, fontsize=9)
    for i, pose in enumerate(truth[0, 1:], 1):
        ax.plot(*pose[:2], "o", color="k", ms=6, label="the others watch" if i == 1 else None)
        ax.plot(*arrow(pose, 0.8).T, "-", color="k", lw=1)
        ax.text(pose[0] - 0.3, pose[1] - 1.2, str(i), fontsize=9)
    ax.legend(loc="upper left", bbox_to_anchor=(-8.9, 7.4), bbox_transform=ax.transData, fontsize=7, frameon=False)
    _in_metres(ax, title)


def _in_metres(ax, title):
    ax.set_aspect("equal")
    ax.set(xlabel="x [m]", ylabel="y [m]")
    ax.set_title(title, fontsize=11)
    ax.margins(0.08)


def draw_posts(ax: Axes) -> None:
    """The four posts in the corners of the hall."""
    ax.plot(*np.array(POSTS).T, "s", color="k", ms=5, label="posts: the map")


def draw_readings(ax: Axes, log: TeamLog, poses: Poses, title: str = "") -> None:
    """Where each reading places its target, in the frame of the poses (N+1, n, 3) of those who saw it."""
    points = []
    for k, seen in enumerate(log.measurements(), 1):
        points += [located(poses[k, i, :2], z + [0, poses[k, i, 2]], "rb") for i, _, z in seen]
    ax.plot(*np.array(points).reshape(-1, 2).T, ".", color="0.2", ms=2, alpha=0.5, label="readings")
    _in_metres(ax, title)


def draw_errors(
    ax: Axes, times: Array, errors: dict[str, Array], limit: float | None = None, of: str = "robot 0"
) -> None:
    """Several errors (N+1,) [m] over time: {name: values}; of whom, for the label.  Odometry is black and dotted."""
    for (name, values), color, style in zip(errors.items(), cycle(COLORS), cycle(["-", "--", "-.", ":"])):
        color, style = ("k", ":") if name == "odometry" else (color, style)
        ax.plot(times[: len(values)], 100 * np.asarray(values), style, color=color, lw=1.2, label=name)
    ax.set(xlabel="time [s]", ylabel=f"error of {of} [cm]", xlim=(0, times[-1]), ylim=(0, limit))
    ax.legend(fontsize=8, frameon=False)


def draw_formation(ax: Axes, run: FormationRun, steps: Sequence[int], title: str = "") -> None:
    """A formation's way by the true poses, and at some steps its robots, joined, with the time."""
    truth = run.truth
    for i in range(truth.shape[1]):
        label = "leader" if i == 0 else f"follower {i}"
        ax.plot(*truth[:, i, :2].T, "-", color=COLORS[i], lw=1, alpha=0.7, label=label)
    for k in sorted({min(k, len(truth) - 1) for k in steps}):
        for i, pose in enumerate(truth[k]):
            ax.plot(*arrow(pose, 0.3).T, "-", color=COLORS[i], lw=1.5)
        ax.plot(*truth[k][[*range(truth.shape[1]), 0], :2].T, ":", color=GREY, lw=1)
        box = {"facecolor": "w", "edgecolor": "none", "alpha": 0.7, "pad": 0.5}
        x, y = truth[k, 0, :2] + [0.15, 0.25]
        ax.text(x, y, f"{run.log.times[k]:.0f} s", fontsize=8, color="0.3", bbox=box)
    ax.legend(fontsize=8, frameon=False)
    _in_metres(ax, title)


def draw_particles(ax: Axes, log: TeamLog, kf: Any, title: str = "", steps: int = 20) -> None:
    """Figure 8: what particles believe after some steps, if the observers' start is open to doubt.

    kf: a filter for the log at its start;  its x and P are those of the particles, and more doubt about the observers.
    """
    doubt = np.diag([0.0] * 3 + (log.n - 1) * [0.5, 0.5, 0.03])
    pf = TeamParticles(300, kf.x, kf.P + doubt, TeamNoise(), rng=1)
    for u, seen in list(zip(log.controls, log.measurements()))[:steps]:
        pf.predict(u)
        pf.update(seen)
    for i in range(1, log.n):
        ax.plot(*pf.draws(i)[:, :2].T, ".", ms=3, color=COLORS[i], label=f"observer {i}")
    ax.plot(*pf.particles[:, :2].T, ".", ms=3, color=COLORS[0], label="robot 0")
    ax.legend(fontsize=8, frameon=False, markerscale=3)
    _in_metres(ax, title)


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
        self.slots.set_data(*slots(x[0], self.headings[k] + angle, run.shape).T)
        if P is not None:
            blocks = np.array([P[3 * i : 3 * i + 2, 3 * i : 3 * i + 2] for i in range(len(x))])
            turn = rotation(angle)
            self.ellipses.set_data(*outlines(x[:, :2], turn @ blocks @ turn.T).T)
        return self
