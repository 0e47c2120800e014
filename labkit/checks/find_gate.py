"""What a filter makes of surprises: d2, the list of them that it keeps, and the gate."""

import numpy as np

from .findings import Finding, acts, close, number_text
from .single import Part, Single

KNOWN = "other"  # the probe that shows what those of the gate show
KEPT = ("one", "one P", "one R", "other")  # whose d2 are read


def surprises(single: Single) -> list[Finding]:
    """What is wrong with d2, with the list of them, and with the gate, of a filter that has these."""
    if not single.probed.both("d2 one"):
        return []
    return [*_value(single), *_list(single), *_gate(single)]


def in_gain_only(single: Single, found: list[Finding]) -> list[Finding]:
    """Where d2 comes out right, so does S: what was read off the gain is then told of the gain alone."""
    off = [f for f in found if f.part in ("R", "H P H'")]
    lists = {id: _kept(single, f"d2 {id}") for id in KEPT}
    if not off or not single.probed.both("d2 one"):
        return found
    if not all(kept and close(kept[0], kept[1], 1e-4) for kept in lists.values()):
        return [_open(single, f, lists) for f in found]
    if all(close(part.S, single.right(id).S, 1e-2) for id, part in single.parts.items() if id in KEPT):
        return found  # it is off elsewhere only
    came, right = single.parts["one"].S, single.right("one").S
    text = f"`self.d2` comes out right, so S is; what stands in its place in the gain {acts(came, right)}."
    told = Finding("gain", text, [part.S for id, part in single.parts.items() if id in KEPT])
    return [told if f is off[0] else f for f in found if f not in off[1:]]


def _open(single, finding, lists):
    """Where H P H' is missing in the gain, and d2 is that of another S, S itself may be right."""
    parts = {id: part for id, part in single.parts.items() if id in KEPT}
    own = {id: np.full(1, _square(single.off(id), part)) for id, part in parts.items()}
    if (
        finding.part != "H P H'"
        or finding.value[0][0]
        or all(lists[id] and id in own and close(lists[id][0], own[id], 2e-2) for id in KEPT)
    ):
        return finding
    came, right = single.parts["one"].S, single.right("one").S
    text = f"H P H' is missing in what the gain inverts: that {acts(came, right)}."
    return Finding("gain", text, [np.array(0.0)])


def _kept(single, id):
    """(the list of d2 of the student's filter, of the right one), or None where the probe was not answered."""
    for answer, right in single.probed.both(id).values():
        if "d2" in answer.fields:
            return answer.fields["d2"].ravel(), right.fields["d2"].ravel()
    return None


def _passes(answer):
    """Whether what was seen changed anything."""
    return not (close(answer.moved, 0 * answer.moved) and close(answer.after, answer.P, 1e-9))


def _value(single):
    """The d2 of one landmark or reading: as its innovation, H and R make it, whatever these are."""
    lists = {id: _kept(single, f"d2 {id}") for id in KEPT}
    if not all(kept and kept[0].shape == (1,) for kept in lists.values()) or not single.pairs.keys() >= set(KEPT):
        return []
    if not all(_straight(single.pairs[id][0]) for id in KEPT):
        return []
    came = {id: kept[0] for id, kept in lists.items()}
    right = {id: kept[1] for id, kept in lists.items()}
    if all(close(came[id], right[id], 1e-2) for id in KEPT):
        return []
    if single.blind:
        parts, offs = {id: single.right(id) for id in KEPT}, {id: _nu(single, id) for id in KEPT}
        own = []
    elif single.covariances and not single.gains:  # H and R are right, and what acts as the innovation may be in d2 too
        ways = {id: np.linalg.pinv(single.pairs[id][1].gain) @ single.pairs[id][0].moved for id in KEPT}
        own = [{id: _square(nu, single.right(id)) for id, nu in ways.items()}]
        own += [{id: _square(single.off(id), single.right(id)) for id in KEPT}]
        parts, offs = {id: single.right(id) for id in KEPT}, {id: _nu(single, id) for id in KEPT}
    elif set(KEPT) <= single.parts.keys():
        parts, offs = single.parts, {id: single.off(id) for id in KEPT}
        own = [{id: _square(offs[id], parts[id]) for id in KEPT}]
    else:
        return []
    if any(all(close(came[id][0], d2[id], 2e-2) for id in KEPT) for d2 in own):
        return []
    due = {id: _square(offs[id], parts[id]) for id in KEPT}
    forms = {id: _forms(offs[id], parts[id]) for id in KEPT}
    words = [name for name in forms["one"] if all(close(came[id][0], forms[id][name], 1e-2) for id in KEPT)]
    if single.blind and not (words and single.covariances or words == ["no R"]):  # who knows what is expected, or S
        return []
    how = f": {_WORDS[words[0]]}" if words else ""
    text = f"`self.d2` {acts(came['one'][0], np.array(due['one']))}{how}."
    return [Finding("R" if words == ["no R"] else "d2", text, [came[id] for id in KEPT])]


