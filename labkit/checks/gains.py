"""Which part of a gain is wrong: its line, H, R or S, by the simplest reading that explains all answers to probes."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..geometry import Array
from .findings import Finding, alike, close
from .forms import FORMS, Form, covariances
from .gain_words import OTHER_WAY, missing, noise, rows, times, whole_gain, wrong_line
from .single import STEPS, Part, Single

LIKELY, UNLIKELY = 1.0, 1.3  # what a wrong part costs an explanation: one that a known mistake shows, or another


@dataclass(frozen=True)
class Reading:
    """One explanation of the gains: the parts that they are made of, what is wrong in them, how far that is fetched."""

    form: Form
    parts: Mapping[str, Part]
    found: list[Finding]
    cost: float
    scale: float = 1.0  # of the correction alone
    whole: float = 1.0  # of the gain
    share: float = 1.0  # of H P H' in S


def explained(single: Single, h_is_wrong: bool) -> list[Finding]:
    """The wrong parts of the gain, by the reading that costs least.

    h_is_wrong: whether something else is expected than should be.
    """
    readings = [
        reading
        for form in FORMS
        for H, cost in _candidates(single, form)
        for reading in (*_readings(single, form, H, cost + _cost(single, form)), *_direct(single, form, H, cost))
    ]
    if not readings:
        return whole_gain(single)
    best = min(readings, key=lambda reading: reading.cost + LIKELY * (not _has_its_P(single, reading)))
    single.parts, single.form = best.parts, best.form
    single.scale, single.whole, single.share = best.scale, best.whole, best.share
    if not any(finding.part in ("H", "landmark") for finding in best.found) and not (h_is_wrong or single.taken):
        single.probed.fine.append("H")
    return best.found


def _cost(single, form):
    """What another line of the gain costs; one that is transposed stops with several landmarks in view."""
    return (LIKELY - 0.05 * (form.flips and "two" in single.probed.stops)) if form.text else 0.0


def _has_its_P(single, reading):
    """Whether the covariances after follow from the parts that were read."""
    for id, part in reading.parts.items():
        a, _ = single.pairs[id]
        gains = (a.gain / reading.scale, FORMS[0].gain(a.P, part.H, part.S))
        if not any(close(a.after, way) for K in gains for way in covariances(a.P, K, part.H, part.R, part.S)):
            return False
    return True


def _direct(single, form, H, cost):
    """Readings of gains with the right R and this H, which may be of a lower rank than S can be read with."""
    cost += _cost(single, form)
    for share in (1.0, 0.0):
        parts, factors = {}, []
        for id in (id for id in STEPS if id in single.pairs):
            a, h, R = single.pairs[id][0], H["other" if id == "other" else "one"], single.right(id).R
            parts[id] = Part(h, R, share * h @ a.P @ h.T + R)
            due = form.gain(a.P, h, parts[id].S)
            factors.append(float(np.sum(due * a.gain) / np.sum(due**2)))
            if not close(a.gain, factors[-1] * due, 1e-2):
                break
        else:
            yield from _by_one_factor(single, form, H, parts, factors, share, cost)


def _by_one_factor(single, form, H, parts, factors, share, cost):
    f = factors[0]
    found = [*wrong_line(form), *rows(single, H)]
    if share == 0:
        found, cost = [*found, missing(single, parts, 0.0)], cost + LIKELY
    if close(factors, np.ones(len(factors)), 1e-2):
        yield Reading(form, parts, found, cost, share=share)
    elif abs(f) > 1e-6 and not _nearly(f) and close(factors, np.full(len(factors), f), 1e-2):
        alone = _moves_alone(single, parts, dict.fromkeys(parts, f))
        scale = f if alone else 1.0
        yield Reading(form, parts, [times(single, f, alone, form), *found], cost + LIKELY, scale, f / scale, share)


def _candidates(single: Single, form: Form) -> Iterator[tuple[dict[str, Array], float]]:
    """({probe: H}, cost) of what H may be: right, as a known mistake has it, or as extreme probes show it."""
    names: list[str] = [name for name in ("one", "other") if name in single.pairs]
    right = {name: single.right(name).H for name in names}
    yield right, 0.0
    for value in single.probed.known.get("H", []):
        if len(value) == len(right) and all(np.shape(H) == right["one"].shape for H in value):
            yield dict(zip(right, map(np.array, value))), LIKELY
    if form.text:
        return
    for kind in ("wide", "narrow"):  # beside a far larger P, and a far smaller one if R is right
        if {f"one {kind}", f"other {kind}"} <= single.pairs.keys():
            H = {name: _extreme(single, name, kind) for name in ("one", "other")}
            if all(np.abs(h).max() < 1e5 for h in H.values()):
                yield H, UNLIKELY + 0.1 * (kind == "narrow")


def _extreme(single, name, kind):
    a, _ = single.pairs[f"{name} {kind}"]
    return np.linalg.pinv(a.gain) if kind == "wide" else (np.linalg.solve(a.P, a.gain) @ single.right(name).R).T


def _readings(single: Single, form: Form, H: dict[str, Array], cost: float) -> Iterator[Reading]:
    """The readings of the gains by one form of their line and one H: none where S is then no covariance."""
    S = {}
    for id in (id for id in STEPS if id in single.pairs):
        a, h = single.pairs[id][0], H["other" if id == "other" else "one"]
        S[id] = form.taken_from(a.P, h, a.gain)
        fits = np.isfinite(S[id]).all() and close(S[id], S[id].T, 1e-2)
        if not (fits and close(form.gain(a.P, h, S[id]), a.gain, 1e-2)):
            return
    if not single.steps <= S.keys():
        return
    known = H["one"] @ single.pairs["one"][0].P @ H["one"].T
    grown = (S["one P"] - S["one"]) / 2
    share = float(np.sum(grown * known) / np.sum(known**2))
    if not close(grown, share * known, 2e-2 if np.abs(share) > 1e-3 else 5e-3):
        return
    if _nearly(share):
        return
    if abs(share) > 1e-3:
        yield from _plain(single, form, H, S, share, cost)
        yield from _scaled(single, form, H, S, share, cost)
    elif (np.diag(S["one"]) < 0).all():  # the sign, and H P H' is missing
        sign = [Finding("sign", OTHER_WAY, [np.array(-1.0)])]
        for one in _plain(single, form, H, {id: -s for id, s in S.items()}, 0.0, cost + LIKELY):
            yield replace(one, found=sign + one.found, scale=-1.0)
    else:
        yield from _plain(single, form, H, S, 0.0, cost)


def _nearly(f):
    """Whether a factor is so near to 1, and not 1, that it may as well come from something that only looks like one."""
    return close(f, 1, 5e-2) and not close(f, 1, 1e-2)


def _plain(single, form, H, S, share, cost):
    """H P H' stands in S so many times, and the rest is R."""
    parts = _split(single, H, S, dict.fromkeys(S, share))
    found = [*wrong_line(form), *rows(single, H)]
    if not close(share, 1, 1e-2):
        found.append(missing(single, parts, share))
        cost += LIKELY if share == 0 else UNLIKELY
    if (rest := _noise_cost(single, parts)) is not None:
        yield Reading(form, parts, [*found, *noise(single, parts)], cost + rest, share=share)


