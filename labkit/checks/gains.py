"""Which part of a gain is wrong: H, R, S or the gain as a whole, as the answers to probes show them."""

from dataclasses import replace

import numpy as np

from .findings import Finding, acts, close, number_text, trait
from .single import STEPS, Part, Single

OTHER_WAY = (
    "The correction points the other way: the innovation, H or the sign in the line of the estimate is reversed."
)


def explained(single: Single, other_landmark: bool = False) -> list[Finding]:
    """H, R or another part of the gain is wrong: the simplest that explains the gain at every probe.

    other_landmark: whether it is known that another landmark is taken, from which another H follows.
    """
    for look in (_in_S, _in_H, _in_H_with_R):
        found = look(single, other_landmark)
        if found is not None:
            return found
    return _whole_gain(single)


def _in_S(single, other_landmark):
    """H is right where S, which it then tells, is symmetric at all probes."""
    parts = {
        id: Part.of(single.pairs[id][0].gain, single.pairs[id][0].P, single.right(id).H)
        for id in STEPS
        if id in single.pairs
    }
    if not single.steps <= parts.keys():
        return None
    for id, part in parts.items():
        a = single.pairs[id][0]
        if not (close(part.S, part.S.T) and close(a.P @ part.H.T @ np.linalg.pinv(part.S), a.gain)):
            return None
    known = parts["one"].H @ single.pairs["one"][0].P @ parts["one"].H.T
    grown = (parts["one P"].S - parts["one"].S) / 2
    found = []
    if close(grown, -known) or close(parts["one"].S - grown, -single.right("one").R):
        found, grown = [_other_way()], -grown
        parts = {
            id: Part(part.H, -part.S - part.H @ single.pairs[id][0].P @ part.H.T, -part.S) for id, part in parts.items()
        }
        single.scale = -1.0
    single.parts = parts
    if close(grown, known):
        single.probed.fine.append("H")
        return [*found, *noise(single)]
    if close(parts["one scaled"].S, 3 * parts["one"].S):
        share = float(np.sum(grown * known) / np.sum(known**2))
        if close(grown, share * known):
            return [*found, *_share(single, parts, share, known)]
    single.parts = {}
    return _not_inverted(single, parts, known)


def _not_inverted(single, parts, known):
    """The gain is P H' S: R is what is left of this S."""
    S = {id: np.linalg.pinv(part.S) for id, part in parts.items()}
    if not close((S["one P"] - S["one"]) / 2, known):
        return None
    single.parts = {id: Part(p.H, S[id] - p.H @ single.pairs[id][0].P @ p.H.T, S[id]) for id, p in parts.items()}
    single.inverted = False
    return [*noise(single), Finding("gain", "S is not inverted in the gain: K = P H' S^-1.", [np.array(-1.0)])]


def _share(single, parts, share, known):
    """H P H', of which `known` is right, stands in S so many times."""
    rest = {id: part.S - share * part.H @ single.pairs[id][0].P @ part.H.T for id, part in parts.items()}
    if all(close(R, share * single.right(id).R, 1e-2) for id, R in rest.items()):  # so does R
        single.parts = {id: replace(single.right(id), S=part.S) for id, part in parts.items()}
        single.whole = 1 / share
        text = f"The gain acts as {1 / share:.3g} times what it should be (or S as {share:.3g} times)."
        return [Finding("gain", text, [np.array(1 / share)])]
    single.parts = {id: Part(part.H, rest[id], part.S) for id, part in parts.items()}
    came = share * known
    text = f"The part of S that comes from the estimate, H P H', {acts(came, known, trait([came], [known]))}."
    value = [came, single.pairs["one"][0].after][: 1 + close(came, 0 * came)]  # or it is in the gain only
    return [Finding("H P H'", text, value), *noise(single)]


def _other_way():
    return Finding("sign", OTHER_WAY, [np.array(-1.0)])


def noise(single: Single) -> list[Finding]:
    """What stands for R, by the parts that were read."""
    R = {id: part.R for id, part in single.parts.items()}
    rights = {id: single.right(id).R for id in R}
    off = [id for id in R if not close(R[id], rights[id], 1e-2)]
    if not off:
        return []
    value = [R[id] for id in ("one", "one dt", "one R", "partial") if id in R]
    if close(R["one R"], R["one"], 1e-2):
        nothing = np.abs(R["one"]).max() < 1e-3 * np.abs(rights["one"]).max()
        text = (
            "R is missing in S: H P H' stands there alone."
            if nothing
            else f"`self.R` has no effect: in its place stands {number_text(R['one'])}."
        )
        return [Finding("R", f"In `update`, {text}", value)]
    ids = [id for id in ("one", "one dt", "other") if id in R] if off != ["partial"] else off
    how = trait([R[id] for id in ids], [rights[id] for id in ids], single.seconds(ids))
    where = ", for what is cut off" if off == ["partial"] else ""
    return [Finding("R", f"R, as it stands in S{where}, {acts(R[off[0]], rights[off[0]], how)}.", value)]


