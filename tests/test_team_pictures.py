"""Pictures, sliders and animation of the team: drawn without warnings, and with nothing cut off."""

import base64
from dataclasses import replace
from functools import cache

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

import test_legged_pictures
from browser import answers, cells
from labkit.canvas import Canvas
from labkit.team import Route, Team, TeamNoise, dead_reckoned, explore, frame_errors, laid, play, replay
from labkit.team import scenarios
from labkit.team import widgets as kit
from labkit.team.formation import WAY, run, triangle
from labkit.team.plots import FormationPanel, arrow, draw_errors, draw_formation, draw_paths, draw_readings
from team_answers import answer, started
from test_legged_pictures import legible, names, shown
from test_pictures import kept, pixels, widgets

pytestmark = pytest.mark.filterwarnings("error")
drawn = test_legged_pictures.drawn  # the fixture

LAB = "05_observers"
EXACT = TeamNoise(*[0.0] * 9)
POSES = [(0, 0, np.pi), (-4.5, -4.0, 0.7), (4.5, -4.0, 2.4)]


def short(rng=1, noise=None, **_):
    """Forty steps: robots 0 and 2 drive, robots 1 and 2 watch robot 0."""
    team = Team(POSES, noise, sees=[(1, 0), (2, 0)], rng=rng)
    return team.record(Route({0: [(-3.5, 0)], 2: [(4.5, 0)]}), 40, "a short run")


@pytest.fixture
def brief(monkeypatch):
    """Sliders over short runs."""
    for name in kit.RUNS:
        monkeypatch.setitem(kit.RUNS, name, short)


@cache
def formation(steps=900, perfect=False):
    team = triangle(rng=1)
    x0 = team.poses + [[0, 0, 0], [0.1, -0.1, 0.02], [-0.1, 0.1, 0.01]]
    kf = answer("GroupEKF")(x0, np.diag(3 * [1e-12] + 6 * [0.01]), TeamNoise(), inflate=10.0)
    return run(team, None if perfect else kf, answer("force"), WAY, steps)


def data(ax):
    """{label: points} of the lines that have a label."""
    return {line.get_label(): line.get_xydata() for line in ax.lines if line.get_label()[0] != "_"}


# Figures


def test_paths_are_the_logs(drawn):
    log = short()
    believed = dead_reckoned(log)
    ax = plt.figure(layout="constrained").subplots()
    draw_paths(ax, log.truth, believed, "a title", what="odometry", true="with a map")
    ax.legend()
    told = names(drawn, shown(drawn))
    lines = data(ax)
    assert set(lines) == {"with a map", *(f"odometry, robot {i}" for i in range(3))} and set(lines) < set(
        told
    )
    assert "a title" in told
    np.testing.assert_array_equal(lines["with a map"], log.truth[:, 0, :2])
    for i in range(3):
        np.testing.assert_array_equal(lines[f"odometry, robot {i}"], believed[:, i, :2])
    everything = [line.get_xydata() for line in ax.lines]
    for poses in (log.truth, believed):
        for i in range(3):
            for due in (poses[:, i, :2], arrow(poses[-1, i])):
                assert any(np.array_equal(due, one) for one in everything)


def test_an_arrow_points_where_the_robot_looks():
    tip = arrow(np.array([1.0, 2.0, np.pi / 2]), 0.5)[0]
    np.testing.assert_allclose(tip, [1.0, 2.5])


def test_exact_readings_lie_on_the_robot_that_was_seen():
    log = short(noise=EXACT)
    ax = Figure().subplots()
    draw_readings(ax, log, log.truth)
    due = [log.truth[k, j, :2] for k, seen in enumerate(log.seen(), 1) for _, j, _ in seen]
    assert len(due) > 40
    np.testing.assert_allclose(data(ax)["readings"], due, atol=1e-9)


def test_errors_are_drawn_in_centimetres(drawn):
    log = short()
    errors = frame_errors(dead_reckoned(log), log.truth)
    ax = plt.figure(layout="constrained").subplots()
    draw_errors(ax, log.times, {"gauge": errors.gauge, "ego, at first": errors.ego[:20]}, limit=60)
    assert {"gauge", "ego, at first", "error [cm]"} <= set(names(drawn, shown(drawn)))
    np.testing.assert_allclose(data(ax)["gauge"], np.column_stack([log.times, 100 * errors.gauge]))
    np.testing.assert_allclose(data(ax)["ego, at first"][:, 1], 100 * errors.ego[:20])
    assert ax.get_ylim() == (0, 60) and ax.get_xlim() == (0, log.times[-1])


