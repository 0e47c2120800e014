"""Pictures of the field: walks, beliefs, errors and races. As in `labkit.plots`, a panel is set up once."""

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.patches import Circle, Rectangle
from matplotlib.ticker import FixedLocator, NullLocator

from .. import metrics
from ..geometry import ellipse
from ..log import replay
from ..plots import BLUE, GREEN, GREY, ORANGE, VERMILION, arrow
from .field import BEACONS, FIELD, GOALS

YELLOW, SKY, PINK = "#F0C808", "#2E86DE", "#E377C2"
METHODS = [
    (BLUE, "-"),
    (VERMILION, "--"),
    (GREEN, "-."),
    (ORANGE, ":"),
    ("#CC79A7", (0, (5, 1))),
    ("#56B4E9", (0, (1, 1))),
    (GREY, "-"),
    ("k", (0, (4, 1, 1, 1))),
]


def draw_field(ax, field=FIELD, title=""):
    """Lines, goals and beacons of a field, all that never moves."""
    x, y = field.length / 2, field.width / 2
    ax.add_patch(Rectangle((-x, -y), 2 * x, 2 * y, fill=False, ec="0.6", lw=1.2))
    ax.plot([0, 0], [-y, y], color="0.6", lw=1.2)
    ax.add_patch(Circle((0, 0), 0.18, fill=False, ec="0.6", lw=1.2))  # the league's centre circle
    colors = {"yellow": YELLOW, "blue": SKY, "pink": PINK}
    for landmark in field.map:
        if landmark.id in GOALS:
            ax.plot(
                [landmark.p[0]] * 2,
                [-field.goal / 2, field.goal / 2],
                color=colors[landmark.id.split()[0]],
                lw=6,
                solid_capstyle="butt",
            )
        elif landmark.id in BEACONS:
            upper, lower = landmark.id.split("-")
            ax.plot(*landmark.p, "o", ms=9, mfc=colors[upper], mec=colors[lower], mew=3)
    half = field.half + 0.25
    ax.set_aspect("equal")
    ax.set(xlim=(-half[0], half[0]), ylim=(-half[1], half[1]), xlabel="x [m]", ylabel="y [m]")
    ax.set_title(title, fontsize=11)


class WalkPanel:
    """A whole walk: true path, estimated path, 3-sigma ellipses along it."""

    def __init__(self, ax, field=FIELD, title="Walk, with 3σ ellipses"):
        draw_field(ax, field, title)
        (self.truth,) = ax.plot([], [], "-", color=BLUE, lw=1.6, label="true path")
        (self.estimate,) = ax.plot([], [], "--", color=VERMILION, lw=1.2, label="estimate")
        (self.ellipses,) = ax.plot([], [], "-", color=VERMILION, lw=0.6, alpha=0.7)
        (self.lifted,) = ax.plot([], [], "x", color=BLUE, ms=9, mew=2)
        (self.start,) = ax.plot([], [], "o", color=BLUE, ms=6)
        self.artists = [self.ellipses, self.truth, self.estimate, self.lifted, self.start]
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.3), ncols=2, fontsize=8, frameon=False)

    def show(self, log, history, ellipses=25):
        self.truth.set_data(*_broken(log.truth[:, :2], log.kidnapped).T)
        self.start.set_data(*log.truth[[0, *(k + 1 for k in log.kidnapped)], :2].T)
        self.lifted.set_data(*log.truth[list(log.kidnapped), :2].T)
        # An estimate of "anywhere" is just the middle of the field.
        sure = history.P[:, 0, 0] + history.P[:, 1, 1] < 1.0
        self.estimate.set_data(*np.where(sure[:, None], history.x[:, :2], np.nan).T)
        every = np.unique(np.linspace(0, len(log), ellipses).astype(int))
        # Wider ones would fill the picture.
        known = every[history.P[every, :2, :2].trace(axis1=1, axis2=2) < 1.0]
        outline = ellipse(history.x[known, :2], history.P[known, :2, :2], points=40)
        gap = np.full((len(known), 1, 2), np.nan)
        self.ellipses.set_data(*np.concatenate([outline, gap], axis=1).reshape(-1, 2).T)
        return self


def _broken(path, kidnapped):
    """A path (N+1, 2) with the pen lifted where the robot was carried."""
    return np.insert(path, [k + 1 for k in kidnapped], np.nan, axis=0)


def _legend_below(ax):
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=3, fontsize=8, frameon=False, columnspacing=1.0)


