"""What localizers believe along a walk, and pictures of that: grid with its headings, particles, estimate, ellipse."""

from collections.abc import Callable, Collection, Iterable, Sequence
from types import SimpleNamespace
from typing import Any, Self

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.patches import Patch

from ..geometry import Array, Motion, Point, ellipse
from ..history import replay
from ..plots import BLUE, GREEN, VERMILION, arrow
from ..world import Landmark
from .field import FIELD, Field
from .fuzzygrid import FuzzyGrid
from .robot import FOV, FieldLog
from .walkplots import draw_field, pen_lifted


class BeliefPanel:
    """What one localizer believes at one moment: grid with its headings, particles, estimate and ellipse."""

    CELLS, PARTICLES = 60, 300  # as many wedges and dots as a picture can bear

    def __init__(self, ax: Axes, field: Field = FIELD, title: str = ""):
        draw_field(ax, field, title)
        half = field.half
        # The grid lies under the field's lines, or those would vanish where it knows nothing.
        where = {"extent": (-half[0], half[0], -half[1], half[1]), "origin": "lower", "zorder": 0.5}
        look: dict[str, Any] = {"cmap": "Greens", "vmin": 0, "vmax": 1, "alpha": 0.6, "interpolation": "nearest"}
        self.image = ax.imshow(np.zeros((2, 2)), **look | where)
        self.wedges = PolyCollection([], facecolors="k", alpha=0.6, lw=0)
        ax.add_collection(self.wedges)
        (self.dots,) = ax.plot([], [], ".", color=GREEN, ms=2.5, label="particles")
        (self.trail,) = ax.plot([], [], "-", color=BLUE, lw=0.8, alpha=0.6, label="its path so far")
        (self.robot,) = ax.plot([], [], "-", color=BLUE, lw=2.2, label="robot")
        (self.sight,) = ax.plot([], [], ":", color=BLUE, lw=0.9, label="field of view")
        (self.ellipse,) = ax.plot([], [], "-", color=VERMILION, lw=1.4, label="3σ ellipse")
        (self.mean,) = ax.plot([], [], "-", color=VERMILION, lw=2.2, label="estimate")
        self.artists = [self.image, self.wedges, self.dots, self.trail, self.sight, self.robot, self.ellipse, self.mean]
        self.cells = Patch(color=self.image.cmap(0.8), alpha=0.6, label="possible cells")
        self.pointing = Patch(color="k", alpha=0.6, label="headings of the best")

    def show(self, belief: dict, log: FieldLog, k: int) -> Self:
        """Fill the panel; belief: from `believed`; the robot of `log` after k steps."""
        grid, particles = belief.get("grid"), belief.get("particles")
        self.image.set_data(np.ma.masked_less(grid.h, 0.05) if grid is not None else np.ma.masked_all((2, 2)))
        self.wedges.set_verts(_wedges(grid, self.CELLS) if grid is not None else [])
        self.dots.set_data(*(particles[:, :2].T if particles is not None else ([], [])))
        self.mean.set_data(*arrow(belief["x"], 0.28).T)
        wide = belief["P"][:2, :2].trace() > 1.5
        self.ellipse.set_data(*([], []) if wide else ellipse(belief["x"][:2], belief["P"][:2, :2]).T)
        truth = np.asarray(log.truth)
        self.robot.set_data(*arrow(truth[k], 0.28).T)
        self.trail.set_data(*pen_lifted(truth[: k + 1, :2], [s for s in log.kidnapped if s < k]).T)
        if k:
            self.sight.set_data(*_view(truth[k], np.asarray(log.pan)[k - 1]).T)
        return self

    def entries(self, beliefs: Iterable[dict]) -> list[Artist]:
        """What a legend for these beliefs has to name: of grid and particles, only what is there."""
        kinds = {kind for belief in beliefs for kind in belief}
        parts = [self.cells, self.pointing] * ("grid" in kinds) + [self.dots] * ("particles" in kinds)
        return [self.robot, self.trail, self.sight, self.mean, self.ellipse, *parts]