def _in_H(single, other_landmark):
    """H as a far larger P shows it, if the R that it leaves is one at all probes."""
    if not {"one wide", "other wide"} <= single.pairs.keys():
        return None
    H = {name: np.linalg.pinv(single.pairs[f"{name} wide"][0].gain) for name in ("one", "other")}
    if any(np.abs(h).max() > 1e5 or np.linalg.matrix_rank(h, 1e-6) < len(h) for h in H.values()):
        return None
    return _with(single, H, other_landmark)


def _in_H_with_R(single, other_landmark):
    """H as a far smaller P shows it, if R is right."""
    if not {"one narrow", "other narrow"} <= single.pairs.keys():
        return None
    H, parts = {}, {}
    for name in ("one", "other"):
        a = single.pairs[f"{name} narrow"][0]
        H[name] = (np.linalg.solve(a.P, a.gain) @ single.right(name).R).T
        part = Part(H[name], single.right(name).R, H[name] @ single.pairs[name][0].P @ H[name].T + single.right(name).R)
        if not close(single.pairs[name][0].P @ part.H.T @ np.linalg.pinv(part.S), single.pairs[name][0].gain, 1e-2):
            return None
        parts[name] = part
    for id in set(STEPS) & single.pairs.keys():
        h, R, P = H["other" if id == "other" else "one"], single.right(id).R, single.pairs[id][0].P
        parts[id] = Part(h, R, h @ P @ h.T + R)
    single.parts = parts
    return _rows(single, H) if not other_landmark else []


def _with(single, H, other_landmark):
    parts = {}
    for id in STEPS:
        if id in single.pairs:
            a = single.pairs[id][0]
            parts[id] = Part.of(a.gain, a.P, H["other" if id == "other" else "one"])
    R = {id: part.R for id, part in parts.items()}
    if not single.steps <= R.keys():
        return None
    if not all(close(r, r.T, 2e-2) for r in R.values()) or not close(R["one P"], R["one"], 2e-2):
        return None
    single.parts = parts
    rows, other = [] if other_landmark else _rows(single, H), noise(single)
    factor = _one_factor(single, H)
    if rows and factor and (other or close(factor, -1)):
        return _as_correction(single, factor)
    return [*rows, *other]


def _one_factor(single, H):
    """F where all of H is f times what it should be, or 0."""
    rights = {name: single.right(name).H for name in H}
    f = float(np.sum(H["one"] * rights["one"]) / np.sum(rights["one"] ** 2))
    return f if all(close(h, f * rights[name]) for name, h in H.items()) and abs(f) > 1e-6 else 0.0


def _as_correction(single, f):
    """H and R that are both off, as one factor on the correction and what is then left of R."""
    seconds = dict(zip(single.parts, single.seconds(single.parts)))
    power = next((k for k in (-1, 1) if close(f, seconds["one"] ** k)), None)
    each = {id: f if power is None else dt**power for id, dt in seconds.items()}
    single.parts = {
        id: Part(p.H / each[id], p.R / each[id] ** 2, p.S / each[id] ** 2) for id, p in single.parts.items()
    }
    single.scale = 1 / f
    if close(f, -1):
        return [_other_way(), *noise(single)]
    much = f"{1 / f:.3g} times as large as it should be (or H {f:.3g} times)"
    text = f"The correction of {single.probed.x} comes out {much}."
    return [Finding("estimate", text, [np.array(1 / f)]), *noise(single)]


def _rows(single, H):
    """The rows of H {probe: (m, n)} that are wrong."""
    rights = {name: single.right(name).H for name in H}
    name = next((name for name in H if not close(H[name], rights[name])), "one")
    value = list(H.values())
    rows = [j for j in range(len(H["one"])) if any(not close(H[one][j], rights[one][j]) for one in H)]
    if len(rows) == 1:
        j = rows[0]
        ranges = [single.expected(name)[0] for name in H] if single.probed.rows[0] == "range" else []
        how = trait([h[j] for h in H.values()], [r[j] for r in rights.values()], ranges=ranges)
        fine, off = single.probed.rows[1 - j], single.probed.rows[j]
        text = f"H: the row of the {fine} is right; that of the {off} {acts(H[name][j], rights[name][j], how)}."
    else:
        text = f"H {acts(H[name], rights[name], trait(value, list(rights.values())))}."
    if not rows:
        single.probed.fine.append("H")
    return [Finding("H", text, value)] if rows else []


def _whole_gain(single):
    a, r = single.pairs["one"]
    text = f"The gain {acts(a.gain, r.gain, trait([a.gain], [r.gain]))}"
    if "one scaled" in single.pairs:
        big = single.pairs["one scaled"][0].gain
        for power, words in ((2, "S is not inverted"), (-1, "P is missing"), (-2, "P is inverted")):
            if close(big, 3.0**power * a.gain):
                text += f": when P and R grow threefold it changes by {3.0**power:.3g}, as it does when {words}"
    return [Finding("gain", text + ".", [a.gain])]
