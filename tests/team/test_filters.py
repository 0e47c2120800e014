"""The team's filters by other means: numeric derivatives, filterpy, each other, statistics."""

import dataclasses

import numpy as np
import pytest

from labkit import metrics, replay
from labkit.geometry import compose, relative
from labkit.history import History
from labkit.metrics import nees_per_dimension
from labkit.team import (
    Route,
    Team,
    TeamNoise,
    delayed,
    frame_errors,
    later,
    of_logs,
    own_start,
    relative_nees_per_dimension,
    scenarios,
)
from labkit.team.converted import expected_spread, shift, spread
from labkit.team.log import recorded
from labkit.team.pairs import PairFilters

from helpers.team_answers import answer, started

NOISE = TeamNoise()
WHITE = dataclasses.replace(NOISE, scale=0.0, turn_scale=0.0, drift=0.0)


def team_of(n, rng, steps=40, **more):
    """A log of n robots that drive circles and see one another."""
    around = 2 * np.pi * np.arange(n) / n
    poses = np.column_stack([5 * np.cos(around), 5 * np.sin(around), around - np.pi / 2])
    team = Team(poses, WHITE, rng=rng, fov=2 * np.pi, **more)
    commands = np.tile([0.2, 0.3], (n, 1))
    return team.record(lambda team: commands, steps)


# By other means


def test_the_jacobians_are_the_derivatives():
    h, jacobians, rng = answer("h"), answer("jacobians"), np.random.default_rng(0)
    for _ in range(200):
        o, p = rng.normal(size=(2, 3)) * [4, 4, 2]
        for of, J in enumerate(jacobians(o, p)):
            for k in range(3):
                pose = [o, p]
                sides = []
                for step in (1e-6, -1e-6):
                    pose[of] = np.array([o, p][of])
                    pose[of][k] += step
                    sides.append(h(*pose))
                change = sides[0] - sides[1]
                change[1] = (change[1] + np.pi) % (2 * np.pi) - np.pi
                assert np.allclose(
                    change / 2e-6, np.asarray(J)[:, k], atol=1e-6 * (1 + 1 / np.hypot(*(p - o)[:2]) ** 3)
                )


