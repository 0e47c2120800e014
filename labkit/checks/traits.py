"""How numbers differ from the right ones in the same way at all inputs, in words."""

from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias

import numpy as np

from ..geometry import Array

ANGLES = ("bearing", "heading", "angle")
TURN = 2 * np.pi
NAMED: dict[str, Callable[[Array], Array]] = {
    "the other sign": lambda r: -r,
    "squared": np.square,
    "its square root": lambda r: np.sqrt(r),
    "1 divided by it": lambda r: 1 / r,
    "without its sign": np.abs,
    "what came is in degrees": np.rad2deg,
    "what came is as if it had been degrees": np.deg2rad,
}
OF_ANGLES: dict[str, Callable[[Array], Array]] = {
    "not wrapped": lambda r: r,
    "the other sign": lambda r: -r,
    "half a turn off": lambda r: r + np.pi,
    "as if `arctan2` had its arguments exchanged": lambda r: np.pi / 2 - r,
}


Given: TypeAlias = Sequence[Mapping[str, float]]


def how(came: Array, right: Array, limits: Array, given: Given = (), angle: bool = False) -> str:
    """'the other sign', '2 times as much', 'too large by x[0]': what holds for all numbers (N,), or ''.

    limits: how far (N,) each may be off;  given: the numbers of the arguments at each;  angle: whether they are angles.
    """
    if not np.isfinite([came, right]).all() or not len(came):
        return ""

    def fits(value, some=1):
        """Whether the numbers are these, which says something only if so many different ones are not zero."""
        value = np.broadcast_to(value, came.shape)
        if not np.isfinite(value).all() or (np.abs(came - value) > limits + 2e-3 * np.abs(value)).any():
            return False
        far = (np.abs(came - right) > limits) & (np.abs(value) > 10 * limits)
        telling = {f"{v:.4g}" for v in value[far]}
        return len(telling) >= some

    if angle:
        for words, change in OF_ANGLES.items():
            turns = np.round((came - change(right)) / TURN)
            if fits(change(right) + TURN * turns) and (turns.any() or words != "not wrapped"):
                return words if words != "not wrapped" or np.abs(came).max() > np.pi else "off by a whole turn"
    if (np.abs(came) <= limits).all():
        return "nothing at all"
    for words, change in NAMED.items():
        if fits(change(right)):
            return words
    return _factor(came, right, fits) or _by_arguments(came, right, fits, given)


def _factor(came, right, fits):
    f = came @ right / (right @ right) if right.any() else 0.0
    if abs(f) > 1e-6 and fits(f * right, 2):
        return f"{f:.3g} times as much"
    shift = np.mean(came - right)
    if abs(shift) > 1e-6 and fits(right + shift, 3):
        return f"too {'large' if shift > 0 else 'small'} by {abs(shift):.3g}"
    return ""


def _by_arguments(came, right, fits, given):
    for name in given[0] if len(given) else ():
        if not all(name in one for one in given):
            continue
        a = np.array([one[name] for one in given])
        if len(set(a.tolist())) < 3:
            continue
        changes = {
            f"`{name}` as it is": a,
            f"`{name}` with the other sign": -a,
            f"too large by `{name}`": right + a,
            f"too small by `{name}`": right - a,
            f"times `{name}`": right * a,
            f"divided by `{name}`": right / a,
        }
        for words, value in changes.items():
            if fits(value, 3):
                return words
    return ""


def moved(came: Array, right: Array, limits: Array) -> str:
    """How whole tables (N, rows, columns) are those with their numbers elsewhere, 'transposed', or ''."""
    _, rows, columns = came.shape
    changes = {
        "transposed": right.transpose(0, 2, 1),
        "its rows are exchanged": right[:, ::-1],
        "its columns are exchanged": right[:, :, ::-1],
    }
    if rows == 1:
        del changes["its rows are exchanged"]
        changes["its numbers are in the reverse order" if columns > 2 else "its two numbers are exchanged"] = (
            changes.pop("its columns are exchanged")
        )
    for words, value in changes.items():
        if value.shape == came.shape and (np.abs(came - value) <= limits + 2e-3 * np.abs(value)).all():
            return words
    return ""
