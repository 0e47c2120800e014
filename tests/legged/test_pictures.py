"""Pictures, sliders and animation of the legged robot: drawn without warnings, and with nothing cut off."""

import base64
import io
from dataclasses import replace
from functools import cache

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from labkit import make_filter, replay, wrap
from labkit.legged import (
    FuzzyGrid,
    LeggedRobot,
    Memory,
    ParticleFilter,
    explore,
    play,
    plot_cells,
    plot_experiment,
    plot_race,
    race,
    show_beliefs,
    show_frames,
    show_walk,
)
from labkit.legged.beliefplots import BeliefPanel, believed
from labkit.legged.widgets import WalkExplorer

from helpers.drawings import kept, legible, names, pixels, shown, widgets
from helpers.localizers import CONTESTANTS, answer, ekf, hybrid

pytestmark = pytest.mark.filterwarnings("error")


@cache
def recorded(preset="real", seed=1, steps=200, kidnap=()):
    return LeggedRobot(preset, rng=seed).record(steps, kidnap=kidnap)


def carried():
    return recorded("real", 1, 120, 60)


def history(log):
    return replay(ekf(log), log)


# Figures


def test_the_check_itself_finds_what_is_cut_off_and_what_overlaps(drawn):
    figure = Figure((3, 2), dpi=100)
    FigureCanvasAgg(figure)
    for where, name in [((0.3, 0.5), "one"), ((0.33, 0.5), "two"), ((0.6, 0.2), "three"), ((0.6, 0.8), "four")]:
        figure.text(*where, name)
    figure.canvas.draw()
    with pytest.raises(AssertionError, match="on one another"):
        legible(drawn, figure)
    figure.texts[1].set_position((0.95, 0.5))
    drawn.clear()
    figure.canvas.draw()
    with pytest.raises(AssertionError, match=r"cut off: \['two'\]"):
        legible(drawn, figure)


@pytest.mark.parametrize("title", ["", "A walk with a title"])
def test_a_walk_is_shown(drawn, title):
    log = recorded()
    show_walk(log, title=title)
    figure = shown(drawn)
    (path,) = [line for line in figure.axes[0].lines if line.get_label() == "true path"]
    np.testing.assert_array_equal(path.get_xydata(), log.truth[:, :2])
    assert {"true path", "heading, every 2 s", "x [m]"} <= set(names(drawn, figure)) and (
        not title or title in names(drawn, figure)
    )


@pytest.mark.parametrize("kidnapped", [False, True])
def test_a_walk_is_shown_with_a_filter(drawn, kidnapped):
    log = carried() if kidnapped else recorded()
    show_walk(log, history(log), "real, seed 1")
    figure = shown(drawn)
    assert ("kidnapped" in names(drawn, figure)) == kidnapped and "real, seed 1" in names(drawn, figure)
    lines = {line.get_label(): line.get_xydata() for line in figure.axes[0].lines}
    np.testing.assert_array_equal(lines["estimate"], history(log).x[:, :2])
    path = lines["true path"]
    assert np.isnan(path).all(axis=1).sum() == kidnapped  # the pen is lifted where the robot was carried
    if kidnapped:
        assert np.isnan(path[61]).all()


@pytest.mark.parametrize(
    ("make", "steps"),
    [
        (lambda: FuzzyGrid("real"), (0, 1, 4, 10, 20, 60)),
        (lambda: FuzzyGrid("real"), (0, 70)),
        (lambda: ParticleFilter(400, "real", rng=0), (0, 10, 20, 50)),
        (lambda: ekf(carried()), (30,)),
        (lambda: hybrid(carried(), FuzzyGrid("real")), (0, 1, 61)),
        (lambda: hybrid(carried(), Memory(answer("restart"), "real"), background=1), (0, 5, 120)),
    ],
)
def test_beliefs_are_shown(drawn, make, steps):
    show_beliefs(make(), carried(), steps)
    figure = shown(drawn)
    there = [ax for ax in figure.axes if ax.get_visible()]
    assert [ax.get_title() for ax in there] == [f"after {k} step{'s' if k != 1 else ''}" for k in steps]
    assert {"robot", "estimate", "3σ ellipse"} <= set(names(drawn, figure))