def test_a_formation_is_drawn_with_its_triangles():
    made = formation(60)
    ax = Figure().subplots()
    draw_formation(ax, made, [0, 30, 10_000], "a triangle")
    lines = data(ax)
    assert list(lines) == ["leader", "follower 1", "follower 2"] and ax.get_title() == "a triangle"
    for i, points in enumerate(lines.values()):
        np.testing.assert_array_equal(points, made.log.truth[:, i, :2])
    corners = [line.get_xydata() for line in ax.lines if line.get_linestyle() == ":"]
    np.testing.assert_array_equal(corners, made.log.truth[[0, 30, -1]][:, [0, 1, 2, 0], :2])


@cache
def notebook():
    """What the notebook's figures build upon: its setup, its answers, and how its filters start."""
    given = {"log": scenarios.cross(rng=1)}
    for source in (cells(LAB, "solutions")["setup"], *answers(LAB).values(), cell("figure 3:")):
        exec(source, given)
    plt.close("all")
    return given


def cell(words):
    sources = cells(LAB, "solutions").values()
    return next(source for source in sources if words in source and "plt.subplots" in source)


@pytest.mark.filterwarnings("ignore::labkit.team.FrameWarning")
@pytest.mark.parametrize(
    ("words", "panels"),
    [
        ("scenarios.cross(rng=1)\nfig, ax", 1),
        ("figure 3:", 2),
        ("c: what the observers reported", 3),
        ("figure 5:", 2),
        ("figure 6:", 2),
        ("figure 7:", 2),
        ("figure 8:", 2),
        ("time per step [ms]", 1),
    ],
    ids=["hall", *(f"figure {i}" for i in range(3, 9)), "cost"],
)
def test_the_figures_of_the_notebook_are_legible(drawn, words, panels):
    exec(cell(words), dict(notebook()))
    figure = shown(drawn)
    assert len(figure.axes) == panels and all(ax.lines and ax.get_xlabel() for ax in figure.axes)
    for ax in figure.axes:
        inside = [
            ax.bbox.contains(*point)
            for line in ax.lines
            for point in ax.transData.transform(line.get_xydata())
        ]
        assert np.mean(inside) > 0.9  # no panel shows another place than that where things are


# Sliders


@pytest.mark.parametrize("scenario", ["cross", "rectangle", "moving"])
def test_the_picture_under_the_sliders_is_legible(drawn, scenario):
    made = kit._Explorer(started, scenario, ("gate", "inflate"), 1)
    legible(drawn, made.canvas.figure)
    robots = {f"robot {i}" for i in range(made.log.n)}
    assert {"truth", "gauge", "aligned", "ego"} | robots <= set(names(drawn, made.canvas.figure))


def test_what_the_picture_says_is_what_the_filter_did(brief):
    made = kit._Explorer(started, "moving", ("gate", "inflate"), 1)
    log = short()
    x, _ = replay(started(log, 1, gate=13.8, inflate=4.0), log)
    errors = frame_errors(x, log.truth)
    for name, line in made.errors.items():
        np.testing.assert_allclose(line.get_ydata(), (100 * getattr(errors, name)).clip(0.2, 500))
    far = np.linalg.norm(made.lines[0].get_xydata() - log.truth[:, 0, :2], axis=1)
    np.testing.assert_allclose(far, errors.aligned)
    truth = made.truth.get_xydata()
    np.testing.assert_array_equal(truth[: len(log) + 1], log.truth[:, 0, :2])
    assert np.isnan(truth).all(axis=1).sum() == log.n  # the pen is lifted from robot to robot
    assert f"ego {100 * errors.ego.mean():.1f} cm" in made.box._text


