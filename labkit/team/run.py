"""A filter's way through what a team recorded, and a warning where the readings do not fit it."""

import warnings

import numpy as np

from ..feedback import FilterError, explain


def replay(kf, log):
    """Run a filter over a TeamLog: (poses (N+1, n, 3), covariances (N+1, 3n, 3n)).

    kf: any object with `predict(u)`, u (n, 3), `update(seen)`, a list of (observer, target, z), and the fields
    x (n, 3) and P (3n, 3n).  If it has `d2`, of the readings of the last update, and `gate`, a FrameWarning tells when
    an observer's readings contradict it.  Raises FilterError, with the step and the student's own line, if it raises, or if what
    it leaves in x and P is no estimate.
    """
    n, k, judged = log.n, -1, []
    x, P = np.empty((len(log) + 1, n, 3)), np.empty((len(log) + 1, 3 * n, 3 * n))
    try:
        x[0], P[0] = kf.x, kf.P
        for k, (u, seen) in enumerate(zip(log.odometry, log.seen())):
            kf.predict(u)
            kf.update(seen)
            x[k + 1], P[k + 1] = kf.x, kf.P
            judged.append(getattr(kf, "d2", ()))
    except NotImplementedError as error:
        raise FilterError(explain(error)) from error
    except Exception as error:
        shapes = f"x has the shape {np.shape(getattr(kf, 'x', None))}, P {np.shape(getattr(kf, 'P', None))}"
        problem = (
            explain(error)
            if shapes == f"x has the shape {(n, 3)}, P {(3 * n, 3 * n)}"
            else f"{shapes}: they should be {(n, 3)} and {(3 * n, 3 * n)}."
        )
        raise FilterError(f"Your filter stopped in step {k + 1} of {len(log)}.\n{problem}") from error
    bad = ~(np.isfinite(x).all(axis=(1, 2)) & np.isfinite(P).all(axis=(1, 2)))
    if bad.any():
        raise FilterError(
            f"After step {int(bad.argmax())} of {len(log)} your filter's estimate is not a number."
        )
    _warn_of(judged, log, getattr(kf, "gate", np.inf))
    return x, P


class FrameWarning(UserWarning):
    """The readings do not fit the estimate: it looks like a frame, but is not to be trusted."""


def _warn_of(judged, log, gate, window=100, share=0.8):
    """judged: the d2 of each step's readings, as the filter kept them; any other list is no reason to warn."""
    steps, left_out = {i: [] for i in range(log.n)}, {i: [] for i in range(log.n)}  # of each one's readings
    for k, (values, seen) in enumerate(zip(judged, log.seen()), 1):
        if np.shape(values) == (len(seen),):
            for (i, _, _), d2 in zip(seen, values):
                steps[i].append(k)
                left_out[i].append(not d2 < gate)
    for i, name in enumerate(log.ids):
        if len(steps[i]) < window:
            continue
        out = np.convolve(left_out[i], np.ones(window), "valid")  # among each `window` readings in a row
        if (out > share * window).any():
            first = int((out > share * window).argmax())
            step = steps[i][first + window - 1]
            warnings.warn_explicit(
                f"up to step {step} of {len(log)}, {out[first]:.0f} of {window} readings of robot {name} lie beyond the gate: "
                "from there on, this frame is not to be trusted",
                FrameWarning,
                filename="replay",
                lineno=step,
            )
