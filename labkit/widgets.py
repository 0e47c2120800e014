"""Sliders and animation over a recorded run: the noise stays, only the student's filter runs again."""

import html
import time
from base64 import b64encode

import ipywidgets as w
import numpy as np

from . import metrics
from .canvas import Canvas
from .checks.feedback import FilterError
from .log import START, START_COV, make_filter, replay, simulate
from .plots import ConsistencyPanel, ErrorPanel, MapPanel, ScenePanel, limits
from .robot import HANDOUT_Q, HANDOUT_R, Robot
from .world import random_map


class Kept(w.VBox):
    """Widgets in a column, with a picture and a sentence for readers without a running kernel."""

    def __init__(self, children, picture=None, text=""):
        super().__init__(children, layout=w.Layout(max_width="940px"))
        self._picture, self._text = picture, text

    def _repr_mimebundle_(self, **kwargs):
        bundle = super()._repr_mimebundle_(**kwargs)
        bundle["text/plain"] = self._text
        if self._picture:
            bundle["image/png"] = b64encode(self._picture()).decode()
        return bundle


class Screen:
    """A picture, or the sentence that says why there is none."""

    def __init__(self):
        # align_self: a column would stretch the picture to its width.  margin: the 2 px around every
        # widget would come on top of the 100 % and call for a scroll bar.
        layout = w.Layout(max_width="100%", align_self="flex-start", margin="0")
        self.image = w.Image(format="jpeg", layout=layout)
        self.text = w.HTML()

    def show(self, jpeg, text):
        self.image.value, self.image.layout.display = jpeg, None
        self.text.value = f"<div>{html.escape(text)}</div>"

    def apologize(self, sentence):
        self.image.layout.display = "none"
        self.text.value = (
            '<div role="alert" style="white-space:pre-wrap;border-left:4px solid #D55E00;padding:6px 12px">'
            f"<b>No picture yet.</b> {html.escape(sentence)}</div>"
        )


def explore(
    KF,
    log=None,
    sensor="xy",
    sliders=("Q", "R"),
    kind="nees",
    landmarks=25,
    range=2.5,
    seed=1,
    Q=None,
    R=None,
    x0=START,
    P0=START_COV,
):
    """Sliders for what the filter is told, over one recorded run with fixed noise.

    KF:      the student's class.  log: a recorded run; without one the handout's robot drives among
             `landmarks` random landmarks and a button draws another run.
    sensor:  'xy' or 'rb', of the handout's robot.
    sliders: any of 'Q', 'R' (factors on the filter's covariances), 'landmarks', 'range'.
    kind:    third panel, 'nees' or 'nis'.
    Q, R:    the covariances at factor 1: the log's or the handout robot's own unless given.
    """
    return Explorer(KF, log, sensor, sliders, kind, landmarks, range, seed, Q, R, x0, P0).box


