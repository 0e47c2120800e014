"""Other inputs of the same kind: what a student's answer is tried on cannot be known beforehand."""

from typing import Any

import numpy as np

from ...checks import kinds


def variant(scenario: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """A copy of a stored scenario with other numbers, the same structure and no right outputs.

    How much they differ is said by each kind of input, see `labkit.checks.kinds`.
    """
    fresh: dict[str, Any] = {key: scenario[key] for key in ("id", "look", "at", "title", "turns") if key in scenario}
    if "make" in scenario:
        fresh["make"] = [{name: _other(v, rng) for name, v in given.items()} for given in scenario["make"]]
    fresh["calls"] = [[name, *(_other(arg, rng) for arg in args)] for name, *args in scenario["calls"]]
    return fresh


def _other(stored, rng):
    name, kind, content = kinds.split(stored)
    fresh = kind.vary(content, rng)
    return {name: fresh} if name else fresh