def test_a_belief_is_what_the_localizer_believes():
    grid, particles = FuzzyGrid("real"), ParticleFilter(900, "real", rng=0)
    for kf in (grid, particles):
        replay(kf, recorded())
    panel = BeliefPanel(Figure().subplots())
    panel.show(believed(grid), recorded(), 200)
    image = panel.image.get_array()
    np.testing.assert_array_equal(image.data, grid.h)
    np.testing.assert_array_equal(image.mask, grid.h < 0.05)
    assert 0 < len(panel.wedges.get_paths()) <= BeliefPanel.CELLS and not len(panel.dots.get_xdata())
    before = believed(grid)["grid"].h
    grid.reset()
    assert (before != grid.h).any()  # a copy
    panel.show(believed(particles), recorded(), 200)
    assert (
        len(panel.dots.get_xdata()) == BeliefPanel.PARTICLES
        and not len(panel.wedges.get_paths())
        and image is not panel.image.get_array()
    )
    kf = hybrid(recorded(), grid)
    assert "grid" in believed(kf)
    replay(kf, recorded())
    assert kf.mode == "follow" and "grid" not in believed(kf)


COST = np.geomspace(0.45, 0.06, len(CONTESTANTS))  # [ms] a step; what it really is, a busy machine hides


@cache
def results(preset="real", kidnap=110):
    logs = [recorded(preset, seed, 150, kidnap) for seed in range(2)]
    return [replace(r, seconds=ms / 1000) for r, ms in zip(race(CONTESTANTS, logs), COST, strict=True)]


def raced(drawn, results):
    figure = plt.figure(figsize=(11, 4.3), layout="constrained")
    axes = figure.subplots(1, 3)
    plot_race(axes, results)
    shown(drawn)
    return figure, axes


@pytest.mark.slow
@pytest.mark.parametrize("kidnap", [(), 110])
@pytest.mark.parametrize("count", [1, 3, 10])
def test_a_race_is_drawn(drawn, kidnap, count):
    """Each contestant has a row: its median error over time, and when it found the robot again."""
    chosen = results("real", kidnap)[:count]
    _, (left, middle, right) = raced(drawn, chosen)
    assert [label.get_text() for label in left.get_yticklabels()] == list(CONTESTANTS)[:count]
    np.testing.assert_array_equal(left.images[0].get_array(), [np.median(r.distance, axis=0) for r in chosen])
    assert len(middle.lines) == (count if kidnap else 0) and len(right.lines) == count


@pytest.mark.slow
@pytest.mark.parametrize(("preset", "slower"), [("paper", 1), ("real", 1), ("harsh", 1), ("real", 10)])
def test_each_contestant_of_a_race_has_its_dot_in_the_picture(drawn, preset, slower):
    shown = [replace(r, seconds=slower * r.seconds) for r in results(preset)]
    _, axes = raced(drawn, shown)
    (left, right), (low, high) = axes[2].get_xlim(), axes[2].get_ylim()
    outside = {}
    for result, line in zip(shown, axes[2].lines):
        x, y = line.get_xydata()[0]
        if not (left <= x <= right and low <= y <= high):
            outside[result.name] = f"{x:.2f} ms, {y:.1f} cm"
    assert not outside


@pytest.mark.slow
def test_as_many_as_recovered_are_drawn_as_recovered(drawn):
    _, axes = raced(drawn, results())
    for line, text, result in zip(axes[1].lines, axes[1].texts, results(), strict=True):
        found = result.recovered() / 10
        known = found[np.isfinite(found)]
        assert text.get_text() == f"{100 * len(known) / len(found):.0f} %"
        if len(line.get_xdata()):
            assert line.get_xdata()[0] == pytest.approx(min(np.median(known), 6))
        else:
            assert len(known) <= len(found) / 2


