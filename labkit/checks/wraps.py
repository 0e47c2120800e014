"""Angles: innovations that are far (by nearly a turn, by more than a quarter of one), and headings of the estimate."""

import numpy as np

from .findings import Finding, Probed, close, number_text
from .single import Single


def shows_angles(single: Single) -> bool:
    """Whether the estimate tells what each row of the innovation is: not where the rows of H say the same."""
    return "near" in single.pairs and bool(np.linalg.cond(single.pairs["near"][0].gain) <= 1e7)


def far(single: Single) -> list[Finding]:
    """An innovation that does not come out as it should, against what the same filter makes of a small one."""
    if not shows_angles(single):
        return []
    inverse = np.linalg.pinv(single.pairs["near"][0].gain)
    near, seen = single.off("near"), single.seen("near")
    pairs = []
    for id, (a, _) in single.probed.both("far").items():
        right = single.turned(near + single.seen(id) - seen)
        angles = np.abs(right[np.array(single.probed.rows) == "bearing"])
        if not (angles > np.pi - 0.02).any():
            move = a.moved + single.replaced * a.x
            came = inverse @ move
            if not close(single.pairs["near"][0].gain @ came, move, 2e-2):
                return []  # not along the gain: what the innovation is cannot be told
            pairs.append((came, right))
    for came, right in pairs:
        for j, row in enumerate(single.probed.rows):
            if abs(came[j] - right[j]) > 0.03 + 0.02 * np.abs(right).max():
                unit = " rad" if row == "bearing" else " m"
                texts = [number_text(v[j], 3, np.abs([right, came]).max()) + unit for v in (right, came)]
                text = f"An innovation whose {row} should be {texts[0]} acts as {texts[1]}"
                return [Finding("wrap", f"{text}{_how(pairs, j, row)}.", [c for c, _ in pairs])]
    return []


def _how(pairs, j, row):
    came, right = (np.array(values)[:, j] for values in zip(*pairs))
    turns = (came - right) / (2 * np.pi)
    if row == "bearing" and close(turns, np.round(turns), 1e-2):
        return ": it is not brought into (-pi, pi]"
    if row == "bearing" and close(2 * turns, np.round(2 * turns), 3e-3):
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


def headings(probed: Probed, method: str) -> list[Finding]:
    """What `method` leaves of headings that it carries across 180 degrees, and of positions beyond three metres."""
    found = []
    for answer, right in probed.both(f"across {method}").values():
        ends = [(a.x + a.moved).reshape(-1, 3)[:, 2] for a in (answer, right)]
        out = np.flatnonzero(np.abs(ends[0]) > np.pi + 1e-6)
        if out.size and np.abs(ends[1][out[0]]) < np.pi:
            text = f"After `{method}` a heading is {number_text(ends[0][out[0]])}: it must be wrapped into (-pi, pi]."
            found.append(Finding(f"heading in {method}", text, [np.array(1.0)]))
            break
    for answer, _ in probed.both(f"beyond {method}").values():
        came = (answer.x + answer.moved).reshape(-1, 3)[:, :2]
        lost = np.abs(answer.moved.reshape(-1, 3)[:, :2] + 2 * np.pi) < 1
        if lost.any() and (np.abs(came) <= np.pi + 1e-6).all():
            x = number_text(came[lost][0])
            text = f"After `{method}` a robot beyond x = 3.14 m is at x = {x}: the position is wrapped, too."
            found.append(Finding(f"position in {method}", text, [np.array(1.0)]))
    return found
