"""Angles, landmarks, maps and the handout's robot."""

import numpy as np
import pytest

from labkit import Landmark, Map, Robot, random_map, rotation, wrap
from labkit.geometry import ellipse, root
from labkit.log import simulate
from labkit.validation import as_covariance
from labkit.world import difference, located, sensed

from helpers.reference import Q, R


def test_wrap_brings_angles_into_minus_pi_pi():
    angles = np.array([0, np.pi, -np.pi, 3 * np.pi, np.deg2rad(358), -7.0])
    wrapped = wrap(angles)
    assert ((wrapped > -np.pi) & (wrapped <= np.pi)).all()
    np.testing.assert_allclose(np.exp(1j * wrapped), np.exp(1j * angles), atol=1e-12)
    assert wrap(-np.pi) == np.pi


def test_rotation_turns_counter_clockwise():
    np.testing.assert_allclose(rotation(np.pi / 2) @ [1, 0], [0, 1], atol=1e-15)


def test_root_is_a_root_even_of_a_singular_covariance():
    for cov in (np.array([[2.0, 0.6], [0.6, 1.0]]), np.zeros((2, 2)), np.array([[1.0, 1.0], [1.0, 1.0]])):
        np.testing.assert_allclose(root(cov) @ root(cov).T, cov, atol=1e-12)


def test_the_ellipse_has_its_points_at_three_sigma():
    mean, cov = np.array([1.0, -2.0]), np.array([[2.0, 0.6], [0.6, 1.0]])
    e = ellipse(mean, cov) - mean
    np.testing.assert_allclose(np.einsum("ki,ij,kj->k", e, np.linalg.inv(cov), e), 9.0)


def test_landmarks_are_equal_by_name_and_act_as_vectors():
    a, b = Landmark((1, 2), 7), Landmark((3, 3), 7)
    assert a == b and a == 7 and a != Landmark((1, 2), 8) and {a, b} == {a}
    np.testing.assert_array_equal(a + np.ones(2), [2, 3])
    np.testing.assert_array_equal(a - np.ones(2), [0, 1])
    np.testing.assert_array_equal(np.ones(2) - a, [0, -1])
    np.testing.assert_array_equal(b - a, [2, 1])


def test_a_map_is_a_list_of_landmarks_with_distinct_names():
    m = Map([Landmark((0, 0), "a"), Landmark((1, 1), "b")])
    assert m.index("b") == 1 == m.index(Landmark((9, 9), "b")) and len(m) == 2
    with pytest.raises(ValueError, match="already has a landmark with id 'a'"):
        m.append(Landmark((2, 2), "a"))
    with pytest.raises(TypeError, match="Landmark objects"):
        m.append((1, 2))
    assert Map().positions.shape == (0, 2)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Landmark((1, 2, 3), 5), "position of landmark 5 must be two finite numbers"),
        (lambda: Landmark((1, np.nan), 5), "two finite numbers"),
        (lambda: Robot((0, 0), np.eye(3), np.eye(2)), "Q must be a 2 x 2"),
        (lambda: Robot((0, 0), np.eye(2), [[1, 2], [0, 1]]), "R must be symmetric"),
        (lambda: Robot((0, 0), np.eye(2), -np.eye(2)), "R has a negative variance"),
        (lambda: Robot((0, 0), np.eye(2), np.eye(2), type="polar"), "type must be 'xy' or 'rb'"),
        (lambda: Robot((0, 0), np.eye(2), np.eye(2), range=0), "range must be a positive distance"),
        (lambda: random_map(-1), "number of landmarks, must be a whole number, 0 or more"),
        (lambda: as_covariance([[np.inf, 0], [0, 1]], "P0"), "P0 has an entry"),
    ],
)
def test_bad_input_is_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_sensed_and_located_are_inverse():
    offset = np.random.default_rng(0).normal(size=(20, 2))
    for sensor in ("xy", "rb"):
        np.testing.assert_allclose(located(np.array([3.0, 1.0]), sensed(offset, sensor), sensor), offset + [3, 1])


def test_only_bearings_are_wrapped_in_a_difference():
    np.testing.assert_allclose(difference([[9.0, 3.0]], [[1.0, -3.0]], "rb"), [[8.0, 6 - 2 * np.pi]])
    np.testing.assert_allclose(difference([[9.0, 3.0]], [[1.0, -3.0]], "xy"), [[8.0, 6.0]])


def test_the_robot_drives_the_handouts_square_and_then_stands():
    quiet = Robot(np.array((2, -2), dtype=np.float32), 0 * Q, R["xy"])
    commands = np.array([quiet.action() for _ in range(160)])
    corners = np.cumsum(commands * 0.25, axis=0)[31::32] + [2, -2]
    np.testing.assert_allclose(corners, [(2, 2), (-2, 2), (-2, -2), (2, -2), (2, -2)])
    np.testing.assert_allclose(quiet.p, (2, -2), atol=1e-12)
    assert quiet.t == quiet.tf == 40


def test_fields_are_covariances_of_one_step():
    r = Robot((0, 0), Q, R["xy"])
    np.testing.assert_allclose(r.Q, Q * 0.25)
    np.testing.assert_allclose(r.R, R["xy"] / 0.25)


@pytest.mark.parametrize("sensor", ["xy", "rb"])
def test_noise_has_the_covariance_that_was_asked_for(sensor):
    """Sample covariances of motion and measurement, off-diagonal included, within 5 standard errors."""
    Q_, R_ = np.array([[0.06, 0.03], [0.03, 0.05]]), np.array([[0.02, -0.005], [-0.005, 0.004]])
    spot = Map([Landmark((10, 0), 0)])
    n, r = 20000, Robot((0, 0), Q_, R_, range=30, type=sensor, rng=5)
    r.v = 0.0
    moves, looks = np.empty((n, 2)), np.empty((n, 2))
    for k in range(n):
        r.p = np.zeros(2)
        looks[k] = r.measure(spot)[0].p - [10, 0]
        r.action()
        moves[k] = r.p
    for sample, cov in ((moves, r.Q), (looks, r.R)):
        d = np.diag(cov)
        standard_error = np.sqrt((np.outer(d, d) + cov**2) / n)
        assert (abs(np.cov(sample.T) - cov) < 5 * standard_error).all()


def test_measure_sees_what_is_in_range_and_keeps_it():
    m = Map([Landmark((1, 0), "near"), Landmark((4, 0), "far")])
    r = Robot((0, 0), Q, 1e-12 * np.eye(2), type="rb", rng=0)
    y = r.measure(m)
    assert [lm.id for lm in y] == ["near"] and r.objs == y
    np.testing.assert_allclose(y[0].p, [1, 0], atol=1e-4)
    assert r.measure(Map()) == [] == r.objs


def test_bearings_are_absolute_and_wrapped():
    r = Robot((0, 0), Q, np.diag([1e-9, 1.0]), type="rb", rng=0)
    bearings = [r.measure([Landmark((-1, 0), 0)])[0].p[1] for _ in range(200)]
    assert min(bearings) > -np.pi and max(bearings) <= np.pi and np.ptp(bearings) > 5


def test_a_seed_repeats_a_run():
    a, b, c = (simulate(Robot((2, -2), Q, R["rb"], type="rb", rng=s), random_map(rng=s)) for s in (4, 4, 5))
    np.testing.assert_array_equal(a.seen, b.seen)
    assert not np.array_equal(a.truth, c.truth)


def test_nothing_touches_the_global_random_state():
    before = np.random.get_state()[1].copy()  # noqa: NPY002 - it is what must stay
    simulate(Robot((2, -2), Q, R["xy"]), random_map())
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # noqa: NPY002