def believed(localizer: Any) -> dict:
    """A copy of what a localizer believes: {"x", "P"} and, if it has them, {"grid"} or {"particles"}."""
    belief: dict[str, Any] = {"x": np.array(localizer.xk_k), "P": np.array(localizer.Pk_k)}
    source = localizer.finder if getattr(localizer, "mode", "") == "find" else localizer
    if hasattr(source, "h"):
        copies = {name: np.array(getattr(source, name)) for name in ("h", "theta", "s", "px", "py")}
        belief["grid"] = SimpleNamespace(**copies)
    if hasattr(source, "particles"):
        particles = source.particles
        belief["particles"] = particles[:: max(1, len(particles) // BeliefPanel.PARTICLES)].copy()
    return belief


def _wedges(grid, most, size=0.24):
    """Triangles (n, 3, 2) in the most possible cells: they point along the heading, as wide as its support."""
    best = np.argsort(grid.h, axis=None, kind="stable")[::-1][:most]
    best = best[(grid.h.flat[best] > 0.3) & (grid.s.flat[best] < 2.5)]
    theta, spread = grid.theta.flat[best], np.minimum(grid.s.flat[best], 1.2) / 2
    base = np.stack([grid.px.flat[best], grid.py.flat[best]], axis=-1)
    sides = [base + size * np.stack([np.cos(a), np.sin(a)], axis=-1) for a in (theta - spread, theta + spread)]
    return np.stack([base, *sides], axis=1)


def _view(pose, pan, reach=1.2):
    edges = pose[2] + pan + np.array([-FOV / 2, FOV / 2])
    return (
        pose[:2]
        + np.array([[np.cos(edges[0]), np.sin(edges[0])], [0, 0], [np.cos(edges[1]), np.sin(edges[1])]]) * reach
    )


def beliefs_along(localizer: Any, log: FieldLog, steps: Collection[int]) -> dict[int, dict]:
    """{step: belief} of a localizer that is replayed over a log."""
    beliefs = {0: believed(localizer)}

    def note(k):
        if k in steps:
            beliefs[k] = believed(localizer)

    replay(Watched(localizer, note), log).sound()
    return beliefs


class Watched:
    """A localizer for `replay` that calls note(k) when its k-th step is done."""

    def __init__(self, localizer: Any, note: Callable[[int], None]):
        self.localizer, self.note, self.k = localizer, note, 0

    xk_k = property(lambda self: self.localizer.xk_k)
    Pk_k = property(lambda self: self.localizer.Pk_k)

    def predict(self, u: Motion) -> None:
        """As the localizer does; u (3,)."""
        self.localizer.predict(u)

    def update(self, y: list) -> None:
        """As the localizer does; then note it."""
        self.localizer.update(y)
        self.k += 1
        self.note(self.k)


def plot_possible(ax: Axes, grid: FuzzyGrid, possible: Array, landmark: Landmark, robot: Point) -> None:
    """How possible each cell of a grid is (its shape), the landmark that was seen last, and the robot (2,) [m]."""
    shades = ax.pcolormesh(grid.x, grid.y, possible, cmap="Greens", vmin=0, vmax=1)
    ax.plot(*landmark.p, "k*", ms=12, label="landmark")
    ax.plot(*robot, "+", color=BLUE, ms=12, mew=2, label="robot")
    half = grid.field.half + 0.2
    ax.set(aspect="equal", xlim=(-half[0], half[0]), ylim=(-half[1], half[1]), xlabel="x [m]", ylabel="y [m]")
    ax.label_outer()
    if not ax.figure.legends:  # one for all panels
        ax.figure.colorbar(shades, ax=ax.figure.axes, label="how possible")
        ax.figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)


def show_beliefs(localizer: Any, log: FieldLog, steps: Sequence[int] = (0, 1, 4, 10, 20, 60)) -> None:
    """As in the paper's figure 4: what a localizer believes after some of the steps of a log."""
    import matplotlib.pyplot as plt

    rows = -(-len(steps) // 3)
    figure, axes = plt.subplots(
        rows, 3, figsize=(11, 2.9 * rows + 0.8), layout="constrained", sharex=True, sharey=True, squeeze=False
    )
    beliefs = beliefs_along(localizer, log, steps)
    for ax, k in zip(axes.flat, steps):
        panel = BeliefPanel(ax, log.field, f"after {k} steps" if k != 1 else "after 1 step")
        panel.show(beliefs[k], log, k)
        ax.label_outer()
    for ax in list(axes.flat)[len(steps) :]:
        ax.set_visible(False)
    entries = panel.entries(beliefs.values())
    figure.legend(handles=entries, loc="outside lower center", ncols=4, fontsize=9, frameon=False)
    plt.show()