class DistancePanel:
    """Error of the position and of the heading over time."""

    def __init__(self, ax, duration, limit=8.0, kidnapped=True):
        ax.set(xlim=(0, duration), ylim=(0.005, limit), yscale="log", xlabel="time [s]", ylabel="error")
        ax.set_title("Error of the estimate", fontsize=11)
        (self.distance,) = ax.plot([], [], "-", color=BLUE, lw=1.2, label="position [m]")
        (self.heading,) = ax.plot([], [], ":", color=VERMILION, lw=1.2, label="heading [rad]")
        (self.kidnap,) = ax.plot([], [], "-.", color=GREY, lw=1.2, label="kidnapped" if kidnapped else None)
        self.artists = [self.kidnap, self.heading, self.distance]
        _legend_below(ax)

    def show(self, log, history):
        error, (low, high) = metrics.errors(history, log), self.distance.axes.get_ylim()
        self.distance.set_data(log.times, np.hypot(*error[:, :2].T).clip(low, high))
        self.heading.set_data(log.times, abs(error[:, 2]).clip(low, high))
        at = log.times[list(log.kidnapped)]
        self.kidnap.set_data(np.repeat(at, 3), np.tile([low, high, np.nan], len(at)))
        return self


class SurprisePanel:
    """d2 of each sighting over time, and the bound above which one counts as a surprise."""

    def __init__(self, ax, duration):
        ax.set(xlim=(0, duration), ylim=(1e-2, 1e3), yscale="log", xlabel="time [s]", ylabel="d² of a sighting")
        ax.set_title("How surprising are the sightings?", fontsize=11)
        (self.dots,) = ax.plot([], [], ".", color=BLUE, ms=3, label="one sighting")
        (self.bound,) = ax.plot([], [], "--", color=ORANGE, lw=1.3, label="bound")
        (self.find,) = ax.plot([], [], "|", color=VERMILION, ms=9, mew=1.5, label="grid at work")
        self.artists = [self.dots, self.bound, self.find]
        _legend_below(ax)

    def show(self, times, d2, bound, finding):
        low, high = self.dots.axes.get_ylim()
        self.dots.set_data(times, np.clip(d2, low, high))
        self.bound.set_data(self.dots.axes.get_xlim(), [bound, bound])
        self.find.set_data(finding, np.full(len(finding), 1.6 * low))
        return self


class BeliefPanel:
    """What one localizer believes at one moment: grid with its headings, particles, estimate and ellipse."""

    CELLS, PARTICLES = 60, 300  # as many wedges and dots as a picture can bear

    def __init__(self, ax, field=FIELD, title=""):
        draw_field(ax, field, title)
        half = field.half
        # The grid lies under the field's lines, or those would vanish where it knows nothing.
        self.image = ax.imshow(
            np.zeros((2, 2)),
            extent=(-half[0], half[0], -half[1], half[1]),
            origin="lower",
            cmap="Greens",
            vmin=0,
            vmax=1,
            alpha=0.6,
            zorder=0.5,
            interpolation="nearest",
        )
        self.wedges = PolyCollection([], facecolors="k", alpha=0.6, lw=0)
        ax.add_collection(self.wedges)
        (self.dots,) = ax.plot([], [], ".", color=GREEN, ms=2.5, label="particles")
        (self.trail,) = ax.plot([], [], "-", color=BLUE, lw=0.8, alpha=0.6, label="its path so far")
        (self.robot,) = ax.plot([], [], "-", color=BLUE, lw=2.2, label="robot")
        (self.sight,) = ax.plot([], [], ":", color=BLUE, lw=0.9, label="field of view")
        (self.ellipse,) = ax.plot([], [], "-", color=VERMILION, lw=1.4, label="3σ ellipse")
        (self.mean,) = ax.plot([], [], "-", color=VERMILION, lw=2.2, label="estimate")
        self.artists = [self.image, self.wedges, self.dots, self.trail, self.sight, self.robot, self.ellipse, self.mean]
        self.legend = [self.robot, self.trail, self.sight, self.mean, self.ellipse]

    def show(self, belief, log=None, k=0):
        """belief: from `believed`; the robot of `log` after k steps."""
        grid, particles = belief.get("grid"), belief.get("particles")
        self.image.set_data(np.ma.masked_less(grid.h, 0.05) if grid is not None else np.ma.masked_all((2, 2)))
        self.wedges.set_verts(_wedges(grid, self.CELLS) if grid is not None else [])
        self.dots.set_data(*(particles[:, :2].T if particles is not None else ([], [])))
        self.mean.set_data(*arrow(belief["x"], 0.28).T)
        wide = belief["P"][:2, :2].trace() > 1.5
        self.ellipse.set_data(*([], []) if wide else ellipse(belief["x"][:2], belief["P"][:2, :2]).T)
        if log is not None:
            pose = log.truth[k]
            self.robot.set_data(*arrow(pose, 0.28).T)
            path = _broken(log.truth[: k + 1, :2], [s for s in log.kidnapped if s < k])
            self.trail.set_data(*path.T)
            if k:
                self.sight.set_data(*_view(pose, log.pan[k - 1]).T)
        return self


