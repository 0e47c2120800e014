"""Sliders and animation for labs 1 to 3, and what all labs share of them: the player and the progress bar."""

import html
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeVar

import ipywidgets as w
import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import metrics
from ..canvas import Canvas
from ..checks.feedback import FilterError
from ..history import START, START_COV, make_filter, of_one_run, replay
from ..log import Log, simulate
from ..plots import ConsistencyPanel, ErrorPanel, MapPanel, ScenePanel, limits
from ..robot import HANDOUT_Q, HANDOUT_R, Robot
from ..validation import as_count
from ..world import SENSORS, random_map
from .explorer import Explorer, Kept, Screen, button, sliders

T = TypeVar("T")
_FACTOR = {"value": 1.0, "min": -3, "max": 3, "step": 0.1, "readout_format": ".3g"}
SLIDERS = {
    "Q": (w.FloatLogSlider, {"description": "filter's Q, factor", **_FACTOR}),
    "R": (w.FloatLogSlider, {"description": "filter's R, factor", **_FACTOR}),
    "landmarks": (w.IntSlider, {"description": "landmarks in the map", "min": 0, "max": 60}),
    "range": (w.FloatSlider, {"description": "sensing range [m]", "min": 0.5, "max": 6, "step": 0.1}),
}


def explore(
    KF: type,
    log: Log | None = None,
    sensor: str = "xy",
    sliders: Sequence[str] = ("Q", "R"),
    kind: str = "nees",
    landmarks: int = 25,
    range: float = 2.5,
    seed: int = 1,
    Q: ArrayLike | None = None,
    R: ArrayLike | None = None,
    x0: ArrayLike = START,
    P0: ArrayLike = START_COV,
) -> Screen:
    """Sliders for what the filter is told, over one recorded run with fixed noise.

    KF:      the student's class.  log: a recorded run; without one the handout's robot drives among
             `landmarks` random landmarks and a button draws another run.
    sensor:  'xy' or 'rb', of the handout's robot.
    sliders: any of 'Q', 'R' (factors on the filter's covariances), 'landmarks', 'range'.
    kind:    third panel, 'nees' or 'nis'.
    Q, R:    the covariances (2, 2) at factor 1: the log's or the handout robot's own unless given.
    x0, P0:  the initial estimate (2,) [m] and its covariance (2, 2) [m^2].
    Raises ValueError for a slider that does not fit, or a log that does not know its noise.
    """
    return RunExplorer(KF, log, sensor, sliders, kind, landmarks, range, seed, Q, R, x0, P0).box


class RunExplorer(Explorer):
    """The explorer behind `explore`."""

    RUN = ("landmarks", "range")

    def __init__(self, KF, log, sensor, names, kind, landmarks, range, seed, Q, R, x0, P0):
        self.KF, self.kind, self.initial = KF, kind, {"x0": x0, "P0": P0}
        self.given, self.simulated = log, log is None
        if sensor not in SENSORS:
            raise ValueError(f"sensor must be 'xy' or 'rb', but it is {sensor!r}")
        if not (self.simulated or isinstance(log, Log)):
            raise TypeError(f"log must be a Log, but it is {log!r}")
        self.sensor = sensor if self.simulated else log.sensor
        own = (HANDOUT_Q, HANDOUT_R[self.sensor]) if self.simulated else (log.Q, log.R)
        self.noise = {name: mine if given is None else given for name, mine, given in zip("QR", own, (Q, R))}
        if any(cov is None for cov in self.noise.values()):
            raise ValueError(f"the log '{log.name}' does not know its noise: give Q and R")
        fixed = set() if self.simulated else set(names) & set(self.RUN)
        if fixed:
            raise ValueError(f"a recorded run has its own {min(fixed)}: that slider needs a simulated run")
        self.unmoved = {"Q": 1.0, "R": 1.0, "landmarks": landmarks, "range": range}
        controls = sliders(names, SLIDERS, landmarks=landmarks, range=range)
        self.words = {name: w.HTML() for name in controls if name in "QR"}
        rows = [w.HBox([slider, self.words[n]] if n in self.words else [slider]) for n, slider in controls.items()]
        buttons = [button("Back to factor 1", self._reset, "Q and R as the robot has them")]
        if self.simulated:
            buttons.append(button("Another run (new seed)", self.next_seed, "Draw another map and other noise"))
        super().__init__(controls, seed, buttons, rows)

    @property
    def told(self) -> dict:
        """{name: value}, also of what has no slider."""
        return self.unmoved | super().told

    def _record(self):
        if not self.simulated:
            return self.given
        m = random_map(self.told["landmarks"], rng=self.seed)
        return simulate(Robot((2, -2), **self.noise, range=self.told["range"], type=self.sensor, rng=self.seed), m)

    def _lay_out(self):
        canvas = Canvas(9.2, 3.9, columns=3, width_ratios=[1.15, 1, 1])
        duration = self.log.times[-1] - self.log.times[0]
        box = (-5.6, 5.6, -5.6, 5.6) if self.simulated else limits(self.log)
        self.panels = [MapPanel(canvas.axes[0], box)]
        if self.log.truth is not None:
            self.panels.append(ErrorPanel(canvas.axes[1], duration))
        self.panels.append(ConsistencyPanel(canvas.axes[2], duration, self.kind))
        canvas.move(*self.panels)
        return canvas

    def _caption(self):
        return f"seed {self.seed}" if self.simulated else self.log.name

    def _show(self):
        told = {name: self.told[name] * np.asarray(cov) for name, cov in self.noise.items()}
        for name, words in self.words.items():
            words.value = html.escape(self._in_words(name, told[name]))
        history = replay(make_filter(self.KF, self.log, **told, **self.initial), self.log)
        for panel in self.panels:
            panel.show(self.log, history)
        return metrics.summary(history, self.log)

    def _reset(self):
        for name in self.words:
            self.controls[name].value = 1.0

    def _in_words(self, name, cov):
        """The standard deviations that the filter now believes in, for one step."""
        dt = self.log.dt
        sigma = np.sqrt(np.diag(cov) * (dt if name == "Q" else 1 / dt))
        if name == "R" and self.sensor == "rb":
            return f"σ = {sigma[0]:.3g} m, {np.rad2deg(sigma[1]):.3g}° per landmark"
        return f"σ = {sigma[0]:.3g} m per {'step' if name == 'Q' else 'landmark'}"


