"""How a filter's run differs from the right one: from which step on, and how far."""

import numpy as np

from ...checks.compare import gap_of
from ...history import History

FAR = 100  # [m] no run of a lab leads as far away


def first_gap(mine: History, right: History) -> tuple[int, float] | None:
    """(first step that differs, largest distance of the positions [m]), or None where the two agree.

    Means are held against the largest of the run, covariances, which grow and shrink, against their own step's.
    """
    far = gap_of(mine.x, right.x) > 1
    steps = enumerate(zip(mine.x, right.x, mine.P, right.P))
    wrong = [k for k, (x, due_x, P, due_P) in steps if gap_of(P, due_P) > 1 or (far and gap_of(x, due_x) > 1)]
    if not far and not wrong:
        return None
    return (wrong or [0])[0], float(np.linalg.norm((mine.x - right.x)[..., :2], axis=-1).max())


def how_far(apart: float) -> str:
    """How far off an estimate gets, as the end of a sentence; apart: the largest distance of the positions [m]."""
    if not apart < FAR:
        return f": it runs away, to more than {FAR} m"
    return f", by {apart:.2g} m" if apart >= 0.001 else "; the positions agree to the millimetre"
