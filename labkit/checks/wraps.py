"""Innovations that are far: by nearly a turn, by more than a quarter of one, by metres."""

import numpy as np

from .findings import Finding, close
from .single import Single


def far(single: Single) -> list[Finding]:
    """An innovation that does not come out as it should, against what the same filter makes of a small one."""
    if "near" not in single.pairs or np.linalg.cond(single.pairs["near"][0].gain) > 1e7:
        return []
    inverse = np.linalg.pinv(single.pairs["near"][0].gain)
    near, seen = single.off("near"), single.seen("near")
    pairs = []
    for id, (a, _) in single.probed.both("far").items():
        right = single.turned(near + single.seen(id) - seen)
        angles = np.abs(right[np.array(single.probed.rows) == "bearing"])
        if not (angles > np.pi - 0.02).any():
            pairs.append((inverse @ a.moved, right))
    for came, right in pairs:
        for j, row in enumerate(single.probed.rows):
            if abs(came[j] - right[j]) > 0.03 + 0.02 * np.abs(right).max():
                unit = " rad" if row == "bearing" else " m"
                text = f"An innovation whose {row} should be {right[j]:.3g}{unit} acts as {came[j]:.3g}{unit}"
                return [Finding("wrap", f"{text}{_how(pairs, j, row)}.", [c for c, _ in pairs])]
    return []


def _how(pairs, j, row):
    came, right = (np.array(values)[:, j] for values in zip(*pairs))
    turns = (came - right) / (2 * np.pi)
    if row == "bearing" and close(turns, np.round(turns), 1e-2):
        return ": it is not brought into (-pi, pi]"
    if row == "bearing" and close(2 * turns, np.round(2 * turns), 1e-2):
        return ": half a turn is lost, as with arctan of a quotient"
    if close(came, np.abs(right), 2e-2):
        return ": it has lost its sign"
    if close(came, 0 * came):
        return ": it is left out"
    return (
        ": ranges are not wrapped"
        if row != "bearing" and np.abs(came).max() <= np.pi + 1e-6 < np.abs(right).max()
        else ""
    )
