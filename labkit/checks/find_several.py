"""What goes wrong only when several landmarks are in view at once: stacking, order, one R for all."""

from dataclasses import replace

import numpy as np

from .findings import Finding, acts, close, number_text
from .single import Single
from .wraps import shows_angles

FOLLOWS = "Singular matrix", "no finite number"  # where something else is wrong as well


def several(single: Single, found: list[Finding]) -> list[Finding]:
    """The first of the probes with two or three landmarks in view that goes wrong, but for what was found before."""
    before = {finding.part for finding in found}
    told = "With" if before else "One landmark at a time is right, but with"
    for id in ("two", "three"):
        words = f"{told} {id} in view"
        if id in single.probed.stops and id not in single.probed.mine:
            if "entries" in before or before and any(word in single.probed.stops[id] for word in FOLLOWS):
                return []  # that product stops with several landmarks, and a wrong S may have no inverse
            return [Finding("several", f"{words} `update` {single.probed.stops[id]}")]
        if id in single.probed.mine:
            a = single.probed.mine[id]
            text = _dead(a) or _moves(single, a, before) or _differs(single, id, _due(single, id, before), before)
            if text:
                value = [part for part in (a.gain, a.moved, a.after) if part.size]
                return [Finding("several", f"{words} {text}", value)]
    text = "" if before & {"wrap", "measured"} or {"h", "H"} <= before else _far(single)
    return [Finding("several", f"{told} two in view {text}", [np.ones(1)])] if text else []


def _dead(a):
    p = a.gain.shape[1] // 2
    dead = [str(k + 1) for k in range(p) if close(a.gain[:, 2 * k : 2 * k + 2], 0 * a.gain[:, 2 * k : 2 * k + 2])]
    return f"number {', '.join(dead)} of the list has no effect." if 0 < len(dead) < p else ""


def _moves(single, a, before):
    """All is measured as it should be expected: nothing may move, whatever the gain."""
    if "what is expected" not in single.probed.fine or single.replaced:
        return ""
    moves = f"{single.probed.x} moves by {number_text(a.moved)} where all is measured as expected"
    return f"{moves}: is all in the same order?" if np.abs(a.moved).max() > 1e-4 else ""


def _due(single, id, before):
    """What should come: the right answer, or where one landmark shows another gain, what follows from its parts."""
    right = single.probed.right.get(id)
    if not right or before & {"measured", "wrap"} or single.blind:
        return None
    if single.probed.probes[id]["first"] > 1 and ("h" in before or single.scale * single.whole != 1):
        return None  # one reading after the other: the second is seen from where the first led
    if "landmark" in before and not close(single.right("one").H, single.right("other").H):
        return None
    if single.gains:
        return right
    if id != "two" or not {"one", "other"} <= single.parts.keys():
        return None
    order = (single.parts["other"], single.parts["one"])  # as the probe shows them
    if any(close(part.R, part.R[0, 0] + 0 * part.R) for part in order):
        return None  # one number everywhere: it may stand between the landmarks as well
    H, P, m = np.vstack([part.H for part in order]), right.P, len(order[0].R)
    S = single.share * H @ P @ H.T
    for k, part in enumerate(order):
        S[k * m : (k + 1) * m, k * m : (k + 1) * m] += part.R
    if np.linalg.cond(S) > 1e5:  # where R is missing, what comes out depends on rounding
        return None
    gain = single.form.gain(P, H, S) @ np.kron(np.eye(2), single.way)
    return replace(right, gain=single.scale * single.whole * gain, after=P - gain @ S @ gain.T)


def _differs(single, id, r, before):
    a = single.probed.mine[id]
    if single.blind and single.covariances:
        right = single.probed.right[id].after
        return "" if close(a.after, right) else f"{single.probed.P} {acts(a.after, right)}."
    if not r or not np.isfinite(r.gain).all():
        return ""
    if single.probed.probes[id]["first"] > 1 and before:
        return ""  # one reading after the other: it follows from what is wrong with the first
    if "h" in before and ("H" in before or np.abs(a.gain).max() > 20 * np.abs(r.gain).max()):
        return ""  # it may be another landmark's, or a jump of what is expected
    if before and not shows_angles(single):
        return ""  # whose H that is cannot be told
    if not close(a.gain, r.gain):
        if before and close(a.after, r.after):
            return ""  # P tells that H and R are stacked right; what is wrong with one may well be all
        text = f"the gain {acts(a.gain, r.gain)}"
        known = single.stacks and not before
        return f"{text}: look at how H, R and the innovation are stacked." if known else f"{text}."
    return "" if before or close(a.after, r.after) else f"{single.probed.P} {acts(a.after, r.after)}."


def _far(single):
    """A bearing nearly a turn off moves the estimate as the same gain says, beside another landmark."""
    near, far = (single.probed.mine.get(id) for id in ("two", "two far"))
    if not (near and far) or near.gain.shape[1] != 4 or not shows_angles(single):
        return ""
    seen = [single.probed.probes[id]["calls"][-1][1]["landmarks"][-1][1:] for id in ("two far", "two")]
    due = near.moved + near.gain[:, 2:] @ single.turned(np.subtract(*seen))
    # A filter that takes one landmark after the other may differ a little where it linearises.
    if np.abs(far.moved - due).max() <= 0.5 * np.abs(due).max() + 0.05:
        return ""
    moves = f"{single.probed.x} moves by {number_text(far.moved)}, but by its own gain it should by {number_text(due)}"
    return f"and a bearing that is nearly a turn off, {moves}: is each landmark's bearing innovation wrapped?"
