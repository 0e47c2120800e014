"""A filter's way through what a team recorded, and a warning where the readings do not fit it."""

import warnings

import numpy as np

from ..checks.feedback import FilterError, explain


def replay(kf, log):
    """Run a filter over a TeamLog: (poses (N+1, n, 3), covariances (N+1, 3n, 3n)).

    kf: any object with `predict(u)`, u (n, 3), `update(seen)`, a list of (observer, target, z), and the fields
    x (n, 3) and P (3n, 3n).  If it has `d2`, of the readings of the last update, and `gate`, a FrameWarning tells when
    most of an observer's last hundred readings contradict it (so none where there are fewer, or no gate).
    Raises FilterError, with the step and the student's own line, if it raises, or if what it leaves in x and P is no
    estimate: other shapes, not a number, a variance below zero.
    """
    n, k, judged = log.n, -1, []
    x, P = np.empty((len(log) + 1, n, 3)), np.empty((len(log) + 1, 3 * n, 3 * n))
    try:
        x[0], P[0] = _estimate(kf, n)
        for k, (u, seen) in enumerate(zip(log.odometry, log.seen())):
            kf.predict(u)
            kf.update(seen)
            x[k + 1], P[k + 1] = _estimate(kf, n)
            d2 = getattr(kf, "d2", ())
            judged.append(list(d2) if isinstance(d2, list | tuple | np.ndarray) else [])
    except NotImplementedError as error:
        raise FilterError(explain(error)) from error
    except Exception as error:
        problem = _misshapen(kf, n) or explain(error)
        raise FilterError(f"Your filter stopped in step {k + 1} of {len(log)}.\n{problem}") from error
    bad = ~(np.isfinite(x).all(axis=(1, 2)) & np.isfinite(P).all(axis=(1, 2)))
    if bad.any():
        raise FilterError(f"After step {int(bad.argmax())} of {len(log)} your filter's estimate is not a number.")
    if (bad := np.diagonal(P, axis1=1, axis2=2).min(axis=1) < -1e-9).any():
        raise FilterError(f"After step {int(bad.argmax())} of {len(log)} a variance in your filter's P is negative.")
    _warn_of(judged, log, getattr(kf, "gate", np.inf))
    return x, P


def _estimate(kf, n):
    """X and P of a filter; arrays of other shapes would be spread over all robots without a word."""
    x, P = kf.x, kf.P
    if (np.shape(x), np.shape(P)) != ((n, 3), (3 * n, 3 * n)):
        raise ValueError(_misshapen(kf, n))
    return x, P


def _misshapen(kf, n):
    shapes = np.shape(getattr(kf, "x", None)), np.shape(getattr(kf, "P", None))
    due = (n, 3), (3 * n, 3 * n)
    if shapes == due:
        return ""
    return f"x has the shape {shapes[0]}, P {shapes[1]}: they should be {due[0]} and {due[1]}."


class FrameWarning(UserWarning):
    """The readings do not fit the estimate: it looks like a frame, but is not to be trusted."""


def _warn_of(judged, log, gate, window=100, share=0.8):
    """judged: the d2 of each step's readings, as the filter kept them; any other list is no reason to warn."""
    steps, left_out = {i: [] for i in range(log.n)}, {i: [] for i in range(log.n)}  # of each one's readings
    for k, (values, seen) in enumerate(zip(judged, log.seen()), 1):
        if len(values) == len(seen) and all(np.ndim(value) == 0 for value in values):
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
