"""Sliders over one recorded run of a team, and a formation in motion. As in `labkit.widgets`, the noise stays."""

import html
import warnings

import ipywidgets as w
import numpy as np

from ..canvas import Canvas
from ..checks.feedback import FilterError, explain
from ..plots import BLUE, GREY, ORANGE, VERMILION
from ..widgets import Kept, Screen, moments, player
from . import scenarios
from .frame import align, frame_errors, laid, nees
from .plots import COLORS, FormationPanel
from .run import FrameWarning, replay

RUNS = {"cross": scenarios.cross, "rectangle": scenarios.rectangle, "moving": scenarios.moving}
SLIDERS = {
    "gate": dict(value=13.8, min=0, max=4, description="gate: d²"),
    "inflate": dict(value=4.0, min=np.log10(4) - 1.6, max=np.log10(4) + 2.4, description="inflate, factor on Q"),
}


def explore(started, scenario="rectangle", sliders=("gate", "inflate"), seed=1):
    """Sliders for what a joint filter is told, over one recorded run.

    started: started(log, seed, gate=..., inflate=...) makes the filter for a log, at its start.
    scenario: 'cross', 'rectangle' or 'moving'.  sliders: any of 'gate', 'inflate'.
    """
    unknown = set(sliders) - set(SLIDERS)
    if unknown:
        raise ValueError(f"sliders are {', '.join(SLIDERS)}, not {min(unknown)!r}")
    if scenario not in RUNS:
        raise ValueError(f"scenario must be one of {', '.join(RUNS)}, but it is {scenario!r}")
    return _Explorer(started, scenario, sliders, seed).box


class _Explorer:
    def __init__(self, started, scenario, sliders, seed):
        self.started, self.scenario, self.seed = started, scenario, seed
        options = {"style": {"description_width": "150px"}, "layout": w.Layout(width="430px")}
        self._sliders = {
            name: w.FloatLogSlider(step=0.02, readout_format=".3g", **SLIDERS[name], **options) for name in sliders
        }
        another = w.Button(description="Another run (new seed)", layout=w.Layout(width="auto"))
        another.on_click(self._next)
        self.note, self.screen = w.HTML(), Screen()
        self._record()
        self._build()
        self.box = Kept([*self._sliders.values(), w.HBox([another, self.note]), self.screen.image, self.screen.text])
        for slider in self._sliders.values():
            slider.observe(lambda _: self._refresh(), "value")
        self._refresh()

    def _record(self):
        options = {"laps": 1} if self.scenario == "rectangle" else {}
        self.log = RUNS[self.scenario](rng=self.seed, **options)

    def _build(self):
        self.canvas = Canvas(9.2, 3.7, columns=2, width_ratios=[1, 1.2])
        paths, errors = self.canvas.axes
        paths.set(xlim=(-7, 7), ylim=(-6, 7), xlabel="x [m]", ylabel="y [m]", aspect="equal")
        paths.set_title("Paths, after the best turn and shift", fontsize=11)
        n = self.log.n
        (self.truth,) = paths.plot([], [], "-", color=GREY, lw=2.5, alpha=0.5, label="truth")
        self.lines = [
            paths.plot([], [], "--" if i == 0 else ".", color=COLORS[i], lw=1.2, ms=3, label=f"robot {i}")[0]
            for i in range(n)
        ]
        paths.legend(loc="upper center", fontsize=8, frameon=False, ncols=3)
        errors.set(
            xlim=(0, self.log.times[-1]),
            ylim=(0.2, 500),
            yscale="log",
            xlabel="time [s]",
            ylabel="error of robot 0 [cm]",
        )
        errors.set_title("Errors", fontsize=11)
        kinds = [("gauge", ORANGE, ":"), ("aligned", BLUE, "-"), ("ego", VERMILION, "--")]
        self.errors = {
            name: errors.plot([], [], style, color=color, lw=1.2, label=name)[0] for name, color, style in kinds
        }
        errors.legend(loc="upper left", fontsize=8, frameon=False, ncols=3)
        self.artists = [self.truth, *self.lines, *self.errors.values()]
        self.canvas.move(self)

    def _next(self, _):
        self.seed += 1
        self._record()
        self._refresh()

    def _made(self, told):
        try:
            return self.started(self.log, self.seed, **told)
        except Exception as error:
            raise FilterError(f"Your filter could not be made. {explain(error)}") from error

    def _refresh(self):
        told = {name: slider.value for name, slider in self._sliders.items()}
        self.note.value = html.escape(f"{self.log.name}, seed {self.seed}")
        try:
            with warnings.catch_warnings(record=True) as doubts:
                warnings.simplefilter("always", FrameWarning)
                x, P = replay(self._made(told), self.log)
        except FilterError as error:
            self.screen.apologize(str(error))
            self.box._picture, self.box._text = None, str(error)
            return
        truth = self.log.truth
        errors = frame_errors(x, truth)
        angle, shift = align(x[..., :2].reshape(-1, 2), truth[..., :2].reshape(-1, 2))
        seen = laid(x, angle, shift)
        gaps = [np.vstack([truth[:, i, :2], [[np.nan, np.nan]]]) for i in range(self.log.n)]
        self.truth.set_data(*np.concatenate(gaps).T)
        for i, line in enumerate(self.lines):
            line.set_data(*seen[:, i, :2].T)
        for name, line in self.errors.items():
            line.set_data(self.log.times, (100 * getattr(errors, name)).clip(0.2, 500))
        text = (
            f"mean error: aligned {100 * errors.aligned.mean():.1f} cm, ego {100 * errors.ego.mean():.1f} cm · "
            f"NEES per dimension {nees(x, P, truth).mean():.1f} · the frame has turned by {np.rad2deg(errors.turned):.2f}°"
        )
        if any(issubclass(doubt.category, FrameWarning) for doubt in doubts):
            text += " · most readings of a robot lie beyond the gate: not to be trusted"
        self.screen.show(self.canvas.jpeg(), text)
        self.box._picture, self.box._text = self.canvas.png, text


def play(run, interval=80, most=150):
    """Animate a FormationRun: robots, slots, and what the filter believes with its 3-sigma ellipses."""
    screen, frames, texts = Screen(), [], []
    steps = moments(len(run.log), most)
    canvas = Canvas(6.2, 5.0)
    panel = FormationPanel(canvas.axes[0], run)
    canvas.move(panel)
    for k in steps:
        panel.show(run, k, None if run.covariances is None else run.covariances[k])
        frames.append(canvas.jpeg())
        texts.append(f"{run.log.times[k]:.1f} s · largest distance from a slot {100 * run.error[k]:.0f} cm")
    last = canvas.png()

    return player(
        screen,
        len(steps),
        lambda i: screen.show(frames[i], texts[i]),
        lambda: last,
        f"{len(run.log)} steps of {run.log.name}",
        interval,
    )