def believed(localizer):
    """A copy of what a localizer believes: {"x", "P"} and, if it has them, {"grid"} or {"particles"}."""
    belief = {"x": np.array(localizer.xk_k), "P": np.array(localizer.Pk_k)}
    source = localizer.finder if getattr(localizer, "mode", "") == "find" else localizer
    if hasattr(source, "h"):
        belief["grid"] = _Grid(*(np.array(getattr(source, name)) for name in ("h", "theta", "s", "px", "py")))
    if hasattr(source, "particles"):
        particles = source.particles
        belief["particles"] = particles[:: max(1, len(particles) // BeliefPanel.PARTICLES)].copy()
    return belief


class _Grid:
    def __init__(self, h, theta, s, px, py):
        self.h, self.theta, self.s, self.px, self.py = h, theta, s, px, py


def _wedges(grid, most, size=0.24):
    """Triangles (n, 3, 2) in the most possible cells: they point along the heading, as wide as its support."""
    best = np.argsort(grid.h, axis=None, kind="stable")[::-1][:most]
    best = best[(grid.h.flat[best] > 0.3) & (grid.s.flat[best] < 2.5)]
    theta, spread = grid.theta.flat[best], np.minimum(grid.s.flat[best], 1.2) / 2
    base = np.stack([grid.px.flat[best], grid.py.flat[best]], axis=-1)
    sides = [base + size * np.stack([np.cos(a), np.sin(a)], axis=-1) for a in (theta - spread, theta + spread)]
    return np.stack([base, *sides], axis=1)


def _view(pose, pan, reach=1.2):
    from .robot import FOV

    edges = pose[2] + pan + np.array([-FOV / 2, FOV / 2])
    return (
        pose[:2]
        + np.array([[np.cos(edges[0]), np.sin(edges[0])], [0, 0], [np.cos(edges[1]), np.sin(edges[1])]]) * reach
    )


def plot_experiment(axes, log, history, bounds=(0.07, np.deg2rad(60))):
    """The paper's figures 6 to 8: error of (x, y) and of the heading over time, with what it says is never exceeded."""
    error = metrics.errors(history, log)
    for ax, values, bound, label in [
        (axes[0], 100 * np.hypot(*error[:, :2].T), 100 * bounds[0], "position error [cm]"),
        (axes[1], np.rad2deg(abs(error[:, 2])), np.rad2deg(bounds[1]), "heading error [°]"),
    ]:
        ax.plot(log.times, values, "-", color=BLUE, lw=1.1)
        ax.axhline(bound, color=ORANGE, ls="--", lw=1.3)
        ax.set(xlim=(0, log.times[-1]), ylim=(0, 1.15 * max(bound, values.max())), xlabel="time [s]", ylabel=label)


def plot_race(axes, results):
    """Three axes: median error over time, share of runs recovered over time, accuracy against cost."""
    spots = []
    styles = {r.name: METHODS[i % len(METHODS)] for i, r in enumerate(results)}
    for r in results:
        color, style = styles[r.name]
        axes[0].plot(
            0.1 * np.arange(r.distance.shape[1]),
            np.median(r.distance, axis=0),
            ls=style,
            color=color,
            lw=1.3,
            label=r.name,
        )
        if r.kidnapped is not None:
            steps = np.sort(np.nan_to_num(r.recovered(), nan=np.inf))
            share = np.arange(1, len(steps) + 1) / len(steps)
            soon = steps <= 60
            x, y = np.append(0, steps[soon]) / 10, np.append(0, share[soon])
            axes[1].step(np.append(x, 6), 100 * np.append(y, y[-1]), where="post", ls=style, color=color, lw=1.3)
        spot = 1e3 * r.seconds, 100 * r.tracking.mean()
        axes[2].plot(*spot, "o", color=color, ms=8)
        spots.append((spot, r.name))
    kidnapped = results[0].kidnapped
    if kidnapped is not None:
        axes[0].axvline(0.1 * kidnapped, color=GREY, ls="-.", lw=1)
    axes[0].set(yscale="log", xlabel="time [s]", ylabel="median position error [m]")
    axes[1].set(xlim=(0, 6), ylim=(0, 104), xlabel="time after the kidnapping [s]", ylabel="runs recovered [%]")
    low, high = np.min([spot for spot, _ in spots], axis=0), np.max([spot for spot, _ in spots], axis=0)
    axes[2].set(
        xscale="log",
        yscale="log",
        xlabel="computing time per step [ms]",
        ylabel="mean tracking error [cm]",
        xlim=(low[0] / 1.6, high[0] * 2),
        ylim=(min(low[1] / 1.3, 3), max(high[1] * 1.3, 30)),
    )
    for axis in (axes[2].xaxis, axes[2].yaxis):
        axis.set_major_locator(FixedLocator([d * 10.0**e for e in range(-3, 4) for d in (1, 3)]))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_locator(NullLocator())
    # Names beside the dots, from the most accurate up; each at least a line above the one before.
    height, step = -np.inf, np.log10(np.divide(*axes[2].get_ylim()[::-1])) / 22
    for (x, y), name in sorted(spots, key=lambda one: one[0][1]):
        height = max(np.log10(y), height + step)
        axes[2].annotate(
            name,
            (x, y),
            (high[0] * 2.15, 10**height),
            fontsize=7.5,
            ha="left",
            va="center",
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "lw": 0.4, "color": "0.6", "shrinkB": 3},
        )
    axes[0].figure.legend(loc="outside lower center", ncols=min(4, len(results)), fontsize=9, frameon=False)


def show_walk(log, history=None, title=""):
    """A walk on the field and, with the History of a filter, its error over time."""
    import matplotlib.pyplot as plt  # here only: the panels need no pyplot

    if history is None:
        figure, ax = plt.subplots(figsize=(6.4, 4.6), layout="constrained")
        draw_field(ax, log.field, title)
        for landmark in log.map:
            x, y = landmark.p
            ax.annotate(
                landmark.id,
                (x, y),
                (-10 * np.sign(x), 0) if y == 0 else (0, -14 * np.sign(y)),
                textcoords="offset points",
                ha="center" if y else "left" if x < 0 else "right",
                va="center",
                fontsize=8,
                color="0.35",
            )
        ax.plot(*log.truth[0, :2], "o", color=BLUE, ms=7, label="start")
        ax.plot(*_broken(log.truth[:, :2], log.kidnapped).T, "-", color=BLUE, lw=1.6, label="true path")
        for k in range(0, len(log) + 1, 20):
            ax.plot(
                *arrow(log.truth[k], 0.18).T,
                "-",
                color=VERMILION,
                lw=1.2,
                label="heading, every 2 s" if k == 0 else None,
            )
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, fontsize=9, frameon=False)
    else:
        figure, axes = plt.subplots(1, 2, figsize=(10, 3.9), layout="constrained", width_ratios=[1.3, 1])
        WalkPanel(axes[0], log.field).show(log, history)
        carried = bool(log.kidnapped)
        DistancePanel(axes[1], log.times[-1], 8.0 if carried else 1.0, carried).show(log, history)
        for panel in axes:
            panel.get_legend().set(loc="upper center", bbox_to_anchor=(0.5, -0.16))
        figure.suptitle(title)
    plt.show()


