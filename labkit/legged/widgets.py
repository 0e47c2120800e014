"""Sliders for the switching filter, and beliefs side by side. As in `labkit.widgets`, the walk stays the same."""

import html
from functools import partial

import ipywidgets as w
import numpy as np

from .. import metrics
from ..canvas import Canvas
from ..checks.feedback import FilterError
from ..log import make_filter, replay
from ..widgets import Kept, Screen, moments, player
from .fuzzygrid import FuzzyGrid
from .hybrid import Hybrid
from .noise import PRESETS
from .plots import BeliefPanel, DistancePanel, SurprisePanel, WalkPanel, beliefs_along
from .robot import LeggedRobot

STEPS, KIDNAP = 300, 150
SLIDERS = {
    "gate": dict(value=13.8, min=0, max=6, description="gate of the EKF: d²"),
    "bound": dict(value=13.8, min=0, max=2.5, description="a surprise: d² above"),
    "share": dict(value=0.6, min=0.0, max=1.0, description="share of surprises"),
}


def explore(EKF, lost, preset="harsh", sliders=("gate", "bound", "share"), seed=1, background=0):
    """Sliders over one recorded walk with a kidnapping: noise preset, the filter's gate, when to switch.

    EKF:  the student's class, made as EKF(x0, P0, map, noise, gate=...).
    lost: the student's lost(P, d2, bound=..., share=...).
    sliders: any of 'gate', 'bound', 'share'.  background: as for a Hybrid.
    """
    return Explorer(EKF, lost, preset, sliders, seed, background).box


class Explorer:
    """The state behind `explore`: the walk, the sliders' values, and `box`, the widget to show."""

    def __init__(self, EKF, lost, preset, sliders, seed, background):
        self.EKF, self.lost, self.seed, self.background = EKF, lost, seed, background
        unknown = set(sliders) - set(SLIDERS)
        if unknown:
            raise ValueError(f"sliders are {', '.join(SLIDERS)}, not {min(unknown)!r}")
        if preset not in PRESETS:
            raise ValueError(f"preset must be one of {', '.join(PRESETS)}, but it is {preset!r}")
        options = {"style": {"description_width": "150px"}, "layout": w.Layout(width="430px")}
        self._preset = w.ToggleButtons(
            options=list(PRESETS),
            value=preset,
            description="noise of the robot",
            style={"description_width": "150px", "button_width": "80px"},
        )
        self._sliders = {}
        for name in sliders:
            kind = w.FloatSlider if name == "share" else w.FloatLogSlider
            step = 0.05 if name == "share" else 0.02
            self._sliders[name] = kind(
                step=step, readout_format=".2f" if name == "share" else ".3g", **SLIDERS[name], **options
            )
        another = w.Button(description="Another walk (new seed)", layout=w.Layout(width="auto"))
        another.on_click(self._next)
        self.note, self.screen = w.HTML(), Screen()
        self.canvas = Canvas(9.2, 3.7, columns=3, width_ratios=[1.35, 1, 1])
        self.panels = [
            WalkPanel(self.canvas.axes[0]),
            DistancePanel(self.canvas.axes[1], STEPS / 10),
            SurprisePanel(self.canvas.axes[2], STEPS / 10),
        ]
        self.canvas.move(*self.panels)
        self.box = Kept(
            [self._preset, *self._sliders.values(), w.HBox([another, self.note]), self.screen.image, self.screen.text]
        )
        self._record()
        self._preset.observe(lambda _: (self._record(), self._refresh()), "value")
        for slider in self._sliders.values():
            slider.observe(lambda _: self._refresh(), "value")
        self._refresh()

    def _record(self):
        self.log = LeggedRobot(self._preset.value, rng=self.seed).record(STEPS, kidnap=KIDNAP)

    def _next(self, _):
        self.seed += 1
        self._record()
        self._refresh()

    def _refresh(self):
        told = {name: slider.value for name, slider in self._sliders.items()}
        self.note.value = html.escape(f"seed {self.seed}, kidnapped at {KIDNAP / 10:.0f} s")
        try:
            history, watched = self._run(told)
        except FilterError as error:
            self.screen.apologize(str(error))
            self.box._picture, self.box._text = None, str(error)
            return
        walk, distance, surprise = self.panels
        walk.show(self.log, history)
        distance.show(self.log, history)
        surprise.show(*watched.seen(), told.get("bound", 13.8), self.log.times[1:][watched.finding])
        text = in_words(self.log, history, watched.finding)
        self.screen.show(self.canvas.jpeg(), text)
        self.box._picture, self.box._text = self.canvas.png, text

    def _run(self, told):
        noise, log = self.log.noise.told(), self.log
        KF = partial(self.EKF, **{"gate": told["gate"]} if "gate" in told else {})
        lost = partial(self.lost, **{k: v for k, v in told.items() if k != "gate"})
        hybrid = Hybrid(
            FuzzyGrid(noise), lambda x0, P0: make_filter(KF, log, x0=x0, P0=P0, noise=noise), lost, self.background
        )
        watched = Watched(hybrid, log)
        return replay(watched, log), watched


