"""Similar code side by side, as a page for the instructor."""

from collections import Counter
from collections.abc import Sequence
from math import ceil
from statistics import median
from typing import NamedTuple

from ..report.pages import environment
from ..report.ways import ways
from .similar import LEAST, Likeness, Side
from .stretches import Piece

LEFT, WIDTH, TALL = 10, 700, 85  # of the chart's bars, in units of its drawing
BARS = 20
LONGEST = 60_000  # characters of a code that are shown
_ENVIRONMENT = environment(__package__, "labkit.instructor.report")


class Bar(NamedTuple):
    """So many pairs, and where the bar stands and how large it is."""

    pairs: int
    left: float
    width: float
    middle: float
    height: float


class Chart(NamedTuple):
    """How many pairs share how much; edges: (place, amount) of the axis;  words: the same as a sentence."""

    bars: Sequence[Bar]
    edges: Sequence[tuple[float, str]]
    threshold: float
    words: str


class Shown(NamedTuple):
    """A side as it is shown; more: characters that are cut away."""

    label: str
    same: int
    own: int
    shown: Sequence[Piece]
    more: int


def similar_page(lab: str, found: Likeness, without: int = 0) -> str:
    """The HTML of a lab's similar codes. without: of how many students the code is not kept."""
    return _ENVIRONMENT.get_template("similar.html.j2").render(
        lab=lab,
        ways=ways(lab, ""),
        found=found,
        pairs=[(pair, [_shown(pair.first), _shown(pair.second)]) for pair in found.pairs],
        without=without,
        middle=median(found.amounts) if found.amounts else 0.0,
        largest=max(found.amounts, default=0.0),
        least=LEAST,
        bars=chart(found.amounts, found.threshold),
    )


def chart(amounts: Sequence[float], threshold: float) -> Chart:
    """The chart of what all pairs share; no bar lies on both sides of the threshold."""
    most = max([*amounts, threshold])
    step = threshold / max(1, round(BARS * threshold / most))
    count = Counter(max(0, ceil(amount / step - 1e-9) - 1) for amount in amounts)
    bins = max([*count, BARS // 2, round(threshold / step)]) + 1
    each, top = WIDTH / bins, max(count.values(), default=1)
    bars = [
        Bar(n, *(round(side, 1) for side in (LEFT + at * each + 1, each - 2, LEFT + (at + 0.5) * each, TALL * n / top)))
        for at, n in sorted(count.items())
    ]
    edges = [(round(LEFT + at * each, 1), f"{at * step:.0f}") for at in range(0, bins + 1, max(1, bins // 10))]
    words = "; ".join(f"{at * step:.1f} to {(at + 1) * step:.1f}: {n}" for at, n in sorted(count.items()))
    return Chart(bars, edges, round(LEFT + threshold / step * each, 1), words)


def _shown(side: Side) -> Shown:
    kept, left = [], LONGEST
    for piece in side.pieces:
        kept += [piece._replace(text=piece.text[:left])] * (left > 0)
        left -= len(piece.text)
    return Shown(side.label, side.same, side.own, kept, max(0, -left))
