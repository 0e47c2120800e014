"""Sliders over a recorded run, the same for all labs: the noise stays, only the student's filter runs again."""

import html
from abc import ABC, abstractmethod
from base64 import b64encode
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Self

import ipywidgets as w
from PIL.Image import Image

from ..canvas import DRAWING, Canvas
from ..checks.feedback import FilterError

WIDE = {"style": {"description_width": "150px"}, "layout": {"width": "430px"}}
VIEW = "application/vnd.jupyter.widget-view+json"

# Who cannot see the page is told a slider's, a button's and a picture's name, and ipywidgets gives none: here they get
# them, once they are on the page. And Notebook 7 would take the arrow keys for itself.
_NAMES = """<style onload="
  const box = this.closest('.widget-vbox') || document.body;
  const name = () => {
    for (const handle of box.querySelectorAll('.noUi-handle')) {
      handle.ariaLabel = handle.closest('.widget-slider').querySelector('label').textContent;
      handle.dataset.lmSuppressShortcuts = 'true';
    }
    box.querySelectorAll('.widget-play button').forEach((b, i) => b.ariaLabel = ['Play or pause', 'Stop', 'Repeat'][i]);
    for (const image of box.querySelectorAll('img')) image.alt = 'Picture: the line below it tells what it shows';
  };
  new MutationObserver(name).observe(box, {childList: true, subtree: true});
  name();
"></style>"""


class Kept(w.VBox):
    """Widgets in a column; readers without a running kernel get a sentence, and a still picture if there is one."""

    def __init__(self, children: Sequence[w.Widget], text: str = ""):
        super().__init__(children, layout=w.Layout(max_width="940px"))
        self.keep(text)

    def keep(self, text: str, still: Callable[[], bytes] | None = None) -> None:
        """Have another sentence and picture; still() makes it as PNG."""
        self._text, self._still = text, still

    _ipython_display_ = None  # by which ipywidgets 7, Colab's, would show itself and nothing else

    def _repr_mimebundle_(self, **kwargs):
        view = {"version_major": 2, "version_minor": 0, "model_id": self.model_id}
        bundle = {"text/plain": self._text, VIEW: view}
        if self._still:
            bundle["image/png"] = b64encode(self._still()).decode()
        return bundle


class Screen(Kept):
    """Controls, and below them a picture with its line of text, or the sentence that says why there is none."""

    def __init__(self, controls: Sequence[w.Widget] = ()):
        # align_self: a column would stretch the picture to its width.  margin: the 2 px around every
        # widget would come on top of the 100 % and call for a scroll bar.
        layout = w.Layout(max_width="100%", align_self="flex-start", margin="0")
        self.image, self.text = w.Image(format="jpeg", layout=layout), w.HTML()
        self.film: Callable[[], list[Image]] | None = None  # of an animation: makes its pictures, without loss
        names = w.HTML(_NAMES, layout=w.Layout(display="none"))
        super().__init__([names, *controls, self.image, self.text])

    def show(self, jpeg: bytes, text: str) -> None:
        """Put a picture and its line of text on the screen."""
        self.image.value, self.image.layout.display = jpeg, None
        self.text.value = f"<div>{html.escape(text)}</div>"

    def apologize(self, error: Exception) -> Self:
        """Put an error's sentence in the picture's place, as an alert, which screen readers speak."""
        self.image.layout.display = "none"
        self.text.value = (
            '<div role="alert" style="white-space:pre-wrap;border-left:4px solid #D55E00;padding:6px 12px">'
            f"<b>No picture yet.</b> {html.escape(str(error))}</div>"
        )
        self.keep(str(error))
        return self


def button(label: str, action: Callable[[], None], tip: str = "") -> w.Button:
    """A button as wide as its label."""
    made = w.Button(description=label, tooltip=tip, layout=w.Layout(width="auto"))
    made.on_click(lambda _: action())
    return made


def sliders(names: Iterable[str], known: dict[str, tuple[type, dict]], **values: float) -> dict[str, w.Widget]:
    """{name: slider} for each of the names; known: {name: (class, options)}.  values: instead of those in the options.

    Raises ValueError for a name that is not known.
    """
    made = {}
    for name in names:
        if name not in known:
            raise ValueError(f"sliders are {', '.join(known)}, not {name!r}")
        kind, options = known[name]
        made[name] = kind(**WIDE | options | ({"value": values[name]} if name in values else {}))
    return made


class Explorer(ABC):
    """Controls over one recorded run, `log`; `box` is the widget to show.

    Front ends call back on whichever thread they like, even on several at a time: one waits for the other.

    controls: {name: widget} in the order in which they stand; a move of one named in RUN records another run, of any
    other only has the filter run again.  rows: what is shown of them, if it is more.  buttons: below them.
    """

    RUN: tuple[str, ...] = ()

    def __init__(self, controls: dict, seed: int, buttons: Sequence[w.Button], rows: Sequence[w.Widget] | None = None):
        self.controls, self.seed, self.note = controls, seed, w.HTML()
        self.log = self._record()
        self.canvas = self._lay_out()
        self.box = Screen([*(rows or controls.values()), w.HBox([*buttons, self.note])])
        for name, control in controls.items():
            control.observe(partial(self._moved, name), "value")
        self._refresh()

    @abstractmethod
    def _record(self):
        """The run of `seed`, and of the controls named in RUN."""

    @abstractmethod
    def _lay_out(self) -> Canvas:
        """The picture, laid out once."""

    @abstractmethod
    def _caption(self) -> str:
        """Which run this is, for beside the buttons."""

    @abstractmethod
    def _show(self) -> str:
        """Run the filter over the log, fill the picture, and say in a line what came of it; raises FilterError."""

    @property
    def told(self) -> dict:
        """{name: value} as the controls now stand."""
        return {name: control.value for name, control in self.controls.items()}

    def next_seed(self) -> None:
        """Another run, with the controls as they are."""
        with DRAWING:
            self.seed += 1
            self.log = self._record()
            self._refresh()

    def _moved(self, name, _):
        with DRAWING:
            if name in self.RUN:
                self.log = self._record()
            self._refresh()

    def _refresh(self):
        self.note.value = html.escape(self._caption())
        try:
            text = self._show()
        except FilterError as error:
            self.box.apologize(error)
        else:
            self.box.show(self.canvas.jpeg(), text)
            self.box.keep(text, self.canvas.png)