class Explorer:
    """The state behind `explore`: a log, the sliders' values, and `box`, the widget to show."""

    def __init__(self, KF, log, sensor, sliders, kind, landmarks, range, seed, Q, R, x0, P0):
        self.KF, self.start = KF, {"x0": x0, "P0": P0}
        self.seed, self.simulated = seed, log is None
        self.sensor = sensor if self.simulated else log.sensor
        own = (HANDOUT_Q, HANDOUT_R[self.sensor]) if self.simulated else (log.Q, log.R)
        self.Q, self.R = (mine if given is None else given for mine, given in zip(own, (Q, R)))
        if self.Q is None or self.R is None:
            raise ValueError(f"the log '{log.name}' does not know its noise: give Q and R")
        self.values = {"Q": 1.0, "R": 1.0, "landmarks": landmarks, "range": range}
        self.log = log if log is not None else self._record()
        self._sliders = {name: self._slider(name) for name in sliders}
        self._build(kind)
        self._refresh()

    def _record(self):
        m = random_map(self.values["landmarks"], rng=self.seed)
        robot = Robot((2, -2), self.Q, self.R, self.values["range"], self.sensor, rng=self.seed)
        return simulate(robot, m)

    def _slider(self, name):
        if name in ("landmarks", "range") and not self.simulated:
            raise ValueError(f"a recorded run has its own {name}: that slider needs a simulated run")
        options = {"style": {"description_width": "150px"}, "layout": w.Layout(width="430px")}
        if name in ("Q", "R"):
            slider = w.FloatLogSlider(
                1.0, min=-3, max=3, step=0.1, readout_format=".3g", description=f"filter's {name}, factor", **options
            )
        elif name == "landmarks":
            slider = w.IntSlider(self.values[name], 0, 60, description="landmarks in the map", **options)
        elif name == "range":
            slider = w.FloatSlider(
                self.values[name], min=0.5, max=6, step=0.1, description="sensing range [m]", **options
            )
        else:
            raise ValueError(f"sliders are 'Q', 'R', 'landmarks' and 'range', not {name!r}")
        slider.observe(lambda change: self._changed(name, change["new"]), "value")
        return slider

    def _build(self, kind):
        self.screen, self.notes = Screen(), {n: w.HTML() for n in self._sliders if n in "QR"}
        self.canvas = Canvas(9.2, 3.9, columns=3, width_ratios=[1.15, 1, 1])
        duration = self.log.times[-1] - self.log.times[0]
        box = (-5.6, 5.6, -5.6, 5.6) if self.simulated else limits(self.log)
        self.panels = [MapPanel(self.canvas.axes[0], box)]
        if self.log.truth is not None:
            self.panels.append(ErrorPanel(self.canvas.axes[1], duration))
        self.panels.append(ConsistencyPanel(self.canvas.axes[2], duration, kind))
        self.canvas.move(*self.panels)
        rows = [w.HBox([s, self.notes[n]] if n in self.notes else [s]) for n, s in self._sliders.items()]
        buttons = [("Back to factor 1", "Q and R as the robot has them", self._reset)]
        if self.simulated:
            buttons.append(("Another run (new seed)", "Draw another map and other noise", self._next_seed))
        row = []
        for label, tip, action in buttons:
            button = w.Button(description=label, tooltip=tip, layout=w.Layout(width="auto"))
            button.on_click(action)
            row.append(button)
        self.run = w.HTML()
        self.box = Kept([*rows, w.HBox([*row, self.run]), self.screen.image, self.screen.text])

    def _changed(self, name, value):
        self.values[name] = value
        if name in ("landmarks", "range"):
            self.log = self._record()
        self._refresh()

    def _reset(self, _):
        for name in self.notes:
            self._sliders[name].value = 1.0

    def _next_seed(self, _):
        self.seed += 1
        self.log = self._record()
        self._refresh()

    def _refresh(self):
        told = {name: self.values[name] * np.asarray(getattr(self, name)) for name in "QR"}
        for name, note in self.notes.items():
            note.value = html.escape(self._in_words(name, told[name]))
        self.run.value = f"seed {self.seed}" if self.simulated else html.escape(self.log.name)
        try:
            kf = make_filter(self.KF, self.log, told["Q"], told["R"], **self.start)
            history = replay(kf, self.log)
        except FilterError as error:
            self.screen.apologize(str(error))
            self.box._picture, self.box._text = None, str(error)
            return
        for panel in self.panels:
            panel.show(self.log, history)
        text = metrics.summary(history, self.log)
        self.screen.show(self.canvas.jpeg(), text)
        self.box._picture, self.box._text = self.canvas.png, text

    def _in_words(self, name, cov):
        """The standard deviations that the filter now believes in, for one step."""
        dt = self.log.dt
        sigma = np.sqrt(np.diag(cov) * (dt if name == "Q" else 1 / dt))
        if name == "R" and self.sensor == "rb":
            return f"σ = {sigma[0]:.3g} m, {np.rad2deg(sigma[1]):.3g}° per landmark"
        return f"σ = {sigma[0]:.3g} m per {'step' if name == 'Q' else 'landmark'}"


def play(run, log, interval=80, most=200):
    """Animate a run: play, pause and a step slider.  `run` is a History, or a filter to be replayed.

    Runs of more than `most` steps show every second, third ... step.  interval: [ms] a frame.
    """
    screen = Screen()
    try:
        history = run if hasattr(run, "x_prior") else replay(run, log)
    except FilterError as error:
        screen.apologize(str(error))
        return Kept([screen.text], text=str(error))
    canvas = Canvas(6.6, 4.6)
    panel = ScenePanel(canvas.axes[0], (-5.1, 5.1, -5.1, 5.1) if log.range else limits(log))
    canvas.move(panel)
    steps = moments(len(log), most)
    frames = []
    for k in steps:
        panel.show_step(log, history, k)
        frames.append(canvas.jpeg())
    last = canvas.png()
    error = None if log.truth is None else metrics.distances(history, log)

    def show(i):
        k = steps[i]
        far = "" if error is None else f" · error {error[k]:.2f} m"
        seen = f" · {log.count[k - 1]} landmarks in view" if k else ""
        screen.show(frames[i], f"step {k} of {len(log)} · {log.times[k] - log.times[0]:.2f} s{far}{seen}")

    return player(screen, len(steps), show, lambda: last, f"{len(log)} steps of {log.name}", interval)


def moments(steps, most):
    """At most `most` + 1 of the moments 0 ... steps, evenly spaced, with the first and the last among them."""
    chosen = np.arange(0, steps + 1, -(-steps // most))
    return chosen if chosen[-1] == steps else np.append(chosen, steps)


def player(screen, count, show, picture, text, interval):
    """Play, pause and a slider over `count` frames; show(i) puts the i-th on the screen."""
    clock = w.Play(min=0, max=count - 1, interval=interval, show_repeat=False)
    slider = w.IntSlider(0, 0, count - 1, description="frame", readout=False)
    w.jslink((clock, "value"), (slider, "value"))
    slider.observe(lambda change: show(change["new"]), "value")
    show(0)
    return Kept([w.HBox([clock, slider]), screen.image, screen.text], picture, text)


def progress(items, label="runs"):
    """Iterate over a sequence with a progress bar and the time left."""
    items = list(items)
    bar = w.IntProgress(0, 0, max(len(items), 1), description=label, style={"description_width": "initial"})
    note = w.HTML()
    from IPython.display import display

    display(Kept([w.HBox([bar, note])], text=f"{label}: {len(items)}"))
    start = time.monotonic()
    for done, item in enumerate(items, 1):
        yield item
        bar.value, used = done, time.monotonic() - start
        left = used / done * (len(items) - done)
        note.value = f"{done} of {len(items)}, {left:.0f} s left" if left else f"{len(items)} in {used:.1f} s"
