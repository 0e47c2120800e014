"""Sliders over one recorded run of a team, and a formation in motion. As in `labkit.widgets`, the noise stays."""

import warnings
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import ipywidgets as w
import numpy as np

from ..canvas import Canvas
from ..geometry import align, transform
from ..history import made, replay
from ..metrics import nees_per_dimension
from ..plots import BLUE, GREY, ORANGE, VERMILION
from ..widgets import moments, player
from ..widgets.explorer import Explorer, Screen, button, sliders
from . import scenarios
from .formation import FormationRun
from .frame import frame_errors
from .plots import COLORS, FormationPanel
from .warning import FrameWarning

RUNS = {"cross": scenarios.cross, "rectangle": scenarios.rectangle, "moving": scenarios.moving}
_LOG, _FOUR = {"step": 0.02, "readout_format": ".3g"}, np.log10(4)
SLIDERS = {
    "gate": (w.FloatLogSlider, {"description": "gate: d²", "value": 13.8, "min": 0, "max": 4, **_LOG}),
    "inflate": (
        w.FloatLogSlider,
        {"description": "inflate, factor on Q", "value": 4.0, "min": _FOUR - 1.6, "max": _FOUR + 2.4, **_LOG},
    ),
}


def explore(
    started: Callable[..., Any],
    scenario: str = "rectangle",
    sliders: Sequence[str] = ("gate", "inflate"),
    seed: int = 1,
) -> Screen:
    """Sliders for what a joint filter is told, over one recorded run.

    started: started(log, seed, gate=..., inflate=...) makes the filter for a log, at its start.
    scenario: 'cross', 'rectangle' or 'moving'.  sliders: any of 'gate', 'inflate'.
    """
    return TeamExplorer(started, scenario, sliders, seed).box


class TeamExplorer(Explorer):
    """The explorer behind `explore`."""

    def __init__(self, started, scenario, names, seed):
        if scenario not in RUNS:
            raise ValueError(f"scenario must be one of {', '.join(RUNS)}, but it is {scenario!r}")
        self.started, self.scenario = started, scenario
        super().__init__(sliders(names, SLIDERS), seed, [button("Another run (new seed)", self.next_seed)])

    def _record(self):
        options = {"laps": 1} if self.scenario == "rectangle" else {}
        return RUNS[self.scenario](rng=self.seed, **options)

    def _caption(self):
        return f"{self.log.name}, seed {self.seed}"

    def _lay_out(self):
        canvas = Canvas(9.2, 3.7, columns=2, width_ratios=[1, 1.2])
        paths, errors = canvas.axes
        paths.set(xlim=(-7, 7), ylim=(-6, 7), xlabel="x [m]", ylabel="y [m]", aspect="equal")
        paths.set_title("Paths, after the best turn and shift", fontsize=11)
        (self.truth,) = paths.plot([], [], "-", color=GREY, lw=2.5, alpha=0.5, label="truth")
        self.lines = [
            paths.plot([], [], "--" if i == 0 else ".", color=COLORS[i], lw=1.2, ms=3, label=f"robot {i}")[0]
            for i in range(self.log.n)
        ]
        paths.legend(loc="upper center", fontsize=8, frameon=False, ncols=3)
        errors.set(xlim=(0, self.log.times[-1]), ylim=(0.2, 500), yscale="log")
        errors.set(xlabel="time [s]", ylabel="error of robot 0 [cm]")
        errors.set_title("Errors", fontsize=11)
        kinds = [("gauge", ORANGE, ":"), ("aligned", BLUE, "-"), ("ego", VERMILION, "--")]
        self.errors = {
            name: errors.plot([], [], style, color=color, lw=1.2, label=name)[0] for name, color, style in kinds
        }
        errors.legend(loc="upper left", fontsize=8, frameon=False, ncols=3)
        self.artists = [self.truth, *self.lines, *self.errors.values()]
        canvas.move(self)
        return canvas

    def _show(self):
        with warnings.catch_warnings(record=True) as doubts:
            warnings.simplefilter("always", FrameWarning)
            history = replay(made(partial(self.started, self.log, self.seed, **self.told)), self.log)
        x, truth = history.x, self.log.truth
        errors = frame_errors(x, truth)
        angle, shift = align(x[..., :2].reshape(-1, 2), truth[..., :2].reshape(-1, 2))
        seen = transform(x, angle, shift)
        gaps = [np.vstack([truth[:, i, :2], [[np.nan, np.nan]]]) for i in range(self.log.n)]
        self.truth.set_data(*np.concatenate(gaps).T)
        for i, line in enumerate(self.lines):
            line.set_data(*seen[:, i, :2].T)
        for name, line in self.errors.items():
            line.set_data(self.log.times, (100 * getattr(errors, name)).clip(0.2, 500))
        text = (
            f"mean error: aligned {100 * errors.aligned.mean():.1f} cm, ego {100 * errors.ego.mean():.1f} cm · "
            f"NEES per dimension {nees_per_dimension(history, self.log).mean():.1f} · "
            f"the frame has turned by {np.rad2deg(errors.turned):.2f}°"
        )
        if any(issubclass(doubt.category, FrameWarning) for doubt in doubts):
            text += " · most readings of a robot lie beyond the gate: not to be trusted"
        return text


def play(run: FormationRun, interval: int = 80, most: int = 150) -> Screen:
    """Animate a FormationRun: robots, slots, and what the filter believes with its 3-sigma ellipses."""
    canvas = Canvas(6.2, 5.0)
    panel = FormationPanel(canvas.axes[0], run)
    canvas.move(panel)

    def draw(k):
        panel.show(run, k, None if run.covariances is None else run.covariances[k])
        return f"{run.log.times[k]:.1f} s · largest distance from a slot {100 * run.error[k]:.0f} cm"

    return player(canvas, moments(len(run.log), most), draw, run.log, interval)
