"""A leader and its followers: they form, hold through corners, keep apart, and all come home."""

import numpy as np
import pytest

from labkit.team import Team, TeamNoise, near
from labkit.team.formation import COLUMN, CROSSING, START, WAY, run, slots, three

from helpers.team_answers import answer, rules


@pytest.mark.slow
@pytest.mark.parametrize("start, runs, seconds", [(START, 8, 8), (CROSSING, 4, 30)])
def test_the_triangle_forms_and_holds_through_two_corners(start, runs, seconds):
    done = []
    for seed in range(runs):
        team = three(rng=seed, start=start)
        sigma = np.tile([0.13, 0.13, np.deg2rad(1.0)], (3, 1))
        sigma[0] = 1e-6
        x0 = team.poses + sigma * np.random.default_rng(seed + 100).standard_normal((3, 3))
        kf = answer("GroupEKF")(x0, np.diag(sigma.ravel() ** 2), TeamNoise(), inflate=10.0)
        done.append(run(team, kf, rules(), WAY))
    assert all(one.finished and len(one.corners) == 2 and one.formed < seconds for one in done)
    assert np.percentile([one.rms for one in done], 95) < 0.035
    assert np.percentile([one.recoveries() for one in done], 95) <= 8.5
    assert min(one.least for one in done) > 0.8


def test_without_errors_the_followers_sit_in_their_slots():
    one = run(three(rng=0), None, rules(), WAY)
    assert one.finished and one.rms < 0.01 and one.covariances is None
    assert np.allclose(one.error, one.errors.max(axis=1))


def test_a_triangle_is_three_robots():
    with pytest.raises(ValueError, match="a leader and 2 followers, but the team has 2"):
        run(Team([(0, 0, 0), (3, 1, np.pi)], rng=0), None, rules(), WAY)


def test_in_a_column_one_robot_hides_another_and_the_joint_filter_passes_on_what_it_knows():
    rms, way = {}, [(12.0, 0.0)]
    for name, sees in (("chain", [(1, 0), (2, 0), (1, 2), (2, 1)]), ("leader only", [(1, 0), (2, 0)])):
        done = []
        for seed in range(4):
            team = three(rng=seed, sees=sees)
            kf = answer("GroupEKF")(*near(team.poses, seed), TeamNoise(), inflate=10.0)
            done.append(run(team, kf, rules(), way, COLUMN))
        assert max(one.sight(2, 0) for one in done) < 0.2
        rms[name] = np.median([one.rms for one in done])
    assert rms["chain"] < 0.05 < 2 * rms["chain"] < rms["leader only"]


def test_slots_turn_with_the_leader():
    assert np.allclose(slots(np.array([1.0, 2.0, 0.0]), np.pi / 2), [[0.1, 0.9], [1.9, 0.9]])