def play(run: Any, log: Log, interval: int = 80, most: int = 200) -> Screen:
    """Animate a run: play, pause and a step slider.  `run` is a History, or a filter to be replayed.

    Runs of more than `most` steps show every second, third ... step.  interval: [ms] a frame.
    """
    try:
        history = run if hasattr(run, "x_prior") else replay(run, log)
        of_one_run(history, log)
        history.sound()
    except FilterError as problem:
        return Screen().apologize(problem)
    canvas = Canvas(6.6, 4.6)
    panel = ScenePanel(canvas.axes[0], (-5.1, 5.1, -5.1, 5.1) if log.range else limits(log))
    canvas.move(panel)
    error = None if log.truth is None else metrics.distances(history, log)

    def draw(k):
        panel.show_step(log, history, k)
        far = "" if error is None else f" · error {error[k]:.2f} m"
        seen = f" · {log.count[k - 1]} landmarks in view" if k else ""
        return f"step {k} of {len(log)} · {log.times[k] - log.times[0]:.2f} s{far}{seen}"

    return player(canvas, moments(len(log), most), draw, log, interval)


def moments(steps: int, most: int) -> NDArray[np.int_]:
    """(n,) at most `most` + 1 of the moments 0 ... steps, evenly spaced, with the first and the last among them."""
    chosen = np.arange(0, steps + 1, -(-steps // as_count(most, "most")))
    return chosen if chosen[-1] == steps else np.append(chosen, steps)


def player(canvas: Canvas, steps: Iterable[int], draw: Callable[[int], str], log: Any, interval: int) -> Screen:
    """Play, pause and a slider over these steps of a log; draw(k) fills the canvas and returns the line of text."""
    texts, frames = [], []
    for k in steps:
        texts.append(draw(k))
        frames.append(canvas.jpeg())
    clock = w.Play(min=0, max=len(frames) - 1, interval=interval, show_repeat=False)
    slider = w.IntSlider(0, 0, len(frames) - 1, description="frame", readout=False)
    w.jslink((clock, "value"), (slider, "value"))
    screen, last = Screen([w.HBox([clock, slider])]), canvas.png()
    slider.observe(lambda change: screen.show(frames[change["new"]], texts[change["new"]]), "value")
    screen.show(frames[0], texts[0])
    screen.keep(f"{len(log)} steps of {log.name}", lambda: last)
    screen.film = lambda: [(draw(k), canvas.image())[1] for k in steps]
    return screen


def progress(items: Iterable[T], label: str = "runs") -> Iterator[T]:
    """Iterate over a sequence with a progress bar and the time left."""
    items = list(items)
    bar = w.IntProgress(0, 0, max(len(items), 1), description=label, style={"description_width": "initial"})
    note = w.HTML()
    from IPython.display import display

    display(Kept([w.HBox([bar, note])], f"{label}: {len(items)}"))
    start = time.monotonic()
    for done, item in enumerate(items, 1):
        yield item
        bar.value, used = done, time.monotonic() - start
        left = used / done * (len(items) - done)
        note.value = f"{done} of {len(items)}, {left:.0f} s left" if left else f"{len(items)} in {used:.1f} s"
