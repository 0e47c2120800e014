"""The handout's EnvPlot: one picture of robot, map and filter at each step of a loop."""

import sys
from typing import Any

from matplotlib.figure import Figure

from .canvas import Canvas
from .plots import ScenePanel
from .robot import Robot
from .validation import as_covariance, as_point
from .world import Map, located, positions


class EnvPlot:
    """`plotSim(r, m, kf)` shows a step: in a notebook, in a window, or nowhere on a headless machine.

    Source: the practice handout, section 2; its axes, signs and colours.
    """

    def __init__(self) -> None:
        self._window: Any = None
        self._handle: Any = None
        if _in_notebook():
            self._canvas = Canvas(6.2, 4.6)
            self._axes = self._canvas.axes[0]
        else:
            import matplotlib.pyplot as plt

            self._window, self._axes = plt.subplots(figsize=(6.2, 4.6), layout="constrained")
        self.panel = ScenePanel(self._axes)
        if self._window is None:
            self._canvas.move(self.panel)

    @property
    def figure(self) -> Figure:
        """The matplotlib Figure, for saving it."""
        return self._axes.figure

    def plotSim(self, r: Robot, m: Map, kf: Any, pause: bool = False) -> None:
        """Draw robot `r`, map `m` and filter `kf`; with pause=True a window waits for a key.

        In a notebook and without a display nothing waits.
        """
        if not isinstance(r, Robot) or not hasattr(kf, "xk_k"):
            raise TypeError("plotSim(r, m, kf) needs a Robot, a Map and a filter, in this order")
        seen = located(r.p, positions(r.objs), r.type)
        mean, cov = as_point(kf.xk_k, "the filter's xk_k"), as_covariance(kf.Pk_k, "the filter's Pk_k")
        self.panel.show(m, r.p, r.range, seen, mean, cov)
        if self._window is None:
            self._show_in_notebook()
        elif _has_window():
            import matplotlib.pyplot as plt

            if pause:
                self._axes.set_title("press a key to start")
                self._window.waitforbuttonpress()
                self._axes.set_title("")
            plt.pause(0.01)

    def _show_in_notebook(self):
        from IPython.display import Image, display

        # One output that is replaced, never cleared: clearing makes every other frame blank.
        picture = Image(self._canvas.png(), format="png")
        if self._handle is None:
            self._handle = display(picture, display_id=True)
        else:
            self._handle.update(picture)


def _in_notebook():
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    return hasattr(shell, "kernel")


def _has_window():
    import matplotlib

    return matplotlib.get_backend().lower() in {
        b.lower()
        for b in matplotlib.backends.backend_registry.list_builtin(matplotlib.backends.BackendFilter.INTERACTIVE)
    }
