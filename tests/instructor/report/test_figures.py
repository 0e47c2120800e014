"""The picture on a feedback page: whatever a student's numbers are, it is drawn lightly or not at all."""

import numpy as np
import pytest

from labkit.instructor.report import figures
from labkit.instructor.report.figures import HEAVIEST, Drawer

from helpers.graded import curve


@pytest.fixture(scope="module")
def drawer():
    return Drawer()


@pytest.fixture
def coarse(monkeypatch):
    """A drawer of pictures with a tenth of the pixels."""
    monkeypatch.setattr(figures, "DPI", figures.DPI / 3)
    return Drawer()


@pytest.fixture(scope="module")
def run():
    """A filter's run of 161 steps round a square, past 25 landmarks."""
    rng, corners = np.random.default_rng(2), np.array([(2, -2), (2, 2), (-2, 2), (-2, -2), (2, -2)])
    truth = np.stack([np.interp(np.linspace(0, 4, 161), range(5), corners[:, i]) for i in (0, 1)], axis=1)
    heading = np.zeros((161, 1))
    return {
        "times": np.linspace(0, 40, 161),
        "x": np.hstack([truth + rng.normal(0, 0.1, truth.shape), heading]),
        "P": np.tile(0.01 * np.eye(3), (161, 1, 1)),
        "truth": np.hstack([truth, heading]),
        "landmarks": rng.uniform(-4, 4, (25, 2)),
    }


def test_all_students_of_a_lab_share_a_canvas(run, monkeypatch):
    drawer, made = Drawer(), []
    monkeypatch.setattr(figures, "Canvas", lambda *args, _new=figures.Canvas, **kw: made.append(1) or _new(*args, **kw))
    for figure in (run, curve(), {**run, "x": run["x"] + 0.5}, curve()):
        image = drawer.png(figure)
        assert image.startswith(b"\x89PNG") and len(image) <= HEAVIEST
    assert len(made) == 2


def test_one_students_picture_leaves_nothing_on_the_next(run):
    drawer, other = Drawer(), {**run, "x": run["x"] + 0.5}
    first, between, again = drawer.png(run), drawer.png(other), drawer.png(run)
    assert first == again != between
    assert drawer.png({**run, "P": np.full_like(run["P"], np.nan)}) != first and drawer.png(run) == first


@pytest.mark.parametrize("value", [np.nan, np.inf, -1e300, 1e-300, 0.0])
@pytest.mark.parametrize("name", ["times", "x", "P", "truth", "landmarks", "values", "bounds"])
def test_no_number_stops_the_drawing(name, value, coarse, run):
    for figure in (run, curve()):
        if name not in figure:
            continue
        for where in (slice(None), slice(None, None, 2)):
            array = np.array(figure[name], dtype=float)
            array[where] = value
            image = coarse.png({**figure, name: array})
            assert image is None or image.startswith(b"\x89PNG")


@pytest.mark.parametrize(
    "value",
    [
        None,
        "text",
        [],
        [[]],
        3.0,
        np.zeros((0, 2)),
        np.zeros((2, 0)),
        np.zeros((3, 3, 3, 3)),
        np.array([object()]),
        [[1], [1, 2]],
        {},
        np.zeros(2_000_000),
        np.array([1j]),
        np.zeros((161, 1)),
    ],
    ids=lambda value: str(np.shape(value) if isinstance(value, np.ndarray) else value),
)
def test_what_is_no_such_array_draws_nothing(value, drawer, run):
    for figure in (run, curve()):
        for name in figure:
            empty = name == "landmarks" and isinstance(value, (list, np.ndarray)) and str(value) in ("[]", "[[]]")
            if name not in ("label", "xlabel") and not empty:  # a map may have no landmark
                assert drawer.png({**figure, name: value}) is None, name


def test_a_picture_needs_all_of_its_arrays(drawer, run):
    for name in run:
        assert drawer.png({key: value for key, value in run.items() if key != name}) is None
    assert drawer.png({}) is None


def test_a_wild_filter_is_drawn_lightly(drawer, run):
    rng, n = np.random.default_rng(0), 5000
    t = np.linspace(0, 40, n)
    wild = {
        "times": t,
        "x": rng.uniform(-5, 5, (n, 2)),
        "P": np.eye(2) * rng.uniform(0, 2, (n, 1, 1)),
        "truth": np.stack([np.interp(t, run["times"], run["truth"][:, i]) for i in (0, 1)], axis=1),
        "landmarks": rng.uniform(-5, 5, (1000, 2)),
    }
    assert len(drawer.png(wild)) <= HEAVIEST


@pytest.mark.parametrize(
    "label", [r"$\frac{1}{$", "a" * 10**6, "\x00\ud800", "小明", None, 3, ["x"]], ids=lambda label: repr(label)[:9]
)
def test_labels_cannot_misbehave(label, coarse):
    assert coarse.png({**curve(), "label": label, "xlabel": label})
