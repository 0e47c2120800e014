"""Plots, sliders and animation, without a browser (tests/test_browser.py has one)."""

import base64
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.figure import Figure

from labkit import EnvPlot, Robot, explore, explore_line, make_filter, metrics, play, progress, random_map, simulate
from labkit.canvas import Canvas
from labkit.plots import BLUE, VERMILION, ConsistencyPanel, ErrorPanel, MapPanel, limits, plot_mean_nees, plot_run

from helpers.drawings import kept, pixels, widgets
from helpers.reference import ROOT, Q, R, history, record, solution


@pytest.mark.parametrize("module", ["labkit", "labkit.mrclam", "labkit.metrics", "labkit.checks", "labkit.plots"])
def test_what_computes_does_not_import_what_draws(module):
    heavy = ["ipywidgets"] + ([] if module == "labkit.plots" else ["matplotlib"])
    code = f"import sys, {module}; sys.exit(any(name in sys.modules for name in {heavy}))"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0


def test_a_run_fills_three_panels():
    log = record()
    axes = Figure().subplots(1, 3)
    plot_run(axes, log, history(log), "nis")
    assert all(len(line.get_xdata()) for line in axes[0].lines[:3])
    np.testing.assert_allclose(axes[1].lines[2].get_ydata(), metrics.errors(history(log), log)[:, 0])


def test_the_nis_and_its_bounds_have_gaps_where_nothing_was_seen_for_long():
    """A real robot sees something only in some of its steps: both go on until the next, for two seconds at most."""
    log = record(landmarks=3)
    panel = ConsistencyPanel(Figure().subplots(), 40, "nis").show(log, history(log))
    band = np.array([path.vertices for path in panel.bounds.get_paths()])
    seen = log.times[1:][log.count > 0]
    assert 2 < len(band) == len(seen) < len(log)
    np.testing.assert_allclose(band[:, 0, 0], seen)
    np.testing.assert_allclose((band[:, 1, 0] - band[:, 0, 0])[:-1], np.minimum(np.diff(seen), 2.0))
    line = panel.value.get_ydata()
    assert np.isfinite(line).sum() == len(seen) and 0 < np.isnan(line).sum() == (np.diff(seen) > 2.0).sum()


def test_where_the_truth_was_is_drawn_with_each_ellipse():
    log = record()
    panel = MapPanel(Figure().subplots()).show(log, history(log), ellipses=5)
    np.testing.assert_allclose(np.transpose(panel.then.get_data()), log.truth[::40])


@pytest.mark.parametrize("noise, height", [(1.0, 0.7), (1e-4, 0.01), (0.0025, 0.03)])
def test_errors_are_drawn_as_high_as_they_and_their_bounds_are(noise, height):
    """Up to what is in view; and the stored background follows, so that the axis says so."""
    log = simulate(Robot((2, -2), noise * Q, noise * R["xy"], rng=1), random_map(25, rng=1))
    canvas = Canvas(4, 4)
    panel = ErrorPanel(canvas.axes[0], 40)
    canvas.move(panel)
    panel.show(record(), history(record(), R=100 * R["xy"]))
    before = pixels(canvas.png())
    panel.show(log, history(log, Q=noise * Q, R=noise * R["xy"]))
    assert canvas.axes[0].get_ylim() == pytest.approx((-height, height))
    left = (slice(None), slice(0, 55))  # where the numbers of the axis are
    assert (pixels(canvas.png())[left] != before[left]).any()


def test_the_bounds_of_x_and_y_are_both_seen_where_they_are_the_same():
    log = record()
    panel = ErrorPanel(Figure().subplots(), 40).show(log, history(log))
    (_, of_x), (_, of_y) = panel.lines
    np.testing.assert_allclose(of_x.get_ydata(), of_y.get_ydata())
    assert of_x.get_linewidth() > 3 * of_y.get_linewidth()
    assert not {line.get_color() for line in panel.artists} & {BLUE, VERMILION}  # truth and estimate, beside it


def test_the_mean_nees_of_one_run_is_that_run():
    log = record()
    ax = Figure().subplots()
    plot_mean_nees(ax, log.times, metrics.nees(history(log), log)[None])
    np.testing.assert_allclose(ax.lines[0].get_ydata(), metrics.nees(history(log), log))


def test_the_quick_picture_is_the_slow_picture():
    """Blitting the moving artists over the stored background gives what a full drawing gives."""
    log = record()
    quick, slow = Canvas(4, 4), Canvas(4, 4)
    panel = MapPanel(quick.axes[0], limits(log))
    quick.move(panel)
    panel.show(log, history(log, R=100 * R["xy"]))
    quick.jpeg()
    panel.show(log, history(log))
    MapPanel(slow.axes[0], limits(log)).show(log, history(log))
    assert abs(pixels(quick.png()) - pixels(slow.png())).mean() < 1.0


