"""Sliders for two bells on a line, which become one: lab 1's first look at a Kalman filter."""

import ipywidgets as w

from ..canvas import Canvas
from ..plots.bell import BellPanel
from .explorer import Explorer, Screen, sliders

_VARIANCE = {"min": 0.1, "max": 5, "step": 0.02}  # so that 3 and .16 are among the steps: others move to the next
LINE = {
    "P": (w.FloatSlider, {"description": "P of the belief [m²]", "value": 3.0, **_VARIANCE}),
    "R": (w.FloatSlider, {"description": "R of the sensor [m²]", "value": 0.16, **_VARIANCE}),
    "seen": (w.FloatSlider, {"description": "sensor says [m]", "value": 2.0, "min": -4, "max": 4, "step": 0.1}),
}


def explore_line() -> Screen:
    """Sliders for a belief about a place on a line and for a sensor of it, and what becomes of the two together."""
    return LineExplorer(sliders(LINE, LINE), 0, []).box


class LineExplorer(Explorer):
    """The explorer behind `explore_line`: there is no run, only a belief, at 0 m, and one reading."""

    def _record(self):
        return None

    def _lay_out(self):
        canvas = Canvas(7.0, 3.4)
        self.panel = BellPanel(canvas.axes[0])
        canvas.move(self.panel)
        return canvas

    def _caption(self):
        return ""

    def _show(self):
        P, R, seen = (self.told[name] for name in LINE)
        K = P / (P + R)
        self.panel.show((0.0, P), (seen, R), (K * seen, P - K * P))
        return (
            f"K = {K:.2f}: the estimate goes {100 * K:.0f} % of the way, to {K * seen:.2f} m · "
            f"its variance falls from {P:.3g} to {P - K * P:.3g} m²"
        )