def _straight(answer):
    """Whether the estimate moves along the gain: where a heading went past 180 degrees, no innovation can be read."""
    return close(answer.gain @ np.linalg.pinv(answer.gain) @ answer.moved, answer.moved, 2e-2)


def _nu(single, id):
    return np.linalg.pinv(single.pairs[id][1].gain) @ single.pairs[id][1].moved


def _square(nu, part):
    return float(nu @ np.linalg.pinv(part.S) @ nu)


def _forms(nu, part: Part):
    """What may stand for d2, by name; 'd2' is the right one."""
    inverse = np.linalg.pinv
    d2 = float(nu @ inverse(part.S) @ nu)
    return {
        "d2": d2,
        "root": np.sqrt(d2),
        "R": nu @ inverse(part.R) @ nu,
        "no R": nu @ inverse(part.S - part.R) @ nu,
        "plain": nu @ nu,
        "length": np.sqrt(nu @ nu),
        "S": nu @ part.S @ nu,
        "diagonal": nu**2 @ (1 / np.diag(part.S)),
        "range": nu[0] ** 2 / part.S[0, 0],
        "bearing": nu[1] ** 2 / part.S[1, 1],
        "half": d2 / 2,
    }


_WORDS = {
    "root": "that is the square root",
    "R": "that is with R in the place of S = H P H' + R",
    "no R": "R is missing in the S that it takes",
    "plain": "that is the plain square of the innovation, without S",
    "length": "that is the plain length of the innovation, without S",
    "S": "S is not inverted",
    "diagonal": "only the diagonal of S is used",
    "range": "only the range counts",
    "bearing": "only the bearing counts",
    "half": "that is half of it",
}


def _list(single):
    """How the d2 are kept: all of this update, also those that the gate leaves out, and none of those before."""
    counts = {id: _kept(single, f"d2 {id}") for id in ("one", "both", "empty", "again", "gated")}
    if not counts["one"] or not counts["both"]:
        return []
    size = {id: len(kept[0]) if kept else 0 for id, kept in counts.items()}
    if not size["one"]:
        text = "`self.d2` stays empty: keep the d2 of all that is in view."
        return [Finding("d2 list", text, [np.array(0.0)])]
    found = []
    if "d2 again" in single.probed.stops and size["one"] == size["empty"] == 1:
        text = f"A second `update` {single.probed.stops['d2 again']} `self.d2` still holds those of the first."
        found.append(Finding("d2 before", text, [np.array(1.0)]))
    elif size["again"] > 1:
        text = "`self.d2` still holds those of the updates before: start each update with an empty list."
        found.append(Finding("d2 before", text, [np.array(1.0)]))
    elif size["empty"]:
        text = "With nothing in view `self.d2` still holds the last ones: empty it first."
        found.append(Finding("d2 empty", text, [np.array(1.0)]))
    one, both = counts["one"][0], counts["both"][0]
    if size["both"] == 1:
        text = "With two in view `self.d2` holds one number: each has its own d2."
        found.append(Finding("d2 of each", text, [np.array(1.0)]))
    elif size["gated"] == 1:
        text = "`self.d2` holds only what passed the gate: keep the d2 of all that is in view."
        found.append(Finding("d2 gated", text, [np.array(1.0)]))
    if size["one"] == 1 and size["both"] == 2 and close(both[0], both[1]) and not close(both[0], one[0], 1e-2):
        text = "With two in view both have the same d2: each has its own, from its two numbers and its part of S."
        found.append(Finding("d2 of each", text, [np.array(2.0)]))
    return found