def test_the_size_of_cells_is_drawn_against_error_and_cost(drawn):
    chosen = [replace(r, seconds=ms / 1000) for r, ms in zip(race(grids(), [recorded("real", 1, 130)]), (1.6, 0.5))]
    plot_cells([0.05, 0.4], chosen)
    error, cost = shown(drawn).axes
    np.testing.assert_allclose(error.lines[0].get_ydata(), [100 * r.tracking.mean() for r in chosen])
    np.testing.assert_allclose(cost.lines[0].get_ydata(), [1.6, 0.5])
    assert list(cost.lines[0].get_xdata()) == [5, 40] and cost.get_ylim()[0] == 0


def grids():
    return {f"{cell}": lambda log, cell=cell: FuzzyGrid(log.noise.told(), cell=cell) for cell in (0.05, 0.4)}


def test_both_frames_are_drawn(drawn):
    show_frames((1.15, 0.55, 0.6), (0.5, 0.3, 0.5), (2.4, 2.4))
    figure = shown(drawn)
    assert {"θ", "α", "range ρ", "$u^x$ ahead", "its x: the heading", "the world's x"} <= set(names(drawn, figure))


def test_a_legend_names_what_is_there_and_nothing_else(drawn):
    panel = BeliefPanel(Figure().subplots())
    grid, particles = believed(FuzzyGrid("real")), believed(ParticleFilter(300, "real", rng=0))
    labels = {kind: [one.get_label() for one in panel.entries(of)] for kind, of in (("g", [grid]), ("p", [particles]))}
    assert "headings of the best" in labels["g"] and "particles" not in labels["g"]
    assert "particles" in labels["p"] and "possible cells" not in labels["p"]
    assert len(panel.entries([grid, particles])) == 8 and len(panel.entries([believed(ekf(recorded()))])) == 5


def test_an_estimate_that_leaves_the_field_is_in_the_picture(drawn):
    log = recorded("real", 1, 300, 150)
    show_walk(log, history(log))
    ax = shown(drawn).axes[0]
    (estimate,) = [line for line in ax.lines if line.get_label() == "estimate"]
    x, y = estimate.get_xydata().T
    assert ax.get_xlim()[0] < x.min() and x.max() < ax.get_xlim()[1] and x.max() > 3.15
    assert ax.get_ylim()[0] < y.min() and y.max() < ax.get_ylim()[1]


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["paper", "harsh"])
def test_the_papers_experiments_are_drawn(drawn, preset):
    figure = plt.figure(figsize=(11, 5), layout="constrained")
    axes = figure.subplots(2, 3, sharex=True)
    for i, seed in enumerate((6, 7, 8)):
        log = recorded(preset, seed, 100)
        plot_experiment(axes[:, i], log, history(log))
    shown(drawn)
    off = np.hypot(*(history(log).x - log.truth)[:, :2].T)
    np.testing.assert_allclose(axes[0, 2].lines[0].get_ydata(), 100 * off)
    for ax in axes.flat:
        assert all(max(line.get_ydata()) < ax.get_ylim()[1] for line in ax.lines)
    assert all(ax.get_ylim()[1] < 60 for ax in axes[1])  # with the paper's bound in it, the curve would be flat


# Sliders


def explorer(**options):
    return WalkExplorer(
        answer("EKF"),
        answer("lost"),
        **{"preset": "real", "names": ("gate", "bound", "share"), "seed": 1, "background": 0} | options,
    )


@pytest.mark.parametrize(("preset", "background"), [("paper", 0), ("real", 3), ("harsh", 0)])
def test_the_picture_under_the_sliders_is_legible(drawn, preset, background):
    made = explorer(preset=preset, background=background)
    legible(drawn, made.canvas.figure)
    assert {"one sighting", "grid at work", "kidnapped", "true path"} <= set(names(drawn, made.canvas.figure))


