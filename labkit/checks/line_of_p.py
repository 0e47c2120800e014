"""Whether the covariance after an update follows from the student's own gain, and if not, what stands in its line."""

from collections.abc import Mapping
from copy import copy
from dataclasses import replace

import numpy as np

from ..geometry import Array
from .findings import Finding, acts, close
from .forms import FORMS, covariances
from .gain_words import noise
from .gains import explained, settled
from .single import Part, Single


def covariance(single: Single) -> list[Finding]:
    """What is wrong in the line that sets the covariance; [] where it follows from the student's own gain, H and R."""
    ids = [id for id in ("one", "one P", "one R", "other") if id in single.pairs]
    followed, names = _follows(single, ids)
    if followed or not ids:
        return []
    a, r = single.pairs["one"]
    if names and (single.gains or single.parts or names[0] == "kept"):
        return [Finding("P", _WORDS[names[0]].replace("Pk_k", single.probed.P), [a.after])]
    if other := _other_S(single, ids):
        return other
    if single.gains:
        text = f"The gain is right, but {single.probed.P} after `update` {acts(a.after, r.after)}"
        return [Finding("P", f"{text}{_flaw(a.after)}: look at the line that sets it.", [a.after])]
    if single.parts:
        text = f"{single.probed.P} does not follow from your gain either: look at the line that sets it, too"
        return [Finding("P", f"{text}{_flaw(a.after)}.", [a.after])]
    return []


def _other_S(single, ids):
    """What R stands in the S by which the covariance shrinks, if that is not the gain's."""
    if not {"one", "one P", "one R", "other"} <= single.parts.keys():
        return []
    parts = {}
    for id in ids:
        a, part = single.pairs[id][0], single.parts[id]
        back = np.linalg.pinv(a.gain / single.scale)
        S = back @ (a.P - a.after) @ back.T
        if not (close(S, S.T, 1e-2) and np.linalg.cond(a.gain) < 1e6):
            return []
        parts[id] = replace(part, S=S, R=S - part.H @ a.P @ part.H.T)
    if not settled(single, parts) or not (found := noise(single, parts)):
        return []
    return [Finding("R", f"{single.probed.P} does not shrink by the S of the gain: {found[0].text}", found[0].value)]


def hidden(single: Single) -> list[Finding]:
    """What the covariances show, where the estimates do not show the gain: their own line, or what S is made of."""
    if single.covariances:
        return []
    ids = [id for id in ("one", "one P", "one R", "other") if id in single.pairs]
    seen = copy(single)
    seen.pairs = {id: (replace(a, gain=r.gain), r) for id, (a, r) in single.pairs.items()}
    _, names = _follows(seen, ids)
    if names:
        return [Finding("P", _WORDS[names[0]].replace("Pk_k", single.probed.P), [single.pairs["one"][0].after])]
    for id, (a, r) in single.pairs.items():
        shrunk = (a.P - a.after) @ np.linalg.pinv(r.H @ a.P)
        seen.pairs[id] = (replace(a, gain=shrunk), r)
    found = explained(seen, h_is_wrong=True)
    if [finding.part for finding in found] != ["R"]:
        return []
    came, due = seen.parts["one"].R, single.right("one").R
    if not _share(came, due) and close(_correlation(came), _correlation(due), 2e-2):
        return []  # a row of H that is scaled, turned or exchanged looks like that
    text = f"{single.probed.P} comes out as with another R, if H is right: {found[0].text}"
    return [Finding("R", text)]


def _share(came, due):
    return close(came, due * np.sum(came * due) / np.sum(due**2), 2e-2)


def _correlation(R):
    """How far two errors go together (), whatever their sizes and signs."""
    return np.abs(R[0, 1]) / np.sqrt(np.abs(R[0, 0] * R[1, 1]))


def _follows(single, ids):
    """Whether the covariance after follows from the gain by a right line, and the names of wrong ones that it does."""
    followed, names = True, list(_WORDS)
    for id in ids:
        a, right = single.pairs[id][0], single.right(id)
        part = single.parts.get(id, right)
        gains = [a.gain / single.scale, FORMS[0].gain(a.P, part.H, part.S)]
        gains = [gain for gain in gains if gain.shape == a.gain.shape and np.isfinite(gain).all()]
        followed = followed and any(close(a.after, way) for gain in gains for way in _right(a.P, gain, part, right))
        wrong = [_wrong(a.P, gain, part) for gain in gains]
        names = [name for name in names if any(_is(a.after, ways[name]) for ways in wrong)]
    return followed, names


def _is(came, way):
    return way.shape == came.shape and close(came, way)


def _flaw(P):
    """What no covariance is, in words."""
    if (np.diag(P) < 0).any():
        return "; what came has negative variances"
    return "" if close(P, P.T) else "; what came is not symmetric, as a covariance is (is a transpose missing?)"


def _right(P, K, part, right):
    """What may stand for the new covariance: each form, with the student's own parts and with right ones."""
    return [way for H in (part.H, right.H) for R in (part.R, right.R) for way in covariances(P, K, H, R, part.S)]


_WORDS = {
    "kept": "`update` leaves Pk_k as it was: a measurement makes the position more certain.",
    "grown": "Pk_k grows in `update`: K S K' is subtracted. (With (I - K H) P, look at the sign of H.)",
    "replaced": "Pk_k is replaced by K S K': that is what the measurement takes away from P.",
    "no P": "P is missing in the new covariance: it is (I - K H) P, not I - K H.",
    "K H": "K H is not a covariance: what the measurement takes away from P is K H P (or K S K').",
    "R for S": "Pk_k comes out as P - K R K', as if R and S had changed places: it is P - K S K', or in Joseph's form "
    "(I - K H) P (I - K H)' + K R K'.",
    "mixed": "Pk_k comes out as (I - K H) P + K R K', or P - K H P H' K': it is (I - K H) P (I - K H)' + K R K', "
    "or P - K S K'.",
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
        "mixed": A @ P + K @ R @ K.T,
        "no S": P - K @ K.T,
        "half": A @ P @ A.T,
        "no H": (one - K) @ P if square else np.zeros(0),
        "no K'": P - K @ S if square else np.zeros(0),
    }
