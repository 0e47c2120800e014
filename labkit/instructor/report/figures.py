"""The picture on a feedback page, drawn from numbers that a student's code left behind.

Whatever the numbers are, a picture comes back or None does: nothing raises, and nothing takes long.
"""

import re
import warnings
from collections.abc import Mapping
from io import BytesIO
from typing import Any

import numpy as np

from ...canvas import Canvas
from ...geometry import root
from ...history import History
from ...log import Log
from ...plots import BLUE, ORANGE, ErrorPanel, MapPanel, limits
from ...world import Landmark, Map

ACCEPTED, DRAWN, LANDMARKS = 1_000_000, 400, 300  # [numbers] accepted; [points] drawn in a line; [landmarks]
WORLD, FAR = 1e5, 1e4  # [m] how large a course's world may be; how far off the picture a line may go on
SIZE, DPI = (7.4, 3.6), 150  # inches; sharp on a screen with two pixels to the point
HEAVIEST = 40_000  # [bytes] of a file
COLORS = 64  # flat colours and their soft edges need no more, and a palette makes the file small


class Drawer:
    """Draws one picture after the other on the same canvas; only the student's lines are drawn anew.

    One canvas is kept for each kind of picture, as all students of a lab share its axes.
    Not for two threads at once.
    """

    def __init__(self) -> None:
        self._kept: dict[str, tuple] = {}

    def png(self, figure: Mapping[str, Any]) -> bytes | None:
        """The picture of `Result.figure` as PNG bytes, or None if its arrays show nothing.

        figure: {'times' (N+1,), 'x' (N+1, n), 'P' (N+1, n, n), 'truth' (N+1, 2 or more), 'landmarks' (m, 2)},
        a filter's run, or {'x' (n,), 'values' (n,), 'bounds' (2,), 'label', and perhaps 'xlabel'}, a curve.
        """
        kind = "run" if "P" in figure else "curve"
        try:
            with np.errstate(all="ignore"), warnings.catch_warnings(action="ignore"):
                key, fill = (_run if kind == "run" else _curve)(figure)
                if kind not in self._kept or self._kept[kind][0] != key:
                    self._kept[kind] = key, *(_run_canvas if kind == "run" else _curve_canvas)(*key)
                fill(self._kept[kind][2])
                return _encoded(self._kept[kind][1])
        except Exception:  # the numbers are a student's, and one picture must not stop a class
            self._kept.pop(kind, None)
            return None


def _run(figure):
    """(what the axes depend on, what fills them) for a filter's run."""
    times, x, P = _numbers(figure, "times", 1), _numbers(figure, "x", 2), _numbers(figure, "P", 3)
    truth, marks = _numbers(figure, "truth", 2), _numbers(figure, "landmarks", 2)
    n = len(times)
    x, P, truth = x[:, :2], P[:, :2, :2], truth[:, :2]
    if not (x.shape == truth.shape == (n, 2) and P.shape == (n, 2, 2) and marks.shape[1] == 2):
        raise ValueError("the arrays do not fit together")
    _need(np.isfinite(times).all() and np.isfinite(x).all(axis=1).any())
    known = truth[np.isfinite(truth).all(axis=1)]
    _need(len(known) > 1 and abs(known).max() < WORLD)
    low, high = known.min(axis=0), known.max(axis=0)
    reach = max(10.0, 2 * (high - low).max())
    near = ((marks > low - reach) & (marks < high + reach)).all(axis=1)  # also leaves NaN out

    every = np.unique(np.linspace(0, n - 1, DRAWN).astype(int))
    times, x, P, truth = times[every], x[every], P[every], truth[every]
    x = np.clip(x, low - FAR, high + FAR)
    bad = ~np.isfinite(P).all(axis=(1, 2))
    P = np.clip(np.where(bad[:, None, None], 0, P), -(FAR**2), FAR**2)  # no ellipse where there is no number
    P = root(P) @ root(P).swapaxes(1, 2)  # what is no covariance is drawn as the nearest one
    x[~np.isfinite(x).all(axis=1)] = np.nan

    world = Map(Landmark(p, i) for i, p in enumerate(marks[near][:LANDMARKS]))
    steps, nothing = len(times) - 1, np.empty(0, dtype=int)
    log = Log(times, np.zeros((steps, 2)), nothing, nothing, np.empty((0, 2)), world, truth=truth)
    history = History(times, x, P, x[1:], P[1:], None)
    key = (tuple(np.round(limits(log), 3)), float(times[-1] - times[0]))
    return key, lambda panels: [panel.show(log, history) for panel in panels]


