"""The two frames of a legged robot, drawn from above: what odometry and a sighting count in."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon, Wedge

from ..geometry import Motion, Point, Pose, compose, transform
from ..plots import BLUE, GREEN, GREY, ORANGE, VERMILION
from .robot import FOV

BODY = np.array([[-0.28, -0.13], [0.12, -0.13], [0.24, 0.0], [0.12, 0.13], [-0.28, 0.13]])  # [m] seen from above
LEGS = np.array([[0.1, 0.17], [0.1, -0.17], [-0.24, 0.17], [-0.24, -0.17]])
_ARROW: dict[str, Any] = {"arrowstyle": "-|>", "lw": 1.6, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 12}


def show_frames(pose: Pose, u: Motion, landmark: Point) -> None:
    """The paper's figures 1 and 5: a robot at a pose (3,) sees a landmark (2,) [m], and moves by u (3,)."""
    import matplotlib.pyplot as plt

    _, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained", sharex=True, sharey=True)
    _seeing(left, np.array(pose, dtype=float), np.array(landmark, dtype=float))
    _walking(right, np.array(pose, dtype=float), np.array(u, dtype=float))
    for ax in (left, right):
        _frame(ax, np.zeros(3), "0.2", ("the world's x", "the world's y"), 0.7)
        ax.set(xlim=(-0.35, 2.75), ylim=(-0.25, 2.65), xlabel="x [m]", ylabel="y [m]", aspect="equal")
    right.set_ylabel("")
    plt.show()


def _robot(ax: Axes, pose, **look):
    ax.add_patch(Polygon(transform(BODY, pose[2]) + pose[:2], closed=True, **{"fc": "0.85", "ec": "0.3"} | look))
    ax.plot(*(transform(LEGS, pose[2]) + pose[:2]).T, "o", color="0.5", ms=5, zorder=1)


def _frame(ax, pose, color, names, size):
    """Axes x and y of a frame at a pose (3,), with their names at the ends."""
    for axis, name in zip(size * np.eye(2), names):
        end = pose[:2] + transform(axis, pose[2])
        ax.annotate("", end, pose[:2], arrowprops=_ARROW | {"color": color})
        ax.annotate(name, end, (4, 4), textcoords="offset points", color=color, fontsize=9)


def _angle(ax, pose, start, end, radius, text, color):
    """An arc around a pose's place from one direction to another [rad], with its letter."""
    turn = np.linspace(start, end, 30)
    ax.plot(pose[0] + radius * np.cos(turn), pose[1] + radius * np.sin(turn), "-", color=color, lw=1.4)
    middle, out = (start + end) / 2, radius + 0.1
    ax.text(pose[0] + out * np.cos(middle), pose[1] + out * np.sin(middle), text, color=color, ha="center", va="center")


def _seeing(ax, pose, landmark):
    away = landmark - pose[:2]
    towards, head = np.arctan2(away[1], away[0]), np.arctan2(away[1], away[0]) - 0.15
    ends = np.rad2deg([head - FOV / 2, head + FOV / 2])
    ax.add_patch(Wedge(tuple(pose[:2]), 1.5, *ends, fc=ORANGE, alpha=0.2, label="what the camera sees"))
    _robot(ax, pose)
    ax.plot([pose[0], pose[0] + 0.6], [pose[1]] * 2, ":", color=GREY, lw=1)
    _frame(ax, pose, BLUE, ("its x: the heading", "its y"), 0.75)
    ax.plot(*np.stack([pose[:2], landmark]).T, "--", color=VERMILION, lw=1.2)
    ax.plot(*landmark, "k*", ms=12, label="landmark")
    ax.annotate("range ρ", pose[:2] + 0.75 * away, (-8, 4), textcoords="offset points", color=VERMILION, ha="right")
    _angle(ax, pose, pose[2], towards, 0.65, "α", VERMILION)
    _angle(ax, pose, 0.0, pose[2], 0.4, "θ", BLUE)
    ax.set_title("seeing: pose (x, y, θ), range and bearing", fontsize=11)
    ax.legend(loc="upper left", fontsize=9, frameon=False)


def _walking(ax, pose, u):
    new, corner = compose(pose, u), pose[:2] + transform(np.array([u[0], 0.0]), pose[2])
    scale = 2.2  # a step of the log is 2 cm long: here it is drawn large
    new[:2] = pose[:2] + scale * (new[:2] - pose[:2])
    corner = pose[:2] + scale * (corner - pose[:2])
    _robot(ax, pose)
    _robot(ax, new, fc="none", ls="--")
    _frame(ax, new, GREEN, ("its new x", "its new y"), 0.6)
    for start, end, name in ((pose[:2], corner, "$u^x$ ahead"), (corner, new[:2], "$u^y$ to the left")):
        ax.annotate("", end, start, arrowprops=_ARROW | {"color": BLUE})
        ax.annotate(name, (start + end) / 2, (8, -10), textcoords="offset points", color=BLUE)
    ax.plot([new[0], new[0] + 0.7 * np.cos(pose[2])], [new[1], new[1] + 0.7 * np.sin(pose[2])], ":", color=GREY, lw=1)
    _angle(ax, new, pose[2], new[2], 0.45, "$u^θ$", GREEN)
    ax.set_title("walking: odometry, in the frame of the old pose", fontsize=11)
