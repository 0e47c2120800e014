"""What is wrong in a filter's constructor and in its `predict`, read off the answers to probes."""

import numpy as np

from .findings import Finding, Probed, acts, beside, close, number_text, trait
from .wraps import headings


def start(probed: Probed) -> list[Finding]:
    """What the constructor keeps: the first estimate, its covariance, and the noises scaled with dt."""
    pairs = probed.both("made")
    found = []
    for name in [probed.x, probed.P, *(field for _, right in list(pairs.values())[:1] for field in right.fields)]:
        values = {id: (_kept(a, name, probed), _kept(r, name, probed)) for id, (a, r) in pairs.items()}
        off = _first_off(values)
        if off:
            text = f"`self.{name}` of the constructor {acts(off[1], off[2], _how(probed, values))}."
            found.append(Finding(f"{name} in __init__", text, [came for came, _ in values.values()]))
    return found


def _kept(answer, name, probed):
    return {probed.x: answer.x, probed.P: answer.P, **answer.fields}.get(name, np.array(np.nan))


def predict(probed: Probed) -> list[Finding]:
    """What `predict` does: how it moves the estimate, what it adds to the covariance, what it keeps of it."""
    return [*_motion(probed), *headings(probed, "predict"), *_noise(probed), *_of_before(probed)]


def _first_off(values):
    """(id, what came, what is right) of the first of {id: (came, right)} that is off, or None."""
    return next(((id, came, right) for id, (came, right) in values.items() if not close(came, right)), None)


def _how(probed, values):
    dts = [probed.probes[id]["make"][1].get("dt", 1.0) for id in values]
    return trait([came for came, _ in values.values()], [right for _, right in values.values()], dts)


def _motion(probed):
    pairs = probed.both("predict ")
    values = {id: (a.moved, r.moved) for id, (a, r) in pairs.items()}
    off = _first_off(values)
    if not off:
        return []
    id, came, right = off
    value = [c for c, _ in values.values()]
    if all(close(a.moved, r.moved - a.x) for a, r in pairs.values()):
        return [
            Finding("motion", "`predict` forgets where the robot was: the motion is added to the old estimate.", value)
        ]
    probe, how = probed.probes[id], _how(probed, values)
    options = "".join(f" with {name}={value}" for name, value in probe["make"][1].items() if name != "gate")
    call = f"`predict({number_text(np.array(probe['calls'][-1][1]))})`{options}"
    text = f"{call} moves {probed.x} by {beside(came, right)}{f' ({how})' if how else ''}."
    return [Finding("motion", text, value)]


def _noise(probed):
    pairs = probed.both("noise ")
    values = {id: (a.after - a.P, r.after - r.P) for id, (a, r) in pairs.items()}
    off = _first_off(values)
    own = {id: a.fields.get("Q", np.array(np.nan)) for id, (a, _) in pairs.items()}
    if all(close(came, own[id]) for id, (came, _) in values.items()):
        return []  # it follows from self.Q, of which the constructor's finding tells
    text = f"What `predict` adds to {probed.P}"
    scaled = {id: (came, own[id]) for id, (came, _) in values.items()}
    if (how := _how(probed, scaled)) and not all(close(own[id], right) for id, (_, right) in values.items()):
        return [Finding("Q in predict", f"{text} is not `self.Q`, but acts as that {how}.")]
    if not off:
        return []
    return [
        Finding(
            "Q in predict", f"{text} {acts(off[1], off[2], _how(probed, values))}.", [c for c, _ in values.values()]
        )
    ]


def _of_before(probed):
    """Of the covariance before: what a certain start leads to is taken off."""
    pairs, noises = probed.both("predict "), probed.both("noise ")
    values = {}
    for number in "01":
        if f"predict {number}" in pairs and f"noise {number}" in noises:
            (a, r), (b, s) = pairs[f"predict {number}"], noises[f"noise {number}"]
            values[f"predict {number}"] = (a.after - b.after, r.after - s.after)
    off = _first_off(values)
    if not off:
        return []
    text = f"`predict` adds the noise of the motion to what {probed.P} was: of that, what is kept"
    return [
        Finding(
            "P in predict", f"{text} {acts(off[1], off[2], _how(probed, values))}.", [c for c, _ in values.values()]
        )
    ]