def _scaled(single, form, H, S, share, cost):
    """The gain or the correction is so many times what it should be."""
    if close(share, 1, 1e-2):
        return
    seconds = dict(zip(S, single.seconds(S)))
    power = next((k for k in (1, -1) if close(1 / share, seconds["one"] ** k, 1e-2)), 0)
    for k in {power, 0}:
        each = {id: 1 / share * (seconds[id] / seconds["one"]) ** k for id in S}
        parts = _split(single, H, {id: S[id] * each[id] for id in S}, dict.fromkeys(S, 1.0))
        if (rest := _noise_cost(single, parts)) is None:
            continue
        grown = {id: factor if form.inverts else 1 / factor for id, factor in each.items()}
        f = grown["one"]
        alone = _moves_alone(single, parts, grown)
        found = [times(single, f, alone, form), *wrong_line(form), *rows(single, H), *noise(single, parts)]
        if not (alone or close(f, -1, 1e-2)):
            parts = {id: replace(part, S=S[id]) for id, part in parts.items()}
        scale = f if alone or close(f, -1, 1e-2) else 1.0
        yield Reading(form, parts, found, cost + rest + LIKELY - 0.01 * abs(k), scale, f / scale)


def _moves_alone(single, parts, each):
    """Whether the covariance after follows from a gain that is not scaled, so that only the correction is."""
    for id in parts:
        a, part = single.pairs[id][0], parts[id]
        K = a.gain / each[id]
        if not any(close(a.after, way) for way in (a.P - K @ part.S @ K.T, a.P - K @ part.H @ a.P)):
            return False
    return True


def _split(single, H, S, share):
    parts = {}
    for id in S:
        h = H["other" if id == "other" else "one"]
        parts[id] = Part(h, S[id] - share[id] * h @ single.pairs[id][0].P @ h.T, S[id])
    return parts


def settled(single: Single, parts: Mapping[str, Part]) -> bool:
    """Whether the rests of S may be an R: the same for all P and landmarks."""
    R = {id: part.R for id, part in parts.items()}
    least = np.diag(1e-3 * np.abs(np.diag(parts["one"].S)))  # what nothing at all may come out as
    alike_R = close(single.right("one").R, single.right("other").R)  # which may depend on the distance
    if not all(_same(R[id], R["one"], least) for id in ["one P", *["other"] * alike_R]):
        return False
    grown = {"one R": (1, 2, 4), "one scaled": (1, 3, 9)}
    return all(any(_same(R[id], k * R["one"], least) for k in grown[id]) for id in grown.keys() & R.keys())


def _noise_cost(single, parts):
    """What it costs to take the rests of S for R, or None where they are none."""
    if not settled(single, parts):
        return None
    found = noise(single, parts)
    if not found:
        return 0.0
    value = found[0].value
    return LIKELY if any(alike(value, known) for known in single.probed.known.get("R", [])) else UNLIKELY


def _same(a, b, least):
    return bool((np.abs(a - b) <= 2e-2 * np.abs(b).max() + least.max()).all())