def test_it_is_filterpys_extended_filter():
    from filterpy.kalman import ExtendedKalmanFilter

    log, h, jacobians = team_of(3, 1, steps=25), answer("h"), answer("jacobians")
    mine = started(log, 1, WHITE, gate=np.inf)
    theirs = ExtendedKalmanFilter(dim_x=9, dim_z=2)
    theirs.x, theirs.P = mine.x.ravel().copy(), mine.P.copy()

    def residual(a, b):
        d = a - b
        d[1] = (d[1] + np.pi) % (2 * np.pi) - np.pi
        return d

    for u, seen in zip(log.controls, log.measurements()):
        F, Q = np.eye(9), np.zeros((9, 9))
        for i, (ui, theta) in enumerate(zip(u, theirs.x[2::3])):
            c, s = np.cos(theta), np.sin(theta)
            W = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
            step = W @ ui
            F[3 * i, 3 * i + 2], F[3 * i + 1, 3 * i + 2] = -step[1], step[0]
            Q[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = W @ np.diag(4 * WHITE.of_step(ui) ** 2) @ W.T
        x = compose(theirs.x.reshape(3, 3), u).ravel()
        theirs.F, theirs.Q = F, Q
        theirs.predict()
        theirs.x = x  # its own is linear
        for i, j, z in seen:

            def H(x, i=i, j=j):
                full = np.zeros((2, 9))
                full[:, 3 * i : 3 * i + 3], full[:, 3 * j : 3 * j + 3] = jacobians(*x.reshape(3, 3)[[i, j]])
                return full

            def hx(x, i=i, j=j):
                return h(*x.reshape(3, 3)[[i, j]])

            sigma = np.array([WHITE.range, WHITE.of_bearing(hx(theirs.x)[0])])
            theirs.update(z, H, hx, R=np.diag(sigma**2), residual=residual)
        mine.predict(u)
        mine.update(seen)
        off = mine.x.ravel() - theirs.x
        off[2::3] = (off[2::3] + np.pi) % (2 * np.pi) - np.pi
        assert abs(off).max() < 1e-9 and abs(mine.P - theirs.P).max() < 1e-9


def test_the_fast_filter_is_the_same_where_readings_come_one_by_one():
    log = team_of(4, 2, steps=30)
    one, two = (started(log, 2, WHITE, KF=name) for name in ("GroupEKF", "FastEKF"))
    for u, seen in zip(log.controls, log.measurements()):
        for kf in (one, two):
            kf.predict(u)
            kf.update(seen[:1])
        assert np.allclose(one.x, two.x, atol=1e-10) and np.allclose(one.P, two.P, atol=1e-10)


def test_a_pair_filter_is_the_joint_filter_of_two_seen_from_the_observer():
    team = Team([(3, 1, 2.0), (0, 0, 0)], WHITE, sees=[(1, 0)], rng=4)
    log = team.record(Route({0: [(3, -2), (6, 0)]}), 60)
    P0 = np.diag([0.02, 0.02, 0.01, 1e-14, 1e-14, 1e-14])
    x0 = log.truth[0] + [[0.1, -0.05, 0.05], [0, 0, 0]]
    joint = answer("GroupEKF")(x0, P0, WHITE)
    pair = PairFilters(relative(x0[:1], x0[1:]), P0[None, :3, :3], WHITE)
    for u, seen in zip(log.controls, log.measurements()):
        joint.predict(u)
        joint.update(seen)
        pair.predict(u[0], u[1:])
        if seen:
            pair.update([0], [seen[0][2]])
        assert np.allclose(relative(joint.x[0], joint.x[1]), pair.x[0], atol=1e-6)
        assert np.allclose(joint.P[:3, :3], pair.P[0], atol=1e-6)


@pytest.mark.slow
def test_a_filter_that_starts_with_section_two_alone_finds_the_others():
    for seed in range(4):
        kf, rest = own_start(answer("GroupEKF"), scenarios.cross(rng=seed))
        errors = frame_errors(replay(kf, rest).x, rest.truth)
        assert errors.ego[0] < 0.15 and errors.ego[50:].mean() < 0.04


def test_a_log_can_begin_later():
    log = scenarios.cross(rng=5)
    rest = later(log, 100)
    assert len(rest) == len(log) - 100 and np.array_equal(rest.truth, log.truth[100:])
    assert [len(s) for s in rest.measurements()] == [len(s) for s in log.measurements()[100:]]
    with pytest.raises(ValueError, match="first must be a step"):
        later(log, 620)


# Points


def test_the_spread_of_a_point_is_that_of_many():
    rng, d, sigma_d = np.random.default_rng(0), 6.0, 0.3
    for sigma in (0.05, 0.3):
        r, alpha = d + sigma_d * rng.standard_normal(400_000), 0.7 + sigma * rng.standard_normal(400_000)
        out = np.stack([np.cos(alpha), np.sin(alpha)], axis=-1)
        point = r[:, None] * out * np.exp(sigma**2 / 2)
        middle = d * np.array([np.cos(0.7), np.sin(0.7)])
        assert np.allclose(point.mean(axis=0), middle, atol=0.01)
        assert np.allclose(np.cov(point.T), expected_spread(d, 0.7, sigma_d, sigma), rtol=0.03, atol=0.003)
        # Each reading's own spread makes the errors right on average, one by one.
        e, C = point - middle, spread(r, alpha, sigma_d, sigma)
        assert np.einsum("ki,ki->k", e, np.linalg.solve(C, e[..., None])[..., 0]).mean() == pytest.approx(2, rel=0.05)
        added = (r + shift(r, sigma))[:, None] * out
        assert np.linalg.norm(added.mean(axis=0) - middle) < 0.1 * np.linalg.norm(
            (r[:, None] * out).mean(axis=0) - middle
        )


def test_a_fine_bearing_makes_all_ways_alike():
    d, alpha = np.array([2.0, 6.0]), np.array([0.1, -2.5])
    raw, *others = (spread(d, alpha, 0.05, 0.005, way) for way in ("raw", "additive", "multiplicative"))
    for other in others:
        assert np.allclose(other, raw, rtol=0.01, atol=1e-6)
    with pytest.raises(ValueError, match="way must be one of"):
        spread(d, alpha, 0.05, 0.005, "best")


@pytest.mark.slow
def test_points_with_the_spread_of_their_own_reading_deceive():
    told = dataclasses.replace(WHITE, bearing=np.deg2rad(5))
    values = {name: [] for name in ("GroupEKF", "ConvertedKF", "AtReading")}
    for seed in range(4):
        log = scenarios.cross(rng=seed, noise=told)
        for name in values:
            h = replay(started(log, seed, told, name, inflate=1.0), log)
            values[name].append(nees_per_dimension(h, log).mean())
    mean = {name: np.mean(value) for name, value in values.items()}
    assert mean["ConvertedKF"] == pytest.approx(mean["GroupEKF"], abs=0.2) and mean["AtReading"] > 2


# Who knows what


def test_robots_that_hear_the_same_build_the_same_frame():
    log = scenarios.moving(rng=1)
    one, two = (replay(started(log, 1), delayed(log, 0, 0.0, rng=i)).x for i in (0, 1))
    assert np.array_equal(one, two)
    lossy = [replay(started(log, 1), delayed(log, 0, 0.5, rng=i)).x for i in (0, 1)]
    assert not np.array_equal(*lossy)
    assert np.mean([frame_errors(x, log.truth).ego.mean() for x in lossy]) < 0.06


def test_posts_that_are_known_make_a_map_of_the_hall():
    log = scenarios.rectangle(rng=3, laps=1, posts=True)
    part = of_logs([log.logs[i] for i in (0, 5, 6, 7, 8)], (0, 5, 6, 7, 8))
    x = replay(answer("GroupEKF")(part.truth[0], 1e-12 * np.eye(15), NOISE), part).x
    assert np.allclose(x[-1, 1:], part.truth[-1, 1:], atol=1e-3)
    assert frame_errors(x, part.truth).gauge.mean() < 0.04


def test_the_relative_nees_is_that_of_samples_and_does_not_mind_the_frame():
    rng = np.random.default_rng(0)
    truth = np.tile([[0, 0, 0.3], [4, 1, 2.0], [-2, 3, -1.0]], (3000, 1, 1))
    A = rng.normal(size=(9, 9)) * np.tile([0.05, 0.05, 0.01], 3)[:, None]
    P = A @ A.T
    poses = truth + (rng.standard_normal((3000, 9)) @ A.T).reshape(-1, 3, 3)
    P = np.tile(P, (3000, 1, 1))
    history = History(np.arange(3000.0), poses, P, poses[1:], P[1:], None)
    log = recorded(0.2, np.zeros((2999, 3, 3)), truth, [[]] * 2999, "three that stand")
    assert relative_nees_per_dimension(history, log) == pytest.approx(1, abs=0.05)
    np.testing.assert_allclose(metrics.nees(history, log), 9 * metrics.nees_per_dimension(history, log), rtol=1e-6)
    truth[:100] = np.nan  # not known for a while
    log = recorded(0.2, np.zeros((2999, 3, 3)), truth, [[]] * 2999, "three that stand")
    assert relative_nees_per_dimension(history, log) == pytest.approx(1, abs=0.05)