class Watched:
    """A Hybrid that also notes, at each step, which of the two was at work and how surprised the quick one was."""

    def __init__(self, hybrid, log):
        self.hybrid, self.times = hybrid, log.times
        self.finding, self._d2 = np.zeros(len(log), dtype=bool), []
        self._k = -1

    xk_k = property(lambda self: self.hybrid.xk_k)
    Pk_k = property(lambda self: self.hybrid.Pk_k)

    def predict(self, u):
        self._k += 1
        self.finding[self._k] = self.hybrid.mode == "find"
        self.hybrid.predict(u)

    def update(self, y):
        quick = self.hybrid.quick
        self.hybrid.update(y)
        if quick is not None:
            self._d2 += [(self.times[self._k + 1], float(d2)) for d2 in quick.d2]

    def seen(self):
        """(times, d2) of all sightings that the quick one was shown."""
        pairs = np.array(self._d2).reshape(-1, 2)
        return pairs[:, 0], pairs[:, 1]


def in_words(log, history, finding):
    """The figures of a walk with a kidnapping, in one line of text."""
    distance = metrics.distances(history, log)
    before = slice(60, log.kidnapped[0] + 1 if log.kidnapped else None)
    text = (
        f"before the kidnapping {100 * distance[before].mean():.1f} cm in the mean"
        if log.kidnapped
        else (f"{100 * distance[before].mean():.1f} cm in the mean")
    )
    if log.kidnapped:
        from .race import steps_until_found

        steps = steps_until_found(distance[log.kidnapped[0] + 1 :])
        text += " · after it " + (f"found again in {steps / 10:.1f} s" if np.isfinite(steps) else "never found again")
    return f"{text} · grid at work in {100 * finding.mean():.0f} % of the steps"


def play(localizers, log, interval=100, most=150):
    """Animate what several localizers believe, side by side: {name: localizer}, one or up to three."""
    if not 1 <= len(localizers) <= 3:
        raise ValueError(f"localizers must be a dictionary of one to three, but it has {len(localizers)}")
    screen, frames, texts = Screen(), [], []
    steps = moments(len(log), most)
    try:
        beliefs = {name: beliefs_along(kf, log, set(steps.tolist())) for name, kf in localizers.items()}
    except FilterError as error:
        screen.apologize(str(error))
        return Kept([screen.text], text=str(error))
    alone = len(localizers) == 1
    canvas = Canvas(4.8 if alone else 3.05 * len(localizers) + 0.2, 4.4 if alone else 3.0, columns=len(localizers))
    panels = [BeliefPanel(ax, log.field, name) for ax, name in zip(canvas.axes, localizers)]
    canvas.figure.legend(
        handles=panels[0].legend, loc="outside lower center", ncols=3 if alone else 5, fontsize=8, frameon=False
    )
    for ax in canvas.axes[1:]:
        ax.set(ylabel="", yticklabels=[])
    canvas.move(*panels)
    stride = int(steps[1]) if len(steps) > 1 else 1
    for k in steps:
        far = []
        for panel, (name, seen) in zip(panels, beliefs.items()):
            panel.show(seen[k], log, k)
            far.append(f"{name} {100 * np.hypot(*(seen[k]['x'] - log.truth[k])[:2]):.0f} cm")
        frames.append(canvas.jpeg())
        texts.append(
            f"{log.times[k]:.1f} s · error: {', '.join(far)}"
            + (" · just kidnapped" if any(k - stride <= s < k for s in log.kidnapped) else "")
        )
    last = canvas.png()

    return player(
        screen,
        len(steps),
        lambda i: screen.show(frames[i], texts[i]),
        lambda: last,
        f"{len(log)} steps of {log.name}",
        interval,
    )
