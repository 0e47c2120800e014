"""What goes wrong only when several landmarks are in view at once: stacking, order, one R for all."""

from dataclasses import replace

import numpy as np

from .findings import Finding, acts, close, number_text
from .single import Single


def several(single: Single, found: list[Finding]) -> list[Finding]:
    """The first of the probes with two or three landmarks in view that goes wrong, but for what was found before."""
    before = {finding.part for finding in found}
    told = "With" if before else "One landmark at a time is right, but with"
    for id in ("two", "three", "two far"):
        words = f"{told} {id.split()[0]} in view"
        if id in single.probed.stops:
            return [Finding("several", f"{words} `update` {single.probed.stops[id]}")]
        due = None if before & {"measured", "wrap", "landmark"} else _due(single, id)
        if id in single.probed.mine and due:
            a = single.probed.mine[id]
            text = _wrong(single, a, due, before)
            if text:
                value = [part for part in (a.gain, a.moved, a.after) if part.size]
                return [Finding("several", f"{words} {text}", value)]
    return []


def _due(single, id):
    """What should come: the right answer, or where one landmark shows another H or R, what follows from these."""
    right = single.probed.right.get(id)
    if not right or single.gains:
        return right
    if id != "two" or not {"one", "other"} <= single.parts.keys():
        return None
    if single.scale * single.whole != 1 and single.probed.probes[id]["first"] > 1:
        return None  # one reading after the other: the second is seen from where the first led
    order = (single.parts["other"], single.parts["one"])  # as the probe shows them
    H, P, m = np.vstack([part.H for part in order]), right.P, len(order[0].R)
    S = (order[0].share(P) if single.whole == 1 else 1) * H @ P @ H.T
    for k, part in enumerate(order):
        S[k * m : (k + 1) * m, k * m : (k + 1) * m] += part.R
    if np.linalg.cond(S) > 1e5:  # where R is missing, what comes out depends on rounding
        return None
    gain = P @ H.T @ (np.linalg.inv(S) if single.inverted else S)
    return replace(right, gain=single.scale * single.whole * gain, after=P - gain @ S @ gain.T)


def _wrong(single, a, r, before):
    if not a.gain.size or not r.gain.size:
        if before:
            return ""
        # A filter that takes one landmark after the other may differ a little where it linearises.
        far = np.abs(a.moved - r.moved).max() > 0.5 * np.abs(r.moved).max() + 0.05
        moves = f"{single.probed.x} moves by {number_text(a.moved)}, right is {number_text(r.moved)}"
        told = f"and a bearing that is nearly a turn off, {moves}: is each landmark's bearing innovation wrapped?"
        return told if far else ""
    p = r.gain.shape[1] // 2
    dead = [str(k + 1) for k in range(p) if close(a.gain[:, 2 * k : 2 * k + 2], 0 * a.gain[:, 2 * k : 2 * k + 2])]
    if 0 < len(dead) < p:
        return f"number {', '.join(dead)} of the list has no effect."
    if not close(a.gain, r.gain):
        return f"the gain {acts(a.gain, r.gain)}: look at how H, R and the innovation are stacked."
    if not before and not close(a.moved, r.moved):
        moves = f"{single.probed.x} moves by {number_text(a.moved)} instead of {number_text(r.moved)}"
        return f"{moves}: is all in the same order?"
    return "" if before or close(a.after, r.after) else f"{single.probed.P} {acts(a.after, r.after)}."


def stopped(single: Single) -> list[Finding]:
    """Whether several landmarks in view end the update."""
    ids = [id for id in ("two", "three") if id in single.probed.stops][:1]
    return [Finding("several", f"With {id} in view `update` {single.probed.stops[id]}") for id in ids]