def test_sliders_change_picture_and_figures():
    box = explore(solution("xy"), sliders=("Q", "R", "landmarks"))
    (image,), sliders = widgets(box, "Image"), widgets(box, "FloatLogSlider")
    before, text = image.value, kept(box)["text/plain"]
    sliders[1].value = 100
    assert image.value != before and kept(box)["text/plain"] != text
    assert "σ = 4 m per landmark" in [w.value for w in widgets(box, "HTML")]
    widgets(box, "Button")[0].click()
    assert kept(box)["text/plain"] == text
    widgets(box, "IntSlider")[0].value = 0
    assert "RMSE" in kept(box)["text/plain"]


def test_two_bells_meet_on_a_line():
    """From the numbers that the lab computes; what the sensor says moves the estimate, and leaves its variance."""
    box = explore_line()
    first = kept(box)
    assert "K = 0.95" in first["text/plain"] and "to 1.90 m" in first["text/plain"] and "0.152" in first["text/plain"]
    assert np.ptp(pixels(base64.b64decode(first["image/png"]))) == 255
    *variances, reading = widgets(box, "FloatSlider")
    reading.value = -3
    moved = kept(box)
    assert "to -2.85 m" in moved["text/plain"] and "from 3 to 0.152 m²" in moved["text/plain"]
    assert moved["image/png"] != first["image/png"]
    for slider in variances:
        assert ((slider.value - slider.min) / slider.step) % 1 == pytest.approx(0, abs=1e-9)  # a browser keeps it
        slider.value = 1.0
    assert "K = 0.50" in kept(box)["text/plain"] and "from 1 to 0.5 m²" in kept(box)["text/plain"]


def test_the_seed_button_gives_another_run_and_the_sliders_do_not():
    box = explore(solution("rb"), sensor="rb", sliders=("R",))
    slider, text = widgets(box, "FloatLogSlider")[0], kept(box)["text/plain"]
    slider.value = 2
    slider.value = 1
    assert kept(box)["text/plain"] == text
    widgets(box, "Button")[1].click()
    assert kept(box)["text/plain"] != text


def test_a_picture_is_kept_for_readers_without_a_kernel():
    log = record()
    for box in (explore(solution("xy")), play(make_filter(solution("xy"), log), log), play(history(log), log)):
        picture = pixels(base64.b64decode(kept(box)["image/png"]))
        assert picture.shape[1] > 600 and np.ptp(picture) == 255


@pytest.mark.parametrize("method", ["predict", "update"])
def test_an_unfilled_filter_shows_its_sentence(method):
    def stub(self, _):
        raise NotImplementedError(f"`{method}` is still to be written.")

    KF, log = type("KF", (solution("xy"),), {method: stub}), record()
    for box in (explore(KF), play(make_filter(KF, log), log)):
        assert "still to be written" in kept(box)["text/plain"] and "image/png" not in kept(box)
        assert any('role="alert"' in w.value for w in widgets(box, "HTML"))
        assert all(image.layout.display == "none" for image in widgets(box, "Image"))


def test_a_filter_that_works_again_gets_its_picture_back():
    KF = type("KF", (solution("xy"),), {"update": lambda self, y: 1 / (1 if self.R[0, 0] < 1 else 0)})
    box = explore(KF, sliders=("R",))
    slider, image = widgets(box, "FloatLogSlider")[0], widgets(box, "Image")[0]
    slider.value = 100
    assert image.layout.display == "none" and "ZeroDivisionError" in kept(box)["text/plain"]
    slider.value = 1
    assert image.layout.display is None and "image/png" in kept(box)


def test_sliders_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match="sliders are"):
        explore(solution("xy"), sliders=("P",))
    with pytest.raises(ValueError, match="recorded run has its own range"):
        explore(solution("xy"), record(), sliders=("range",))


def test_play_steps_through_the_run():
    log = record()
    box = play(history(log), log)
    slider, image = widgets(box, "IntSlider")[0], widgets(box, "Image")[0]
    first = image.value
    slider.value = 80
    assert image.value != first
    assert any("step 80 of 160 · 20.00 s" in w.value for w in widgets(box, "HTML"))
    long = play(history(log), log, most=50)
    assert widgets(long, "IntSlider")[0].max < 50


def test_progress_gives_everything_once(capsys):
    assert list(progress(range(5), "runs")) == [0, 1, 2, 3, 4]
    assert list(progress([], "none")) == []


def test_the_handouts_loop_runs_headless(tmp_path):
    m, r = random_map(25, rng=1), Robot((2, -2), Q, R["rb"], type="rb", rng=1)
    kf, e = solution("rb")((0, 0), 3 * np.eye(2), Q, R["rb"], m), EnvPlot()
    e.plotSim(r, m, kf, pause=True)
    for _ in range(5):
        kf.predict(r.action())
        kf.update(r.measure(m))
        e.plotSim(r, m, kf)
    assert e.panel.robot.get_xdata()[0] == r.p[0] and len(e.panel.seen.get_xdata()) == len(r.objs)
    e.figure.savefig(tmp_path / "step.png")
    assert np.ptp(pixels((tmp_path / "step.png").read_bytes())) == 255
