"""Plots, sliders and animation, without a browser (tests/test_browser.py has one)."""

import base64
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.figure import Figure

from labkit import EnvPlot, Robot, explore, make_filter, metrics, play, progress, random_map
from labkit.canvas import Canvas
from labkit.plots import ConsistencyPanel, MapPanel, limits, plot_mean_nees, plot_run

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
    np.testing.assert_allclose(axes[1].lines[1].get_ydata(), metrics.errors(history(log), log)[:, 0])


def test_bounds_are_drawn_where_something_was_seen_only_now_and_then():
    """At ten steps a second most steps of a real log see nothing; the bounds are still lines."""
    log = record(landmarks=3)
    panel = ConsistencyPanel(Figure().subplots(), 40, "nis").show(log, history(log))
    assert 2 < len(panel.low.get_xdata()) == (log.count > 0).sum()
    assert np.isfinite(panel.low.get_ydata()).all()


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