def _run_canvas(box, duration):
    canvas = _canvas(columns=2, width_ratios=[1, 1])
    panels = MapPanel(canvas.axes[0], box), ErrorPanel(canvas.axes[1], duration)
    canvas.move(*panels)
    return canvas, panels


def _curve(figure):
    """(what the axes depend on, what fills them) for a consistency curve."""
    x, values, bounds = _numbers(figure, "x", 1), _numbers(figure, "values", 1), _numbers(figure, "bounds", 1)
    _need(x.shape == values.shape and bounds.shape == (2,))
    _need(np.isfinite(x).all() and abs(x).max() < 1e9 and np.ptp(x) > 0 and np.isfinite(values).any())
    low, high = map(float, bounds)
    _need(1e-6 < low < high < 1e6)
    every = np.unique(np.linspace(0, len(x) - 1, DRAWN).astype(int))
    bottom, top = (float(10.0**e) for e in (np.floor(np.log10(low)) - 2, np.ceil(np.log10(high)) + 2))
    xscale = "log" if x.min() > 0 and x.max() / x.min() > 30 else "linear"
    line = x[every], np.clip(values[every], bottom / 10, top * 10)
    texts = _label(figure.get("label")), _label(figure.get("xlabel"))
    key = (float(x.min()), float(x.max()), xscale, low, high, bottom, top, *texts)
    return key, lambda panel: panel.set_data(*line)


def _curve_canvas(left, right, xscale, low, high, bottom, top, label, xlabel):
    canvas = _canvas(columns=1)
    ax = canvas.axes[0]
    ax.set(xscale=xscale, yscale="log", xlim=(left, right), ylim=(bottom, top))
    ax.set_xlabel(xlabel, parse_math=False)
    ax.set_ylabel(label, parse_math=False)
    ax.axhspan(low, high, color=ORANGE, alpha=0.25, lw=0, label="where a consistent filter lies")
    (curve,) = ax.plot([], [], "-", color=BLUE, marker=".", ms=4, lw=1.2, label="yours", animated=True)
    ax.legend(loc="upper left", fontsize=8, frameon=False)
    canvas.moving.append(curve)
    return canvas, curve


def _canvas(columns, **options):
    canvas = Canvas(*SIZE, columns, **options)
    canvas.figure.set_dpi(DPI)
    return canvas


def _encoded(canvas):
    image = canvas.image()
    while True:
        buffer = BytesIO()
        image.quantize(COLORS, method=2).save(buffer, "PNG")
        if buffer.tell() <= HEAVIEST or image.width < 300:
            return buffer.getvalue()
        image = image.reduce(2)  # a filter that jumps about fills the picture: coarse, not heavy


def _numbers(figure, name, ndim):
    """A copy of an array as floats; ValueError or KeyError if it is none."""
    array = np.array(figure[name], dtype=float)
    _need(array.ndim == ndim and 0 < array.size <= ACCEPTED or name == "landmarks" and array.size == 0)
    return array if array.size else np.empty((0, 2))


def _label(value):
    return re.sub(r"[^ -~°²³σχ·]", "", str(value or "")[:200])[:60]


def _need(condition):
    if not condition:
        raise ValueError("these numbers cannot be drawn")