def show_beliefs(localizer, log, steps=(0, 1, 4, 10, 20, 60)):
    """The paper's figure 4: what a localizer believes after some of the steps of a log."""
    import matplotlib.pyplot as plt

    rows = -(-len(steps) // 3)
    figure, axes = plt.subplots(
        rows, 3, figsize=(11, 2.9 * rows + 0.5), layout="constrained", sharex=True, sharey=True, squeeze=False
    )
    beliefs = beliefs_along(localizer, log, steps)
    for ax, k in zip(axes.flat, steps):
        panel = BeliefPanel(ax, log.field, f"after {k} steps" if k != 1 else "after 1 step")
        panel.show(beliefs[k], log, k)
        ax.label_outer()
    for ax in list(axes.flat)[len(steps) :]:
        ax.set_visible(False)
    figure.legend(handles=panel.legend, loc="outside lower center", ncols=5, fontsize=9, frameon=False)
    plt.show()


def beliefs_along(localizer, log, steps):
    """{step: belief} of a localizer that is replayed over a log."""
    beliefs = {0: believed(localizer)}

    def note(k):
        if k in steps:
            beliefs[k] = believed(localizer)

    replay(Watched(localizer, note), log)
    return beliefs


class Watched:
    """A localizer for `replay` that calls note(k) when its k-th step is done."""

    def __init__(self, localizer, note):
        self.localizer, self.note, self.k = localizer, note, 0

    xk_k = property(lambda self: self.localizer.xk_k)
    Pk_k = property(lambda self: self.localizer.Pk_k)

    def predict(self, u):
        self.localizer.predict(u)

    def update(self, y):
        self.localizer.update(y)
        self.k += 1
        self.note(self.k)
