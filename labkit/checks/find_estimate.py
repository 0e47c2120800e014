"""What is wrong in the line that sets the estimate: what it makes of the innovation."""

import numpy as np

from .findings import Finding, acts, beside, close, trait
from .gain_words import OTHER_WAY
from .single import STEPS, Single


def no_effect(single: Single) -> Finding:
    """What was measured of one landmark or reading has no effect on the estimate."""
    x, moves = single.probed.x, {id: a.moved for id, (a, _) in single.pairs.items()}
    still = all(close(moved, 0 * moved) for moved in moves.values())
    two = single.probed.mine.get("two")
    if two and not close(two.gain, 0 * two.gain):
        text = f"With one {single.thing} in view what was measured has no effect on {x}, with two it has: "
        return Finding("estimate", f"{text}is the first or the last of the list left out?", [np.full(3, 2.0)])
    if _only_large(moves):
        text = f"Where a measurement changes a little, {x} stays the same, where it changes much, it does not: "
        return Finding("estimate", f"{text}is something rounded, or turned into whole numbers?", [np.full(3, 3.0)])
    text = f"What was measured has no effect on {x}: is the innovation what was seen less what is expected?"
    if still:
        text = f"`update` leaves {x} as it was: is the new value assigned to `self.{x}`?"
    return Finding("estimate", text, [np.full(3, float(still))])


def _only_large(moves):
    """Whether a large innovation moves the estimate, where a small one does not and is not taken for nothing else."""
    if "near" in moves and not close(moves["near"], moves.get("bent", moves["near"])):
        return True
    first, last = (moves.get(id, np.zeros(1)) for id in ("other", "more bent"))
    return close(first, 0 * first) and not close(last, 0 * last)


def replaced(single: Single) -> list[Finding]:
    """What of the new estimate does not come from the innovation: it is the same for all gains if h is wrong."""
    x = single.probed.x
    if _steady(single):
        return []
    single.replaced = True
    if _steady(single):
        return [instead(single)]
    single.replaced = False
    a, r = single.pairs["one"]
    text = f"{x} moves by {beside(a.moved, r.moved)}"
    told = f"{text}: not all of that comes from the innovation. Look at the line that sets {x}."
    return [Finding("estimate", told, [a.moved])]


def instead(single: Single) -> Finding:
    """The new estimate is the correction alone."""
    x = single.probed.x
    return Finding("estimate", f"The correction replaces {x}: it must be added to what {x} was.", [np.ones(2)])


def _steady(single):
    """Whether one innovation explains the moves by several gains."""
    answers = [single.pairs[id][0] for id in ("one", "one P", "one R", "one wide") if id in single.pairs]
    gains = np.vstack([a.gain for a in answers])
    moves = np.concatenate([a.moved + single.replaced * a.x for a in answers])
    return close(gains @ np.linalg.lstsq(gains, moves)[0], moves, 2e-2)


def innovation(single: Single, wrapped: bool) -> list[Finding]:
    """The covariances are right, so H and R are; the estimate follows the measurement in another way.

    wrapped: whether angles are known to come out wrong, which may be all of it.
    """
    told, x = f"{single.probed.P} comes out right, so H and R are; ", single.probed.x
    single.parts = {id: single.right(id) for id in STEPS if id in single.pairs}
    ways = {id: np.linalg.pinv(r.gain) @ a.gain for id, (a, r) in single.tight.items()}
    first = ways["one"]
    through = all(close(single.tight[id][1].gain @ way, single.tight[id][0].gain) for id, way in ways.items())
    scales = [way[0, 0] for way in ways.values()]
    single.way = first if through else np.full(first.shape, np.nan)
    if through and all(close(way, way[0, 0] * np.eye(len(way))) for way in ways.values()):
        how = trait(list(ways.values()), [np.eye(len(first))] * len(ways), single.seconds(ways))
        if how == "the other sign":
            return [Finding("sign", told + OTHER_WAY[0].lower() + OTHER_WAY[1:], [np.array(-1.0)])]
        much = how or f"{scales[0]:.3g} times as much"
        text = f"the correction is not what it should be ({much}): look at the line that sets {x}."
        return [Finding("estimate", told + text, [first])]
    if wrapped:
        return []
    if through and all(close(way, first) for way in ways.values()):
        if close(first, np.diag(np.diag(first))):
            j = next(j for j in range(len(first)) if not close(first[j, j], 1))
            f = first[j, j]
            how = "the other sign" if close(f, -1) else "no effect" if abs(f) < 1e-3 else f"{f:.3g} times the weight"
            return [Finding("innovation", f"{told}the innovation's {single.probed.rows[j]} has {how}.", [first])]
        if close(first, np.eye(len(first))[::-1]):
            return [Finding("innovation", f"{told}the two numbers of the innovation are exchanged.", [first])]
    if _from_new_P(single):
        text = f"{told}the gain comes from the {single.probed.P} that `update` has changed already: compute it before."
        return [Finding("estimate", text, [single.pairs["one"][0].gain])]
    a, r = single.pairs["one"]
    text = f"what {x} makes of the innovation {acts(a.gain, r.gain)}: look at the gain, and at the line that sets {x}."
    return [Finding("estimate", told + text, [a.gain])]


def _from_new_P(single):
    """Whether the covariance after the update stands in the gain, and in S or not."""
    for way in (lambda P, part: part.S, lambda P, part: part.H @ P @ part.H.T + part.R):
        gains = {id: a.after @ part.H.T @ np.linalg.pinv(way(a.after, part)) for id, a, part in _known(single)}
        if gains and all(close(single.pairs[id][0].gain, gain, 1e-2) for id, gain in gains.items()):
            return True
    return False


def _known(single):
    return [(id, single.pairs[id][0], part) for id, part in single.parts.items()]
