"""What is wrong in a filter's `update`, read off the answers to probes with one landmark or reading in view."""

import numpy as np

from .find_estimate import innovation, instead, no_effect, replaced
from .find_gate import in_gain_only, surprises
from .find_places import after_predict, again, nearest
from .find_several import several
from .findings import Finding, Probed, acts, close, number_text, trait
from .gains import explained
from .line_of_p import covariance, hidden
from .single import Single
from .wraps import far, headings

AFTER_THE_GATE = ("gain", "sign", "estimate", "P", "several")


def update(probed: Probed) -> list[Finding]:
    """The wrong quantities of `update`, in the order of its lines."""
    single = Single(probed)
    found = [*_empty(probed), *_corrections(single)]
    found = in_gain_only(single, found)
    gate = [] if any(f.part == "stops" for f in found) else surprises(single)
    if single.blind and any(f.part == "gate" for f in gate):  # nothing was let pass
        found = [f for f in found if f.part not in ("estimate", "P")]
    later = next((k for k, f in enumerate(found) if f.part in AFTER_THE_GATE), len(found))
    return [*found[:later], *gate, *found[later:], *headings(probed, "update")]


def _empty(probed):
    if "empty" in probed.stops:
        return [Finding("empty", f"With nothing in view, `update` {probed.stops['empty']}", [])]
    for answer, _ in probed.both("empty").values():
        still = close(answer.moved, 0 * answer.moved)
        if not (still and close(answer.after, answer.P)):
            text = (
                f"With nothing in view, `update` must change nothing; yours changes {probed.P if still else probed.x}."
            )
            return [Finding("empty", text, [answer.moved, answer.after])]
    return []


def _corrections(single):
    stops = _stops(single) if "one" in single.probed.stops else []
    if "one" not in single.pairs:
        return stops
    found = _of_Q(single, stops + _of_one(single))
    return found + several(single, found)


def _of_Q(single, found):
    """The findings, with Q in place of a gain and a covariance that change with it."""
    (a, _), (more, _) = (single.probed.both(id).get(id, (None, None)) for id in ("one", "one Q"))
    if not (a and more) or close(a.gain, more.gain) or not any(f.part == "gain" for f in found):
        return found
    text = "`self.Q` has an effect on the gain in `update`: the robot moves in `predict`, and Q belongs there alone."
    return [Finding("Q in update", text, [a.gain]), *(f for f in found if f.part not in ("gain", "P"))]


def _stops(single):
    """What ends the update; a matrix (n, n) that has become of an estimate (n,) can be read, and the rest with it."""
    text = f"`update` {single.probed.stops['one']}"
    matrix = single.probed.mine["one"].matrix if "one" in single.pairs else ""
    if not matrix:
        return [Finding("stops", text)]
    how = {
        "column": "a column (n, 1) is added to it",
        "entries": "`*` multiplies entry by entry, the product of a matrix and a vector is `@`",
    }
    text = f"{text[:-1]}: {how[matrix]}."
    return [Finding(matrix, text, [np.array(1.0)])]


def _of_one(single):
    """The wrong quantities that one landmark at a time shows."""
    if single.blind:
        return [no_effect(single), *hidden(single)]
    if elsewhere := nearest(single):
        return elsewhere + _of_one(single)
    if found := again(single):
        return found
    if not single.straight:
        found = _bent(single)
        if not all(close(a.gain, r.gain, 2e-2) for a, r in single.tight.values()):
            return found + hidden(single)
        found += _expected(single)
        single.parts = {id: single.right(id) for id in single.steps & single.tight.keys()}
        return found + ([] if single.covariances else covariance(single))
    found = _of_estimate(single)
    if not single.gains:
        known = {f.part for f in found}
        found += innovation(single, "wrap" in known) if single.covariances else explained(single, "h" in known)
    if not single.covariances:
        found += covariance(single)
    return found or after_predict(single)


def _of_estimate(single):
    """What is expected, how far innovations are brought home, and whether the correction is added."""
    other = replaced(single)
    if other and not single.replaced:
        return other
    found = _expected(single)
    if found and not other:  # where the gain is the same for all P, another reading is as good
        single.replaced = True
        if not _expected(single) and "what is expected" in single.probed.fine:
            return [*far(single), instead(single)]
        single.replaced = False
    return found + far(single) + other


