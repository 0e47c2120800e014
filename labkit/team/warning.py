"""A warning where what a team's robots see does not fit what a filter believes of them."""

import warnings

import numpy as np

from ..history import History


class FrameWarning(UserWarning):
    """The readings do not fit the estimate: it looks like a frame, but is not to be trusted."""


def warn_of(history: History, readings: list, ids: tuple, window: int = 100, share: float = 0.8) -> None:
    """A FrameWarning where most of an observer's last `window` readings lie beyond the filter's gate.

    readings: as a TeamLog's `measurements`.  None is given where the filter's d2 are not one number for each reading,
    where an observer has fewer readings, or where there is no gate.
    """
    steps: list[list] = [[] for _ in ids]  # of each one's readings
    beyond: list[list] = [[] for _ in ids]
    for k, (values, seen) in enumerate(zip(history.d2, readings), 1):
        if len(values) == len(seen) and all(np.ndim(value) == 0 for value in values):
            for (i, _, _), d2 in zip(seen, values):
                steps[i].append(k)
                beyond[i].append(not d2 < history.gate)
    for i, name in enumerate(ids):
        if len(steps[i]) < window:
            continue
        out = np.convolve(beyond[i], np.ones(window), "valid")  # among each `window` readings in a row
        if (out > share * window).any():
            first = int((out > share * window).argmax())
            step = steps[i][first + window - 1]
            warnings.warn_explicit(
                f"at step {step} of {len(readings)}, {out[first]:.0f} of the last {window} readings of robot {name} "
                "lie beyond the gate: from there on, this frame is not to be trusted",
                FrameWarning,
                filename="replay",
                lineno=step,
            )
