"""Poses and motions in the plane, against matrices in homogeneous coordinates, and what is done with them."""

import numpy as np
import pytest

from labkit import wrap
from labkit.geometry import align, compose, inverse, relative, transform

X, U, V = np.random.default_rng(1).uniform(-4, 4, (3, 50, 3))


def matrices(poses):
    """(N, 3, 3) that take homogeneous coordinates from the frames of poses to that of the world."""
    c, s, one, zero = np.cos(poses[:, 2]), np.sin(poses[:, 2]), np.ones(len(poses)), np.zeros(len(poses))
    rows = [[c, -s, poses[:, 0]], [s, c, poses[:, 1]], [zero, zero, one]]
    return np.moveaxis(np.array(rows), -1, 0)


def same(a, b):
    off = np.asarray(a) - b
    np.testing.assert_allclose(off[..., :2], 0, atol=1e-12)
    np.testing.assert_allclose(wrap(off[..., 2]), 0, atol=1e-12)


def test_composition_inverse_and_relative_pose_are_those_of_matrices():
    for poses, due in (
        (compose(X, U), matrices(X) @ matrices(U)),
        (inverse(U), np.linalg.inv(matrices(U))),
        (relative(X, U), np.linalg.inv(matrices(U)) @ matrices(X)),
        (transform(X, 0.7, [1, 2]), matrices(np.array([[1, 2, 0.7]])) @ matrices(X)),
    ):
        np.testing.assert_allclose(matrices(poses), due, atol=1e-12)
    np.testing.assert_allclose(compose([1, 0, np.pi / 2], (0.5, 0.1, 0)), [0.9, 0.5, np.pi / 2])


def test_motions_add_up_can_be_undone_and_lead_from_one_pose_to_another():
    same(compose(compose(X, U), V), compose(X, compose(U, V)))
    same(compose(compose(X, U), inverse(U)), X)
    same(compose(inverse(U), U), np.zeros(3))
    same(compose(X, relative(U, X)), U)
    same(relative(compose(X, U), X), U)
    same(relative(transform(X, 2.0, [3, -1]), transform(U, 2.0, [3, -1])), relative(X, U))


def test_many_poses_and_many_motions_come_in_one_call():
    for f in (compose, relative):
        np.testing.assert_array_equal(f(X[:, None], U[:2]), [[f(a, b) for b in U[:2]] for a in X])
    np.testing.assert_array_equal(transform([1, 0], X[:, 2], X[:, :2]), compose(X, [1, 0, 0])[:, :2])
    assert (abs(compose(X, U)[:, 2]) <= np.pi).all() and (abs(relative(X, U)[:, 2]) <= np.pi).all()


def test_alignment_undoes_a_turn_and_a_shift_and_nothing_else():
    there = transform(X[:, :2], 0.7, [2.0, -1.0])
    for weights in (None, np.arange(50)):
        angle, shift = align(X[:, :2], there, weights)
        assert angle == pytest.approx(0.7)
        np.testing.assert_allclose(shift, [2, -1])
    assert abs(align(2 * X[:, :2], X[:, :2])[0]) < 1e-9  # a scale is left as it is
    there[7] += 100
    assert abs(align(X[:, :2], there)[0] - 0.7) > 0.1
    assert align(X[:, :2], there, np.arange(50) != 7)[0] == pytest.approx(0.7)  # what has no weight has no say