def test_sliders_change_picture_and_figures():
    box = explore(answer("EKF"), answer("lost"), "real")
    (image,), (text,) = widgets(box, "Image"), [w for w in widgets(box, "HTML") if "kidnapping" in w.value]
    seen = [(image.value, text.value)]
    gate, bound = widgets(box, "FloatLogSlider")
    (share,) = widgets(box, "FloatSlider")
    for slider, value in ((gate, 100), (gate, 13.8), (bound, 300), (bound, 13.8), (share, 1.0)):
        slider.value = value
        seen.append((image.value, text.value))
    (first, words), *rest = seen
    assert rest[1] == rest[3] == (first, words)  # back where it was: the walk stays the same
    assert all(rest[i][0] != first and rest[i][1] != words for i in (0, 2, 4))
    picture = pixels(base64.b64decode(kept(box)["image/png"]))
    assert picture.shape[1] > 600 and np.ptp(picture) == 255
    assert "before the kidnapping" in kept(box)["text/plain"] and "grid at work" in kept(box)["text/plain"]


def test_the_seed_button_and_the_preset_give_another_walk():
    box = explore(answer("EKF"), answer("lost"), "real", sliders=("share",))
    (image,), seen = widgets(box, "Image"), []
    for act in (
        lambda: None,
        widgets(box, "Button")[0].click,
        lambda: setattr(widgets(box, "ToggleButtons")[0], "value", "harsh"),
    ):
        act()
        seen.append((image.value, kept(box)["text/plain"]))
    assert len({picture for picture, _ in seen}) == len({words for _, words in seen}) == 3
    assert any("seed 2, kidnapped at 15 s" in w.value for w in widgets(box, "HTML")) and not widgets(
        box, "FloatLogSlider"
    )


def test_what_the_picture_says_is_what_the_filter_did():
    made = explorer()
    log, (walk, distance, surprise) = made.log, made.panels
    h = replay(hybrid(log, FuzzyGrid(log.noise.told())), log)
    sure = h.P[:, :2, :2].trace(axis1=1, axis2=2) < 1
    np.testing.assert_array_equal(walk.estimate.get_xydata()[sure], h.x[sure, :2])
    np.testing.assert_allclose(distance.distance.get_ydata(), np.hypot(*(h.x - log.truth)[:, :2].T).clip(0.005, 8))
    turned = np.rad2deg(abs(wrap((h.x - log.truth)[:, 2]))).clip(0.1, 200)
    np.testing.assert_allclose(distance.heading.get_ydata(), turned)  # a scale of its own, in degrees
    assert list(distance.kidnap.get_xdata()[:2]) == [15, 15] and list(surprise.bound.get_ydata()) == [13.8, 13.8]
    assert len(surprise.dots.get_xdata()) > 100 and 0 < len(surprise.find.get_xdata()) < 100


def broken(**methods):
    """The solution's EKF with other methods."""
    return type("EKF", (answer("EKF"),), methods)


def unfilled(*_, **told):
    raise NotImplementedError("`update` is still to be written.")


UNFILLED = {"update": unfilled}
BROKEN = {"predict": lambda self, u: 1 / 0}
NONSENSE = {"predict": lambda self, u: setattr(self, "xk_k", self.xk_k * np.nan)}
FORGETFUL = {"update": lambda self, y: delattr(self, "d2")}
NO_GATE = {"__init__": lambda self, x0, P0, m, noise: None}


