"""What a late hand-in costs."""

from ..report.texts import counted, plain
from .course import Late

EXACT = 1e-6  # of a hundredth of a point: products of decimals are off by less


def less(late: Late, days: int, reached: float, possible: float) -> float:
    """The points that are taken of those `reached`, in whole hundredths, never more than there are."""
    most = float("inf") if late.cap is None else late.cap
    if late.points:
        amount = min(days * late.points, most)
    else:
        amount = min(days * late.percent, most, 100) / 100 * (possible if late.possible else reached)
    return max(0.0, min(int(100 * amount + EXACT) / 100, reached))


def rate(late: Late, possible: float) -> str:
    """'10 % a day, at most 50 %', as a student reads it."""
    if late.points:
        return f"{counted(late.points, 'point')} a day" + (
            f", at most {plain(late.cap)}" if late.cap is not None else ""
        )
    of = f" of all {plain(possible, 2)} points" if late.possible else ""
    return f"{plain(late.percent)} %{of} a day" + (f", at most {plain(late.cap)} %" if late.cap is not None else "")
