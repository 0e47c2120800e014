"""What tests of pictures and widgets share: reading pixels, finding widgets, watching drawn texts."""

import io

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.legend import Legend
from matplotlib.text import Text
from PIL import Image


def widgets(box, kind):
    """All widgets of a class name in a tree of boxes."""
    below = [w for child in getattr(box, "children", ()) for w in widgets(child, kind)]
    return below + ([box] if type(box).__name__ == kind else [])


def kept(box):
    return box._repr_mimebundle_()


def pixels(data):
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"), dtype=int)


@pytest.fixture
def drawn(monkeypatch):
    """{figure: [(text, box)]} of all texts that really get drawn, with their boxes [pixels]."""
    boxes, draw = {}, Text.draw
    plt.close("all")  # what tests before have left

    def watched(self, renderer, *args, **kwargs):
        if self.get_visible() and self.get_text().strip():
            box = Text.get_window_extent(self, renderer)  # of an annotation, the text without its arrow
            boxes.setdefault(self.figure, []).append((self.get_text(), box))
        return draw(self, renderer, *args, **kwargs)

    monkeypatch.setattr(Text, "draw", watched)
    monkeypatch.setattr(plt, "show", lambda: None)
    yield boxes
    plt.close("all")


def legible(drawn, figure):
    """Asserts that all texts of a figure, and its legends, are inside it and clear of one another."""
    texts, frame = drawn[figure], figure.bbox.padded(0.5)
    assert len(texts) > 3
    boxes = texts + [("legend", legend.get_window_extent()) for legend in figure.findobj(Legend)]
    cut = [
        name for name, box in boxes if box.x0 < frame.x0 or box.y0 < frame.y0 or box.x1 > frame.x1 or box.y1 > frame.y1
    ]
    assert not cut, f"cut off: {cut}"
    both = [
        (a, b) for i, (a, one) in enumerate(texts) for b, two in texts[:i] if one.padded(-1).overlaps(two.padded(-1))
    ]
    assert not both, f"on one another: {both}"


def shown(drawn):
    """The one figure that was shown, legible."""
    (number,) = plt.get_fignums()
    figure = plt.figure(number)
    drawn.clear()
    figure.canvas.draw()
    legible(drawn, figure)
    return figure


def names(drawn, figure):
    return [name for name, _ in drawn[figure]]
