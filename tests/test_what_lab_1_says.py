"""Numbers that lab 1 tells in words, over many seeds where they are about chance."""

import math

import numpy as np
import pytest

from labkit import Landmark, Log, Map, Robot, random_map, simulate
from labkit.metrics import errors, inside, nees, semi_axis

from helpers.reference import Q, R, history, record, solution


def test_what_dead_reckoning_comes_to():
    """2.2 m after 40 s, half of the robots within 1.9 m; half as far after a quarter; one in ten beyond 3.4 m."""
    runs = [simulate(Robot((2, -2), Q, R["xy"], rng=seed), Map([])) for seed in range(400)]
    assert all(isinstance(log, Log) and len(log) == 160 for log in runs)
    told = np.cumsum(runs[0].dt * runs[0].controls, axis=0)
    off = np.array([np.linalg.norm(log.truth[1:] - log.truth[0] - told, axis=1) for log in runs])
    rms = np.sqrt(np.mean(off**2, axis=0))
    assert rms[39] == pytest.approx(1.12, abs=0.06) and rms[-1] == pytest.approx(2.24, abs=0.12)
    assert np.median(off[:, -1]) == pytest.approx(1.86, abs=0.15)
    assert 0.05 < np.mean(off[:, -1] > 3.38) < 0.16


def test_how_much_of_a_gaussian_is_within_some_sigmas():
    assert [round(100 * math.erf(n / math.sqrt(2)), 1) for n in (1, 2, 3)] == [68.3, 95.4, 99.7]
    assert round(100 * (1 - math.exp(-9 / 2)), 1) == 98.9


@pytest.mark.parametrize("place", [-2.0, 2.0])
def test_what_is_seen_too_far_to_the_right_moves_the_estimate_to_the_left(place):
    """Wherever the landmark is; by the gain that section 1 has on the line, with the other sign."""
    kf = solution("xy")((0, 0), 3 * np.eye(2), Q, R["xy"], Map([Landmark((place, 0), 0)]))
    kf.update([Landmark((place + 1.0, 0.0), 0)])
    np.testing.assert_allclose(kf.xk_k, [-3 / 3.16, 0], atol=1e-12)
    np.testing.assert_allclose(kf.Pk_k, 0.1519 * np.eye(2), atol=1e-4)


def test_the_first_look_and_the_dark():
    for seed in range(30):
        log = simulate(Robot((2, -2), Q, R["xy"], rng=seed), random_map(25, rng=seed), 1)
        half, p = semi_axis(history(log)), int(log.count[0])
        assert half[0] == pytest.approx(5.2, abs=0.01)
        if p:  # the belief before counts for little: it is the mean of p landmarks
            assert half[1] == pytest.approx(1.2 / math.sqrt(p), rel=0.05)
        log = record(seed=seed, landmarks=3)
        half, seen = semi_axis(history(log)), log.count > 0
        assert (np.diff(half)[~seen] > 0).all()  # predict adds, and nothing takes away
        assert (half[1:][seen] <= 1.2).all()  # 3σ of the look alone
        for k in np.flatnonzero((half[:-1] > 1.5) & seen):  # the first look takes more than all later ones
            assert half[k] - half[k + 1] > half[k + 1] - half[k + 1 :].min()
        assert half.max() > 2


def test_what_the_second_figure_says():
    """The robot is outside of 3σ about twice a run; R told 100 times as large makes bounds of 1.4 m of 0.4 m."""
    runs = [record(seed=seed, landmarks=25) for seed in range(30)]
    outside = [int(np.sum(~inside(history(log), log))) for log in runs]
    assert 1 < np.mean(outside) < 2.5 and outside.count(0) > 3 and max(outside) >= 4
    log = record(seed=1, landmarks=25)
    wide = history(log, R=100 * R["xy"])
    assert semi_axis(history(log))[20:].mean() == pytest.approx(0.4, abs=0.05)
    assert semi_axis(wide)[20:].mean() == pytest.approx(1.4, abs=0.15)
    assert (abs(errors(wide, log)) < 0.8).all(axis=1)[20:].all() and nees(wide, log)[1:].mean() < 2
    assert nees(history(log), log)[1:].mean() == pytest.approx(1.85, abs=0.01)


def test_other_numbers_of_landmarks_leave_the_path_as_it_is():
    paths = [record(seed=1, landmarks=n).truth for n in (3, 25, 60)]
    assert all((path == paths[0]).all() for path in paths)


def test_with_sixty_landmarks_the_ellipses_are_small_everywhere():
    assert max(semi_axis(history(record(seed=seed, landmarks=60)))[1:].max() for seed in range(10)) < 0.6