def test_sliders_change_picture_and_figures(brief):
    box = explore(started, "rectangle")
    (image,), gate, inflate = widgets(box, "Image"), *widgets(box, "FloatLogSlider")
    seen = [(image.value, kept(box)["text/plain"])]
    for slider, value in ((gate, 1.0), (gate, 13.8), (inflate, 500.0), (inflate, 4.0)):
        slider.value = value
        seen.append((image.value, kept(box)["text/plain"]))
        assert kept(box)["text/plain"] in [w.value[5:-6] for w in widgets(box, "HTML")]
    (picture, words), *rest = seen
    assert rest[1] == rest[3] == (picture, words) and "mean error: aligned" in words
    assert all(rest[i][0] != picture and rest[i][1] != words for i in (0, 2))
    still = pixels(base64.b64decode(kept(box)["image/png"]))
    assert still.shape[1] > 600 and np.ptp(still) == 255


def test_the_seed_button_gives_another_run(brief):
    box = explore(started, "cross", sliders=("gate",))
    before, (image,) = kept(box)["text/plain"], widgets(box, "Image")
    picture = image.value
    widgets(box, "Button")[0].click()
    assert kept(box)["text/plain"] != before and image.value != picture
    assert len(widgets(box, "FloatLogSlider")) == 1
    assert any(w.value == "a short run, seed 2" for w in widgets(box, "HTML"))


def test_all_controls_can_be_reached_by_keyboard(brief):
    """They are of the kinds that tests/test_browser.py moves with the arrow keys, and say what they are."""
    for box, kinds in (
        (explore(started), ["FloatLogSlider", "FloatLogSlider", "Button"]),
        (play(formation(60)), ["Play", "IntSlider"]),
    ):
        plain = {"Kept", "HBox", "Image", "HTML"}
        controls = [w for kind in dict.fromkeys(kinds) for w in widgets(box, kind)]
        assert [type(w).__name__ for w in controls] == kinds and not any(w.disabled for w in controls)
        assert all(w.description for w in controls if type(w).__name__ != "Play")
        assert {type(w).__name__ for w in everything(box)} == plain | set(kinds)


def everything(box):
    return [box, *(w for child in getattr(box, "children", ()) for w in everything(child))]


def starting(**methods):
    """`started` for the solution's filter with other methods."""
    KF = type("KF", (answer("GroupEKF"),), methods)

    def start(log, seed, **told):
        kf = started(log, seed, **told)
        kf.__class__ = KF
        return kf

    return start


def unfilled(*_):
    raise NotImplementedError("`update` is still to be written.")


@pytest.mark.parametrize(
    ("start", "message"),
    [
        (starting(update=unfilled), "still to be written"),
        (starting(predict=lambda self, u: 1 / 0), "ZeroDivisionError"),
        (starting(predict=lambda self, u: setattr(self, "x", self.x * np.nan)), "not a number"),
        (starting(update=lambda self, seen: setattr(self, "x", self.x[0])), "they should be (3, 3)"),
        (lambda log, seed: None, "could not be made"),
    ],
)
def test_what_breaks_shows_its_sentence(brief, start, message):
    box = explore(start)
    assert message in kept(box)["text/plain"] and "image/png" not in kept(box)
    assert any('role="alert"' in w.value for w in widgets(box, "HTML"))
    assert all(image.layout.display == "none" for image in widgets(box, "Image"))


def test_what_works_again_gets_its_picture_back(brief):
    good = answer("GroupEKF").update
    box = explore(starting(update=lambda self, seen: good(self, seen) if self.gate < 100 else 1 / 0))
    gate, image = widgets(box, "FloatLogSlider")[0], widgets(box, "Image")[0]
    gate.value = 200
    assert image.layout.display == "none" and "ZeroDivisionError" in kept(box)["text/plain"]
    gate.value = 13.8
    assert image.layout.display is None and "image/png" in kept(box)


@pytest.mark.parametrize(
    ("options", "message"),
    [({"sliders": ("Q",)}, "sliders are"), ({"scenario": "square"}, "scenario must be")],
)
def test_what_there_is_no_slider_for_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        explore(started, **options)


# Animation


def panel(made):
    canvas = Canvas(6.2, 5.0)
    one = FormationPanel(canvas.axes[0], made)
    canvas.move(one)
    canvas.jpeg()
    return one


