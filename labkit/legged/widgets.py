"""Sliders for the switching filter, and beliefs side by side. As in `labkit.widgets`, the walk stays the same."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import ipywidgets as w
import numpy as np
from numpy.typing import NDArray

from .. import metrics
from ..canvas import Canvas
from ..checks.feedback import FilterError
from ..history import History, make_filter, replay
from ..widgets import moments, player
from ..widgets.explorer import Explorer, Screen, button, sliders
from .beliefplots import BeliefPanel, Watched, beliefs_along
from .fuzzygrid import FuzzyGrid
from .hybrid import Hybrid
from .noise import PRESETS
from .race import steps_until_found
from .robot import DT, FieldLog, LeggedRobot
from .walkplots import DistancePanel, SurprisePanel, WalkPanel

STEPS, KIDNAP = 300, 150
_LOG = {"value": 13.8, "min": 0, "step": 0.02, "readout_format": ".3g"}
_SHARE = {"value": 0.6, "min": 0.0, "max": 1.0, "step": 0.05, "readout_format": ".2f"}
SLIDERS = {
    "gate": (w.FloatLogSlider, {"description": "gate of the EKF: d²", "max": 6, **_LOG}),
    "bound": (w.FloatLogSlider, {"description": "a surprise: d² above", "max": 2.5, **_LOG}),
    "share": (w.FloatSlider, {"description": "share of surprises", **_SHARE}),
}


def explore(
    EKF: type,
    lost: Callable[..., bool],
    preset: str = "harsh",
    sliders: Sequence[str] = ("gate", "bound", "share"),
    seed: int = 1,
    background: int = 0,
) -> Screen:
    """Sliders over one recorded walk with a kidnapping: noise preset, the filter's gate, when to switch.

    EKF:  the student's class, made as EKF(x0, P0, map, noise, gate=...).
    lost: the student's lost(P, d2, bound=..., share=...).
    sliders: any of 'gate', 'bound', 'share'.  background: as for a Hybrid.
    """
    return WalkExplorer(EKF, lost, preset, sliders, seed, background).box


class WalkExplorer(Explorer):
    """The explorer behind `explore`: a walk of a preset's robot, followed by a Hybrid with the student's EKF."""

    RUN = ("preset",)

    def __init__(self, EKF, lost, preset, names, seed, background):
        if preset not in PRESETS:
            raise ValueError(f"preset must be one of {', '.join(PRESETS)}, but it is {preset!r}")
        self.EKF, self.lost, self.background = EKF, lost, background
        style = {"description_width": "150px", "button_width": "80px"}
        presets = w.ToggleButtons(options=list(PRESETS), value=preset, description="noise of the robot", style=style)
        another = button("Another walk (new seed)", self.next_seed)
        super().__init__({"preset": presets, **sliders(names, SLIDERS)}, seed, [another])

    def _record(self):
        return LeggedRobot(self.told["preset"], rng=self.seed).record(STEPS, kidnap=KIDNAP)

    def _lay_out(self):
        canvas, duration = Canvas(10.6, 3.5, columns=3, width_ratios=[1.8, 1, 1]), STEPS * DT
        walk, distance, surprise = canvas.axes
        self.panels = [WalkPanel(walk), DistancePanel(distance, duration), SurprisePanel(surprise, duration)]
        canvas.move(*self.panels)
        return canvas

    def _caption(self):
        return f"seed {self.seed}, kidnapped at {KIDNAP * DT:.0f} s"

    def _show(self):
        history, finding, times, d2 = self._run()
        walk, distance, surprise = self.panels
        walk.show(self.log, history)
        distance.show(self.log, history)
        surprise.show(times, d2, self.told.get("bound", 13.8), self.log.times[1:][finding])
        return in_words(self.log, history, finding)

    def _run(self):
        """The History, in which steps (N,) the finder was at work, and times and d2 of what the EKF was shown."""
        told, log, noise = self.told, self.log, self.log.noise.told()
        KF = partial(self.EKF, **{name: told[name] for name in ("gate",) if name in told})
        lost = partial(self.lost, **{name: told[name] for name in ("bound", "share") if name in told})

        def follow(x0, P0):
            return make_filter(KF, log, x0=x0, P0=P0, noise=noise)

        hybrid = Hybrid(FuzzyGrid(noise), follow, lost, self.background)
        at_work, seen = [hybrid.tracker], []  # of each step: the EKF, or None while the finder works

        def note(k):
            if at_work[-1] is not None:
                seen.extend((log.times[k], float(d2)) for d2 in at_work[-1].d2)
            at_work.append(hybrid.tracker)

        history = replay(Watched(hybrid, note), log)
        return history, np.array([one is None for one in at_work[:-1]]), *np.reshape(seen, (-1, 2)).T


def in_words(log: FieldLog, history: History, finding: NDArray[np.bool_]) -> str:
    """The figures of a walk with a kidnapping, in one line of text; finding (N,): whether the grid was at work."""
    distance, kidnapped = metrics.distances(history, log), log.kidnapped[0]
    steps = steps_until_found(distance[kidnapped + 1 :])
    found = f"found again {steps * DT:.1f} s after it" if np.isfinite(steps) else "never found again"
    return (
        f"before the kidnapping {100 * distance[60 : kidnapped + 1].mean():.1f} cm in the mean · {found} · "
        f"grid at work in {100 * finding.mean():.0f} % of the steps"
    )


def play(localizers: Mapping[str, Any], log: FieldLog, interval: int = 100, most: int = 150) -> Screen:
    """Animate what several localizers believe, side by side: {name: localizer}, one or up to three."""
    if not isinstance(localizers, Mapping) or not 1 <= len(localizers) <= 3:
        raise ValueError(f"localizers must be a dictionary of one to three, but it is {localizers!r}")
    steps = moments(len(log), most)
    try:
        beliefs = {name: beliefs_along(kf, log, set(steps.tolist())) for name, kf in localizers.items()}
    except FilterError as problem:
        return Screen().apologize(problem)
    canvas, panels = _side_by_side(beliefs, log.field)
    stride = int(steps[1]) if len(steps) > 1 else 1

    def draw(k):
        far = []
        for panel, (name, seen) in zip(panels, beliefs.items()):
            panel.show(seen[k], log, k)
            far.append(f"{name} {100 * np.hypot(*(seen[k]['x'] - log.truth[k])[:2]):.0f} cm")
        kidnapped = " · just kidnapped" if any(k - stride <= s < k for s in log.kidnapped) else ""
        return f"{log.times[k]:.1f} s · error: {', '.join(far)}{kidnapped}"

    return player(canvas, steps, draw, log, interval)


def _side_by_side(beliefs, field):
    """A canvas with a panel for each name in {name: {step: belief}}, and one legend for all."""
    names, alone = list(beliefs), len(beliefs) == 1
    all_of_them = [belief for steps in beliefs.values() for belief in steps.values()]
    canvas = Canvas(4.8 if alone else 3.05 * len(names) + 0.2, 4.7 if alone else 3.4, columns=len(names))
    panels = [BeliefPanel(ax, field, name) for ax, name in zip(canvas.axes, names)]
    handles = panels[0].entries(all_of_them)
    canvas.figure.legend(
        handles=handles, loc="outside lower center", ncols=3 if alone else 4, fontsize=8, frameon=False
    )
    for ax in canvas.axes[1:]:
        ax.set(ylabel="", yticklabels=[])
    canvas.move(*panels)
    return canvas, panels
