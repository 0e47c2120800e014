"""Where a filter takes what it needs: at which landmark, and at which estimate h and H are computed."""

import numpy as np

from .findings import Finding, close, number_text
from .single import Single


def nearest(single: Single) -> list[Finding]:
    """A measurement that is far off is taken for another landmark; the probes that show it then tell nothing else."""
    known = [id for id in single.pairs if id in ("one", "other") or id.startswith("at ")]
    if not {"near", "bent", "other"} <= single.pairs.keys() or single.probed.probes["near"]["first"] > 1:
        return []
    near, right = single.pairs["near"]
    if not close(near.moved, right.moved, 2e-2):
        return []  # it takes another one in any case
    for id, (a, r) in single.probed.both("").items():
        if not id.startswith(("bent", "far")) or close(a.moved, r.moved, 2e-2) or id.endswith("narrow"):
            continue
        for other in known:
            if single.name(other) != single.name(id) and close(a.moved, _moved_by(single, id, other), 1e-2):
                text = (
                    f"Landmark {single.entry(id)[0]!r}, seen at {number_text(single.seen(id))}, is taken for "
                    f"{single.name(other)}: find each in the map by its name, not by what lies nearest."
                )
                single.forget("near", "bent", "bent narrow")
                return [Finding("landmark", text, [a.moved])]
    return []


def _moved_by(single, id, other):
    """How far the estimate would move if what is seen were of another landmark."""
    part, near = single.right(other), single.right("near")
    scale = np.diag(np.sqrt(np.diag(part.R) / np.diag(single.right("other").R)))
    P, R = single.probed.right[id].P, scale @ near.R @ scale
    off = single.turned(single.seen(id) - single.expected(other))
    return P @ part.H.T @ np.linalg.solve(part.H @ P @ part.H.T + R, off)


def again(single: Single) -> list[Finding]:
    """What is computed once more at the corrected estimate: all, or only what the covariance is made of."""
    ids = ("near", "bent narrow", "bent", "more bent")
    if not single.pairs.keys() >= set(ids):
        return []
    P, x, pairs = single.probed.P, single.probed.x, [single.pairs[id] for id in ids]
    right = [all(map(_same, a.gain.T, r.gain.T)) for a, r in pairs]
    spread = [close(a.after, r.after, 2e-2) for a, r in pairs]
    if right[:2] == spread[:2] == [True, True] and not (right[2] and right[3]):
        text = (
            f"`update` depends on where {x} moves to: h and H are linearised again at the corrected estimate. "
            f"Such an iterated filter is sound, but here they are taken once, at {x} as it comes."
        )
        return [Finding("iterated", text, [a.gain for a, _ in pairs[2:]])]
    elsewhere = all(close(a.after, r.after, 2e-2) for a, r in single.tight.values())
    if all(right) and elsewhere and spread == [True, True, True, False]:
        text = (
            f"{P} depends on where {x} moves to: it must follow from the H and S of the gain, before {x} is corrected."
        )
        return [Finding("P", text, [pairs[3][0].after])]
    return []


def _same(came, right):
    """Whether two columns of gains are the same, however small."""
    size = np.abs(right).max()
    return close(came / size, right / size, 2e-2)


def after_predict(single: Single) -> list[Finding]:
    """What goes wrong after `predict` only, where `update` is right from the estimate that a filter starts with."""
    if not single.moved or "other" not in single.pairs:
        return []
    (a, r), old = single.moved, single.right("other")
    if close(a.gain, r.gain, 1e-2) and close(a.moved, r.moved, 1e-2):
        return []
    P, now = r.P, single.part(r)
    expected = [single.seen("moved") - np.linalg.pinv(b.gain) @ b.moved for b in (a, r)]
    before = close(single.turned(expected[0] - single.expected("other")), np.zeros(2), 1e-2)
    ways = [P @ old.H.T @ np.linalg.inv(old.H @ P @ old.H.T + R) for R in (old.R, now.R)]
    H_before = not close(a.gain, r.gain, 1e-2) and any(close(a.gain, way, 1e-2) for way in ways)
    if not (before or H_before):
        return []
    single.probed.fine.clear()
    what = " and H are those" if before and H_before else " is that"
    name = "H" if not before else "what is expected"
    text = f"After `predict`, {name}{what} of the estimate before it: take {single.probed.x} as `predict` left it."
    return [Finding("H" if not before else "h", text, [a.gain, a.moved])]