@pytest.mark.parametrize(
    ("methods", "lost", "message"),
    [
        (UNFILLED, None, "still to be written"),
        (BROKEN, None, "ZeroDivisionError"),
        (NONSENSE, None, "not a number"),
        (FORGETFUL, None, "d2"),
        (NO_GATE, None, "gate"),
        ({}, unfilled, "still to be written"),
        ({}, lambda P, d2: False, "bound"),
    ],
)
def test_what_breaks_shows_its_sentence(methods, lost, message):
    box = explore(broken(**methods), lost or answer("lost"))
    assert message in kept(box)["text/plain"] and "image/png" not in kept(box)
    assert any('role="alert"' in w.value for w in widgets(box, "HTML"))
    assert all(image.layout.display == "none" for image in widgets(box, "Image"))


def test_what_works_again_gets_its_picture_back():
    picky = broken(update=lambda self, y: answer("EKF").update(self, y) if self.gate < 100 else 1 / 0)
    box = explore(picky, answer("lost"))
    gate, image = widgets(box, "FloatLogSlider")[0], widgets(box, "Image")[0]
    gate.value = 200
    assert image.layout.display == "none" and "ZeroDivisionError" in kept(box)["text/plain"]
    gate.value = 13.8
    assert image.layout.display is None and "image/png" in kept(box)


@pytest.mark.parametrize(
    ("options", "message"), [({"sliders": ("Q",)}, "sliders are"), ({"preset": "rough"}, "preset must be")]
)
def test_what_there_is_no_slider_for_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        explore(answer("EKF"), answer("lost"), **options)


# Animation


def side_by_side(log, count=3):
    told = log.noise.told()
    makers = {
        "fuzzy grid": lambda: FuzzyGrid(told),
        "your EKF": lambda: ekf(log),
        "500 particles": lambda: ParticleFilter(500, told, rng=1),
    }
    return {name: make() for name, make in list(makers.items())[:count]}


@pytest.mark.parametrize("count", [1, 2, 3])
def test_beliefs_are_played_side_by_side(drawn, count):
    log = carried()
    box = play(side_by_side(log, count), log, most=30)
    (figure,) = drawn
    legible(drawn, figure)
    assert {"fuzzy grid", "your EKF", "500 particles"} & set(names(drawn, figure)) == set(side_by_side(log, count))
    assert kept(box)["text/plain"] == "120 steps of a walk on the field"
    slider, image = widgets(box, "IntSlider")[0], widgets(box, "Image")[0]
    frames = [image.value]
    for k in (10, 20, 0):
        slider.value = k
        frames.append(image.value)
    assert frames[0] == frames[-1] and len(set(frames)) == 3
    picture = pixels(base64.b64decode(kept(box)["image/png"]))
    assert np.ptp(picture) == 255 and picture.shape == np.asarray(Image.open(io.BytesIO(image.value))).shape


@pytest.mark.parametrize("most", [150, 60])
def test_the_animation_tells_time_errors_and_the_kidnapping(most):
    """Also when only every second step is shown."""
    log = carried()
    box = play({"your EKF": ekf(log)}, log, most=most)
    slider, words = widgets(box, "IntSlider")[0], []
    for k in range(slider.max + 1):
        slider.value = k
        words.append(next(w.value for w in widgets(box, "HTML") if "error" in w.value))
    assert "0.0 s" in words[0] and "your EKF 0 cm" in words[0]
    assert sum("just kidnapped" in text for text in words) == 1


@pytest.mark.parametrize(
    ("methods", "message"),
    [(UNFILLED, "still to be written"), (BROKEN, "ZeroDivisionError"), (NONSENSE, "not a number")],
)
def test_a_broken_filter_is_not_played(methods, message):
    log = recorded()
    kf = make_filter(broken(**methods), log, x0=log.truth[0], P0=0.01 * np.eye(3), noise=log.noise.told())
    box = play({"fuzzy grid": FuzzyGrid("real"), "your EKF": kf}, log)
    assert message in kept(box)["text/plain"] and "image/png" not in kept(box)
    assert any('role="alert"' in w.value for w in widgets(box, "HTML"))
    assert all(image.layout.display == "none" for image in widgets(box, "Image")) and not widgets(box, "Play")