def _gate(single):
    """What is let pass: as d2 and the gate say, also where d2 is that of a wrong S."""
    asked = single.probed.both("gate")
    if not asked or not any(_passes(a) for a, _ in asked.values()):
        return []
    gates = {id: single.probed.probes[id]["make"][1]["gate"] for id in asked}
    came = np.array([_passes(a) for a, _ in asked.values()])
    right = {id: float(r.fields["d2"][0]) for id, (_, r) in asked.items()}
    limits = np.array(list(gates.values()))
    forms = {id: _forms_of(single, id) for id in asked}
    ways = [np.array(list(right.values())) < limits]
    if all(forms.values()):
        ways.append(np.array([form["d2"] for form in forms.values()]) < limits)
    if kept := all(len(a.fields["d2"]) == 1 for a, _ in asked.values()):
        ways.append(np.array([a.fields["d2"][0] for a, _ in asked.values()]) < limits)
    alone = single.probed.mine.get(KNOWN)  # of a sighting that is let pass as a whole, P after is the same
    whole = not (single.covariances and alone and _passes(alone)) or all(
        close(a.after, alone.after, 2e-2) for a, _ in asked.values() if _passes(a)
    )
    value = [np.array([*came, whole], dtype=float)]
    if any((came == way).all() for way in ways):
        return _beside(single)
    d2 = np.array([form["d2"] if form else right[id] for id, form in forms.items()])
    told = _compared(came, ways[-1], d2, limits, list(forms.values())) if whole else ", but not both of its numbers"
    k = int(np.flatnonzero(came != (d2 < limits))[0]) if (came != (d2 < limits)).any() else 0
    thing = "a landmark" if single.probed.probes[list(asked)[k]].get("first", 1) == 1 else "a reading"
    what = "is let pass" if came[k] else "is left out"
    text = f"With gate={limits[k]:g} {thing} whose d2 is {number_text(d2[k], size=limits[k])} {what}"
    part = "d2" if not kept and "as if" in told else "gate"  # where it shows in the gate only
    return [Finding(part, f"The gate: {text[0].lower()}{text[1:]}{told}.", value)]


def _forms_of(single, id):
    """What may stand for d2 at a probe of the gate, from the student's own H, R and expected measurement; or None."""
    if single.blind or KNOWN not in single.pairs:
        return None
    part = single.right(KNOWN) if single.covariances else single.parts.get(KNOWN)
    if part is None:
        return None
    base = _nu(single, KNOWN) if single.covariances and not single.gains else single.off(KNOWN)
    return _forms(single.turned(base + single.seen(id) - single.seen(KNOWN)), part)


def _compared(came, right, d2, limits, forms):
    """What the gate seems to compare with what, where one rule explains all that it let pass; or ''."""
    if came.all():
        return ", and so is all else: nothing is left out"
    if (came != right).all():
        return ": it is the wrong way round"
    if all(forms):
        for name, words in _WORDS.items():
            if (came == (np.array([form[name] for form in forms]) < limits)).all():
                return f", as if d2 were something else ({words})"
    if d2[came].max() < d2[~came].min():
        return ", whatever the gate is: compare with `self.gate`"
    return ""


def _beside(single):
    """Something honest in view together with something beyond the gate."""
    alone, lie, first, last = (single.probed.mine.get(id) for id in ("honest", "lie", "lie first", "d2 gated"))
    if not (alone and lie and first and last and _passes(alone)) or _passes(lie):
        return []
    came = [_passes(first), _passes(last)]
    if all(close(a.moved, alone.moved, 2e-2) for a in (first, last)):
        return []
    how = "moves the estimate otherwise than alone"
    if not any(came):
        how = "has no effect"
    elif not came[0]:
        how = "has an effect only if it comes first"
    text = f"The gate: when something beyond the gate is in view, what is honest {how}: decide for each by itself, and "
    text += "keep or leave out all that belongs to it."
    return [Finding("gate", text, [np.array([float(c) for c in came])])]
