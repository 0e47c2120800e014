"""Fuzzy headings: trapezoids on the circle, many at once, and how two of them are fused.

A trapezoid has a middle theta [rad], half a core c and half a support s [rad] (c <= s), a height h and a
bias b: its value is h on the core, falls to b at the support's ends and stays there (figure 3 of the paper,
where Delta = 2 c and the flanks rise by the angle alpha).
"""

from dataclasses import dataclass

import numpy as np

from ..geometry import Array


@dataclass
class Trapezoids:
    """Arrays of one shape: theta, c, s [rad] and h; the bias b is a number or an array."""

    theta: Array
    c: Array
    s: Array
    h: Array
    b: float


def fused(one: Trapezoids, two: Trapezoids) -> tuple[Array, Array, Array, Array]:
    """Outer trapezoids (theta, c, s, h) of the products of two families of trapezoids, all of one shape (...).

    Where the cores overlap, their intersection is the new core. Where only the supports do, the new core is
    that point of their overlap where the product is largest. Where nothing does, the two contradict each
    other: the higher one stays, at the height that the other's bias leaves it.
    """
    one, two = _all_round(one), _all_round(two)
    apart = fast_wrap(two.theta - one.theta)
    side, D = np.sign(apart), abs(apart)  # positions p count from one.theta toward two.theta
    low, high = np.maximum(-one.c, D - two.c), np.minimum(one.c, D + two.c)

    # On both flanks the product is a parabola; its top lies midway between the places where the flanks,
    # drawn on, would reach zero.
    zero_one = one.c + one.h * (one.s - one.c) / np.maximum(one.h - one.b, 1e-9)
    zero_two = D - two.c - two.h * (two.s - two.c) / np.maximum(two.h - two.b, 1e-9)
    top = np.clip((zero_one + zero_two) / 2, np.maximum(one.c, D - two.s), np.minimum(one.s, D - two.c))

    overlap = low <= high
    p = np.where(overlap, (low + high) / 2, top)
    c = np.where(overlap, (high - low) / 2, 0.0)
    s = np.maximum(np.minimum(one.s, D + two.s) - p, p - np.maximum(-one.s, D - two.s))
    h = value(one, p) * value(two, D - p)

    alien = D > one.s + two.s
    keep = one.h * two.b >= two.h * one.b
    p = np.where(alien, np.where(keep, 0.0, D), p)
    c = np.where(alien, np.where(keep, one.c, two.c), c)
    s = np.where(alien, np.where(keep, one.s, two.s), s)
    h = np.where(alien, np.maximum(one.h * two.b, two.h * one.b), h)
    return fast_wrap(one.theta + side * p), np.minimum(c, np.pi), np.clip(s, np.minimum(c, np.pi), np.pi), h


def _all_round(t):
    """A core that is the whole circle has no ends, which at half a turn from theta could cut the other one."""
    whole = t.c >= np.pi
    if not np.any(whole):
        return t
    return Trapezoids(t.theta, np.where(whole, 2 * np.pi, t.c), np.where(whole, 2 * np.pi, t.s), t.h, t.b)


def fast_wrap(angle: Array) -> Array:
    """`wrap` for grids (...), many times faster than by remainder; pi itself may come out as -pi, no matter here."""
    return angle - 2 * np.pi * np.rint(angle / (2 * np.pi))


def value(trapezoid: Trapezoids, away: Array) -> Array:
    """Values (...) at angles that are `away` [rad] from the middles."""
    rise = (trapezoid.s - abs(away)) / np.maximum(trapezoid.s - trapezoid.c, 1e-9)
    return trapezoid.b + (trapezoid.h - trapezoid.b) * np.clip(rise, 0.0, 1.0)
