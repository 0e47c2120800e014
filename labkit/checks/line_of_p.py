"""Whether the covariance after an update follows from the student's own gain, and if not, what stands in its line."""

from collections.abc import Mapping

import numpy as np

from ..geometry import Array
from .findings import Finding, acts, close
from .single import Part, Single


def covariance(single: Single) -> list[Finding]:
    """What is wrong in the line that sets the covariance; [] where it follows from the student's own gain, H and R."""
    ids = [id for id in ("one", "one P", "one R", "other") if id in single.pairs]
    followed, names = True, list(_WORDS)
    for id in ids:
        a, r = single.pairs[id]
        right = single.right(id)
        part = single.parts.get(id, right)
        gain = r.gain if single.blind else a.gain / single.scale
        followed = followed and any(close(a.after, way) for way in _right(a.P, gain, part, right))
        wrong = _wrong(a.P, gain, part)
        names = [name for name in names if wrong[name].shape == a.after.shape and close(a.after, wrong[name])]
    if followed or not ids:
        return []
    a, r = single.pairs["one"]
    if names and (single.gains or single.parts or names[0] == "kept"):
        return [Finding("P", _WORDS[names[0]].replace("Pk_k", single.probed.P), [a.after])]
    if single.gains:
        text = f"The gain is right, but {single.probed.P} after `update` {acts(a.after, r.after)}"
        return [Finding("P", f"{text}{_flaw(a.after)}: look at the line that sets it.", [a.after])]
    if single.parts:
        text = f"{single.probed.P} does not follow from your gain either: look at the line that sets it, too"
        return [Finding("P", f"{text}{_flaw(a.after)}.", [a.after])]
    return []


def _flaw(P):
    """What no covariance is, in words."""
    if (np.diag(P) < 0).any():
        return ", which has negative variances"
    return "" if close(P, P.T) else ", which is not symmetric, as a covariance is (is a transpose missing?)"


def _right(P, K, part, right):
    """What may stand for the new covariance: each form, with the student's own parts and with right ones."""
    ways = []
    for H in (part.H, right.H):
        A = np.eye(len(P)) - K @ H
        for R in (part.R, right.R):
            ways += [P - K @ (H @ P @ H.T + R) @ K.T, A @ P, A @ P @ A.T + K @ R @ K.T]
    return [*ways, P - K @ part.S @ K.T]


_WORDS = {
    "kept": "`update` leaves Pk_k as it was: a measurement makes the position more certain.",
    "grown": "Pk_k grows in `update`: K S K' is subtracted. (With (I - K H) P, look at the sign of H.)",
    "replaced": "Pk_k is replaced by K S K': that is what the measurement takes away from P.",
    "no P": "P is missing in the new covariance: it is (I - K H) P, not I - K H.",
    "K H": "K H is not a covariance: what the measurement takes away from P is K H P (or K S K').",
    "R for S": "Pk_k is updated with K R K': it is P - K S K', with S = H P H' + R.",
    "no S": "S is missing in the new covariance: it is P - K S K'.",
    "half": "The second half of the Joseph form is missing: (I - K H) P (I - K H)' + K R K'.",
    "no H": "Pk_k is computed as (I - K) P: H is missing, it is (I - K H) P.",
    "no K'": "The second K is missing in the new covariance: it is P - K S K'.",
}


def _wrong(P: Array, K: Array, part: Part) -> Mapping[str, Array]:
    """Wrong forms of the line that sets the covariance."""
    H, R, S, one = part.H, part.R, part.S, np.eye(len(P))
    A, square = one - K @ H, K.shape[0] == K.shape[1]
    return {
        "kept": P,
        "grown": P + K @ S @ K.T,
        "replaced": K @ S @ K.T,
        "no P": A,
        "K H": P - K @ H,
        "R for S": P - K @ R @ K.T,
        "no S": P - K @ K.T,
        "half": A @ P @ A.T,
        "no H": (one - K) @ P if square else np.zeros(0),
        "no K'": P - K @ S if square else np.zeros(0),
    }
