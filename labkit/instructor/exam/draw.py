"""Other inputs of the same kind: what a student's answer is tried on cannot be known beforehand."""

import numpy as np


def drawn(scenario, rng):
    """A copy of a stored scenario with other numbers, the same structure and no right outputs.

    Every number and every entry of a vector changes by some per cent, a matrix as a whole (so that a
    covariance stays one), and rows of counts are shuffled; names, zeros and lengths stay.
    """
    fresh = {key: scenario[key] for key in ("id", "look", "at", "title") if key in scenario}
    if "make" in scenario:
        args, options = scenario["make"]
        fresh["make"] = [[_other(arg, rng) for arg in args], {k: _other(v, rng) for k, v in options.items()}]
    fresh["calls"] = [[name, *(_other(arg, rng) for arg in args)] for name, *args in scenario["calls"]]
    return fresh


def _other(stored, rng):
    if isinstance(stored, float):
        return stored * _factor(rng)
    if isinstance(stored, list):
        if stored and isinstance(stored[0], list):  # a matrix
            return (np.array(stored, dtype=float) * _factor(rng)).tolist()
        return [_other(value, rng) for value in stored]
    if isinstance(stored, dict):
        ((kind, content),) = stored.items()
        if kind == "ints":
            return {kind: rng.permutation(content).tolist()}
        if kind == "readings":
            return {kind: [_other(reading, rng) for reading in content]}
        if kind in ("noise", "team_noise"):
            return {kind: {name: _other(value, rng) for name, value in content.items()}}
        if kind == "sights":
            return {kind: [[*_landmark(sight[:-1], rng), sight[-1]] for sight in content]}
        if kind == "landmark":
            return {kind: _landmark(content, rng)}
        return {kind: [_landmark(landmark, rng) for landmark in content]}
    return stored


def _landmark(stored, rng):
    name, *p = stored
    return [name, *(float(value) * _factor(rng) for value in p)]


def _factor(rng):
    """Far enough from 1 that stored results are wrong, near enough that a drive stays a drive."""
    return 1 + rng.choice([-1, 1]) * rng.uniform(0.02, 0.06)