def _bent(single):
    """How the estimate follows a measurement depends on that measurement itself."""
    a, r = single.pairs["bent"]
    gain, HP = single.pairs["one"][0].gain, r.H @ r.P
    back = np.linalg.pinv(HP)
    S = back.T @ (a.P - a.after) @ back  # the inverse of S, where H is right
    R, due = np.linalg.pinv(S) - r.H @ HP.T, single.right("bent").R
    if close(HP.T @ S @ HP, a.P - a.after) and not close(R, due):
        text = f"R {acts(R, due)} where another range is measured than expected: R belongs to the expected one."
        return [Finding("measured", text, [gain])]
    covariances = single.covariances and close(a.after, r.after)
    told = f"{single.probed.P} comes out right, so H and R are; " * covariances
    told += "the gain changes with what was measured, although all but the innovation comes from the estimate: "
    told += "is the landmark of the map used, and not that of" if single.stacks else "is nothing used of"
    gated = "gate" in single.probed.probes["one"]["make"][1]  # in these labs R depends on the range
    told += " the measurement, in what is expected" + (
        "?" if covariances else ", in H and in R?" if gated else " and in H?"
    )
    return [Finding("measured", told[0].upper() + told[1:], [gain])]


def _expected(single):
    """The first landmark of which something else is expected than should be."""
    came, rights = {}, {}
    for id, (a, _) in single.tight.items():
        if id in ("one", "other") or id.startswith("at "):
            if close(a.gain, 0 * a.gain):
                name = single.name(id)
                text = f"{name[0].upper()}{name[1:]} has no effect on {single.probed.x}, others have: is it left out?"
                return [Finding("landmark", text, [np.array(0.0)])]
            for j in range(a.gain.shape[1]):
                if close(a.gain[:, j], 0 * a.gain[:, j]):
                    text = f"The {single.probed.rows[j]} that was measured has no effect on {single.probed.x}."
                    return [Finding("innovation", text, [np.array(j)])]
            if not close(a.gain @ single.off(id), a.moved + single.replaced * a.x) or np.linalg.cond(a.gain) > 1e7:
                return []
            came[id], rights[id] = single.seen(id) - single.off(id), single.expected(id)
    for id in came:
        off = np.abs(single.turned(came[id] - rights[id]))
        wrong = [j for j in range(len(off)) if off[j] > 5e-3 * max(abs(rights[id][j]), 0.1)]
        if wrong:
            came = {i: rights[i] + single.turned(came[i] - rights[i]) for i in came}
            return [_unexpected(single, id, came, rights, wrong)]
    single.probed.fine.append("what is expected")
    return []


def _other(single, came, id, rights):
    """The probe whose landmark is expected instead, or ''."""
    others = (one for one in rights if single.name(one) != single.name(id) and close(came, rights[one]))
    return next(others, "")


def _unexpected(single, id, came, rights, wrong):
    single.taken = {one: other for one in rights if (other := _other(single, came[one], one, rights))}
    if id in single.taken:
        names = f"What is expected of {single.name(id)} is that of {single.name(single.taken[id])}"
        more = [single.probed.mine[id].moved for id in ("two", "three") if id in single.probed.mine]
        return Finding("landmark", f"{names}: find each in the map by its name.", [*came.values(), *more])
    at = f"of {single.name(id)}, from {single.probed.x} = {number_text(single.pairs[id][0].x)},"
    if len(wrong) == 2:
        how = trait(list(came.values()), list(rights.values()))
        told = f"The expected measurement {at} {acts(came[id], rights[id], how)}"
        told += "" if how else " (or what was seen is off by as much)"
        return Finding("h", f"{told}.", list(came.values()))
    j, other = wrong[0], 1 - wrong[0]
    sure = all(abs(single.turned(came[i] - rights[i])[other]) < 5e-3 * max(abs(rights[i][other]), 0.1) for i in came)
    told = f" (the {single.probed.rows[other]} is right)" * sure
    text = f"The expected {single.probed.rows[j]} {at} {acts(came[id][j], rights[id][j])}{told}."
    return Finding("h", text, list(came.values()))