def test_the_slots_are_those_that_the_distances_are_told_from():
    """Also in the corners, where the formation's heading lags behind the leader's."""
    made = formation(perfect=True)
    one, off = panel(made), []
    for k, truth in enumerate(made.log.truth):
        one.show(made, k)
        off.append(np.linalg.norm(one.slots.get_xydata() - truth[1:, :2], axis=1))
    np.testing.assert_allclose(off, made.errors, atol=1e-9)
    assert len(one.ellipses.get_xdata()) == 0  # who knows the true poses has no covariance


def test_a_moment_shows_robots_beliefs_and_ellipses():
    made = formation(60)
    one = panel(made).show(made, 50, made.covariances[50])
    for i in range(3):
        np.testing.assert_array_equal(one.trails[i].get_xydata(), made.log.truth[:51, i, :2])
        np.testing.assert_array_equal(one.robots[i].get_xydata(), arrow(made.log.truth[50, i], 0.3))
    np.testing.assert_allclose(one.believed.get_xydata(), made.log.truth[50, :, :2], atol=0.1)
    outlines = one.ellipses.get_xydata().reshape(3, -1, 2)[:, :-1]
    for i, outline in enumerate(outlines):
        middle, P = one.believed.get_xydata()[i], made.covariances[50][3 * i : 3 * i + 2, 3 * i : 3 * i + 2]
        assert np.linalg.norm(outline - middle, axis=1).max() == pytest.approx(
            3 * np.sqrt(np.linalg.eigvalsh(P)[-1]), rel=0.02
        )


def test_a_turn_of_the_common_frame_does_not_change_the_picture():
    made, angle = formation(60), 2.0
    turn = np.kron(np.eye(3), [[np.cos(2), -np.sin(2), 0], [np.sin(2), np.cos(2), 0], [0, 0, 1]])
    other = replace(
        made,
        believed=laid(made.believed, angle, np.array([3.0, -1.0])),
        covariances=turn @ made.covariances @ turn.T,
    )
    before, after = (panel(made).show(one, 50, one.covariances[50]) for one in (made, other))
    assert len(before.artists) == 9
    for a, b in zip(before.artists, after.artists):
        np.testing.assert_allclose(a.get_xydata(), b.get_xydata(), atol=1e-9)


def test_nothing_that_moves_gets_under_the_legend_or_out_of_the_picture():
    made = formation()
    one = panel(made)
    ax = one.believed.axes
    legend = ax.get_legend().get_window_extent()
    for k in range(0, len(made.log) + 1, 3):
        one.show(made, k, made.covariances[k])
        points = np.concatenate([artist.get_xydata() for artist in one.artists])
        points = ax.transData.transform(points[np.isfinite(points).all(axis=1)])
        assert not legend.count_contains(points) and ax.bbox.count_contains(points) == len(points)


def test_a_formation_is_played(drawn):
    box = play(formation(60), most=30)
    (figure,) = drawn
    legible(drawn, figure)
    assert {"slots", "3σ ellipse", "believed position"} <= set(names(drawn, figure))
    assert kept(box)["text/plain"] == "60 steps of a triangle"
    slider, image = widgets(box, "IntSlider")[0], widgets(box, "Image")[0]
    frames, words = [], []
    for k in (*range(slider.max + 1), 0):
        slider.value = k
        frames.append(image.value)
        words.append(next(w.value for w in widgets(box, "HTML") if "slot" in w.value))
    assert slider.max == 30 and frames[0] == frames[-1] and len(set(frames)) == 31
    assert (
        "0.0 s" in words[0]
        and "12.0 s" in words[-2]
        and f"{100 * formation(60).error[-1]:.0f} cm" in words[-2]
    )
    still = pixels(base64.b64decode(kept(box)["image/png"]))
    assert np.ptp(still) == 255 and abs(still - pixels(frames[-2])).mean() < 2  # the last moment


@pytest.mark.parametrize("most", [7, 25, 60, 500])
def test_the_animation_goes_to_the_end(most):
    slider = widgets(play(formation(60), most=most), "IntSlider")[0]
    stride = -(-60 // most)
    assert slider.max <= most and 60 - stride < slider.max * stride <= 60


def test_a_formation_that_knows_the_truth_is_played():
    assert "image/png" in kept(play(formation(20, perfect=True)))
