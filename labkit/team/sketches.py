"""Sketches of a team: two circles that meet, and the three ways in which an error is told."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from ..geometry import relative, transform
from ..plots import BLUE, GREEN, GREY, VERMILION, arrow

P1, P2, SEEN_FROM = np.array([0.0, 0.0]), np.array([2.0, 0.0]), np.array([0.5, 2.0])


def sketch_circles(ax: Axes, title: str = "") -> None:
    """A robot goes from p1 to p2; who saw it at the ranges of the circles stands where they meet: left or right."""
    for name, place, color in (("1", P1, BLUE), ("2", P2, GREEN)):
        radius = float(np.linalg.norm(SEEN_FROM - place))
        ax.add_patch(Circle(tuple(place), radius, fill=False, color=color, lw=1.2))
        ax.plot(*place, "o", color=color, ms=7, label=f"$p_{name}$, seen at the range $\\rho_{name}$")
        ax.plot(*np.array([place, SEEN_FROM]).T, ":", color=color, lw=1)
    foot = np.array([SEEN_FROM[0], 0.0])
    ax.annotate("", tuple(P2), tuple(P1), arrowprops={"arrowstyle": "->", "color": GREY, "lw": 2})
    ax.plot(*np.array([foot, SEEN_FROM]).T, "--", color=GREY, lw=1)
    for text, (x, y) in (("a", (0.25, -0.3)), ("c", (0.56, 0.9)), ("b", (1.3, 0.15))):
        ax.text(x, y, f"${text}$", fontsize=11)
    ax.plot(*SEEN_FROM, "^", color=VERMILION, ms=10, label="here the bearing grows (left)")
    ax.plot(SEEN_FROM[0], -SEEN_FROM[1], "^", color=VERMILION, mfc="none", ms=10, label="here it falls (right)")
    ax.set(aspect="equal", xlim=(-2.6, 5.1), ylim=(-3.4, 4.6), xlabel="x [m]", ylabel="y [m]")
    ax.set_title(title, fontsize=11)
    ax.legend(loc="upper center", fontsize=8, frameon=False, ncols=2)


def sketch_errors(axes: Sequence[Axes]) -> None:
    """Three panels: one estimate of three robots, and its error told in three ways."""
    truth = np.array([[2.0, 2.2, 0.6], [0.0, 0.0, 0.9], [4.2, 0.3, 2.2]])
    turned = transform(truth + [[0.25, 0.2, 0.1], [0, 0, 0.05], [0, 0, 0]], 0.35, np.array([0.5, -0.9]))
    laid = transform(turned, -0.35, transform(np.array([-0.5, 0.9]), -0.35))
    own = [np.array([relative(one, poses[1]) for one in poses]) for poses in (truth, laid)]
    panels: list[tuple[str, Any, Any]] = [
        ("gauge: as it is", truth, turned),
        ("aligned: laid on the truth", truth, laid),
        ("ego: in robot 1's own frame", own[0], own[1]),
    ]
    for ax, (title, real, believed) in zip(axes, panels):
        for name, poses, color in (("truth", real, GREY), ("estimate", believed, BLUE)):
            ax.plot(*np.array([*poses, poses[0]])[:, :2].T, "-", color=color, lw=0.8, alpha=0.5)
            for i, pose in enumerate(poses):
                ax.plot(*arrow(pose, 0.5).T, "-", color=color, lw=2, label=name if i == 0 else None)
        ax.plot(*np.array([real[0], believed[0]])[:, :2].T, "-", color=VERMILION, lw=3, label="error of robot 0")
        for i, pose in enumerate(real):
            ax.text(pose[0] + 0.3, pose[1] - 0.45, str(i), color=GREY, fontsize=10)
        ax.set(aspect="equal", xticks=[], yticks=[], xlabel="x", ylabel="y")
        ax.set_title(title, fontsize=11)
        ax.margins(0.15)
    axes[0].legend(loc="upper left", fontsize=8, frameon=False)
