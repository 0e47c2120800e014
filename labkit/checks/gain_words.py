"""The words for what is wrong in a gain: its line, H, R, H P H' in S, or how large it is."""

from collections.abc import Mapping

import numpy as np

from ..geometry import Array
from .findings import Finding, acts, close, number_text, trait
from .forms import FORMS, Form
from .single import Part, Single

OTHER_WAY = (
    "The correction points the other way: the innovation, H or the sign in the line of the estimate is reversed."
)


def missing(single: Single, parts: Mapping[str, Part], share: float) -> Finding:
    """H P H' does not stand in S once, but so many times."""
    known = parts["one"].H @ single.pairs["one"][0].P @ parts["one"].H.T
    how = acts(share * known, known, trait([share * known], [known]))
    text = f"The part of S, in the gain, that comes from the estimate, H P H', {how}."
    return Finding("H P H'", text, [np.array([share, *_lines_of_P(single, parts)])])


def wrong_line(form: Form) -> list[Finding]:
    """The line of the gain is another one: a finding, or none if it is right."""
    return [Finding("gain", form.text, [np.eye(len(FORMS))[FORMS.index(form)]])] * (form.text > "")


def times(single: Single, f: float, alone: bool, form: Form) -> Finding:
    """The gain, or the correction alone, is f times what it should be."""
    if close(f, -1, 1e-2):
        return Finding("sign", OTHER_WAY, [np.array(-1.0)])
    if alone:
        much = f"{f:.3g} times as large as it should be (or H {1 / f:.3g} times)"
        text = f"The correction of {single.probed.x} comes out {much}."
        return Finding("estimate", text, [np.array(f)])
    of_S = 1 / f if form.inverts else f
    text = f"The gain acts as {f:.3g} times what it should be (or S as {of_S:.3g} times)."
    return Finding("gain", text, [np.array(f)])


def _lines_of_P(single, parts):
    """Whether the covariance after follows from the same S at all probes, and whether from one with H P H'."""
    told = [True, True]
    for id, part in parts.items():
        a, _ = single.pairs[id]
        S = part.H @ a.P @ part.H.T + part.R
        told = [so and close(a.after, a.P - a.gain @ s @ a.gain.T) for so, s in zip(told, (part.S, S))]
    return told


def noise(single: Single, parts: Mapping[str, Part]) -> list[Finding]:
    """What stands for R, by the parts that were read."""
    R = {id: part.R for id, part in parts.items()}
    rights = {id: single.right(id).R for id in R}
    least = 1e-5 * max(np.abs(part.S).max() for part in parts.values())
    off = [id for id in R if not close(R[id], rights[id], 1e-2) and np.abs(R[id] - rights[id]).max() > least]
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


def rows(single: Single, H: Mapping[str, Array]) -> list[Finding]:
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
    return [Finding("H", text, value)] if rows else []


def whole_gain(single: Single) -> list[Finding]:
    """No reading explains the gains: they are told as they are."""
    a, r = single.pairs["one"]
    text = f"The gain {acts(a.gain, r.gain, trait([a.gain], [r.gain]))}"
    if np.linalg.cond(a.gain) > 1e6 > np.linalg.cond(r.gain):
        text += ": its columns are multiples of one another, as they are where the rows of H are."
        return [Finding("H", text, [a.gain])]
    if "one scaled" in single.pairs:
        big = single.pairs["one scaled"][0].gain
        for power, words in ((2, "S is not inverted"), (-1, "P is missing"), (-2, "P is inverted")):
            if close(big, 3.0**power * a.gain):
                text += f": when P and R grow threefold it changes by {3.0**power:.3g}, as it does when {words}"
    return [Finding("gain", text + ".", [a.gain])]
