"""A figure that is laid out once; after that only its moving artists are drawn, in under a millisecond.

Drawing a whole matplotlib figure costs some 60 ms, encoding it as PNG 16 more.  A slider that should
follow the hand redraws the moving artists over a stored background and encodes a JPEG (2 ms).
"""

from io import BytesIO
from threading import RLock
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

DRAWING = RLock()  # matplotlib draws on one thread at a time; fonts and formulas are shared by all figures


class Canvas:
    """width, height in inches at 100 dpi; `columns` axes side by side."""

    def __init__(self, width: float, height: float, columns: int = 1, **options: Any):
        # Own figure and canvas, no pyplot: nothing is drawn twice and no global figure is left behind.
        self.figure = Figure((width, height), dpi=100, facecolor="white", layout="constrained")
        self.canvas = FigureCanvasAgg(self.figure)
        self.axes = self.figure.subplots(1, columns, squeeze=False, **options)[0]
        self.moving: list = []
        self._background: Any = None
        self._scales: list = []

    def move(self, *panels: Any) -> None:
        """Declare the artists that change from picture to picture."""
        for panel in panels:
            for artist in panel.artists:
                artist.set_animated(True)
                self.moving.append(artist)

    def _draw(self):
        scales = [(ax.get_xlim(), ax.get_ylim()) for ax in self.axes]
        if scales != self._scales:  # the first time, and when a panel needs another height
            self._scales = scales
            self.canvas.draw()
            self.figure.set_layout_engine("none")  # the layout stays as it is now
            self._background = self.canvas.copy_from_bbox(self.figure.bbox)
        self.canvas.restore_region(self._background)
        for artist in self.moving:
            artist.axes.draw_artist(artist)

    def image(self) -> Image.Image:
        """The picture as it is now."""
        with DRAWING:
            self._draw()
            return Image.frombuffer("RGBA", self.canvas.get_width_height(), self.canvas.buffer_rgba()).convert("RGB")

    def jpeg(self) -> bytes:
        """Picture as JPEG bytes, quick to encode: for what changes often."""
        return _encoded(self.image(), "JPEG", quality=90, subsampling=0)

    def png(self) -> bytes:
        """Picture as PNG bytes: for what is kept."""
        return _encoded(self.image(), "PNG")


def _encoded(image, kind, **options):
    buffer = BytesIO()
    image.save(buffer, kind, **options)
    return buffer.getvalue()
