"""What deceives a team, and what it says then: false readings, robots out of sight, input that cannot be."""

import dataclasses
import warnings

import numpy as np
import pytest

from labkit import metrics, replay
from labkit.checks.feedback import FilterError
from labkit.geometry import align, transform
from labkit.metrics import nees_per_dimension
from labkit.team import (
    FrameWarning,
    Route,
    Team,
    TeamLog,
    TeamNoise,
    delayed,
    frame_errors,
    initial_pose,
    of_logs,
    scenarios,
)
from labkit.team.pairs import PairFilters

from helpers.team_answers import started

NOISE = TeamNoise()
WHITE = dataclasses.replace(NOISE, scale=0.0, turn_scale=0.0, drift=0.0)


def test_the_papers_filter_is_too_sure_and_fails_where_observers_move():
    log = scenarios.cross(rng=1)
    h = replay(started(log, 1, KF="PaperEKF"), log)
    assert nees_per_dimension(h, log, np.delete(np.arange(9), 2)).mean() > 4
    log = scenarios.moving(rng=2)
    with pytest.warns(FrameWarning, match="lie beyond the gate") as told:
        x = replay(started(log, 2, KF="PaperEKF"), log).x
    assert [f"of robot {i} " in str(one.message) for i, one in zip((1, 3), told)] == [True, True]
    assert frame_errors(x, log.truth).ego.mean() > 1


def test_who_is_never_seen_is_known_worse_and_worse_and_says_so():
    values, spreads = [], []
    for seed in range(15):
        team = Team([(0, 0, 0), (4, 1, np.pi), (-3, -2, 0.5)], WHITE, sees=[(0, 1), (1, 0)], fov=2 * np.pi, rng=seed)
        commands = np.array([[0.2, 0.3], [0.2, 0.3], [0.3, 0.2]])
        log = team.record(lambda team: commands, 200)
        h = replay(started(log, seed, WHITE, inflate=1.0), log)
        values.append(3 * nees_per_dimension(h, log, [6, 7, 8]))
        spreads.append(np.sqrt(h.P[:, 6, 6] + h.P[:, 7, 7]))
    low, high = metrics.chi2_bounds(3, runs=15, level=0.99)
    mean = np.mean(values, axis=0)
    assert np.mean((low < mean) & (mean < high)) > 0.9
    assert np.mean(spreads, axis=0)[-1] > 1.15 * np.mean(spreads, axis=0)[0]


def test_nothing_but_false_readings_is_no_silent_frame():
    team = Team(
        [(3, 2, np.pi), (-5, -4, 0.7), (5, 4, -2.4)], sees=[(1, 0), (2, 0)], rng=1, spurious=(-20, -20, 40, 40, 1.0)
    )
    log = team.record(Route({0: scenarios.RECTANGLE}), 250)
    with pytest.warns(FrameWarning, match="not to be trusted"):
        replay(started(log, 1), log)
    one, track = log.logs[1], log.truth[1:, 0, :2]
    with pytest.raises(ValueError, match="contradict each other"):
        initial_pose(track[one.seen_step], *one.seen.T)


@pytest.mark.parametrize("seed", range(4))
def test_honest_runs_raise_no_warning(seed):
    with warnings.catch_warnings():
        warnings.simplefilter("error", FrameWarning)
        for log in (scenarios.rectangle(rng=seed, laps=1), scenarios.moving(rng=seed)):
            replay(started(log, seed), log)


def test_readings_that_are_no_numbers_do_not_place_an_observer():
    track = np.column_stack([np.linspace(0, 3, 30), np.zeros(30)])
    with pytest.raises(ValueError, match="must be finite numbers"):
        initial_pose(track, np.full(30, np.nan), np.zeros(30))
    with pytest.raises(ValueError, match=r"ranges and bearings \(N,\)"):
        initial_pose(track, np.ones(10), np.zeros(10))


def test_what_is_left_in_x_and_p_must_be_an_estimate():
    log = scenarios.cross(rng=1)
    for change, told in (
        (lambda kf: setattr(kf, "x", kf.x[0]), r"x should have shape \(3, 3\), but it has shape \(3,\)"),
        (lambda kf: setattr(kf, "P", np.ones(9)), r"P should have shape \(9, 9\), but it has shape \(9,\)"),
        (lambda kf: setattr(kf, "P", -np.eye(9)), "a variance in your filter's P is negative"),
    ):
        kf = started(log, 1)
        update = kf.update
        kf.update = lambda seen, kf=kf, change=change, update=update: (update(seen), change(kf))
        with pytest.raises(FilterError, match=told):
            replay(kf, log)


TRACK = np.column_stack([np.linspace(0, 3, 30), np.zeros(30)])


@pytest.mark.parametrize(
    "make, told",
    [
        (lambda: initial_pose(np.array([[0, 0], [2, 0.0]] * 10), np.ones(20), np.zeros(20)), "tell too little"),
        (lambda: initial_pose(TRACK, np.ones(29), np.zeros(30)), "must be"),
        (lambda: initial_pose(np.zeros((30, 3)), np.ones(30), np.zeros(30)), "track must be"),
        (lambda: align(np.ones((4, 2)) * np.nan, TRACK[:4]), "must be finite"),
        (lambda: align(TRACK[:4], np.ones((4, 2))), "two different points"),
        (lambda: of_logs([]), "two logs or more"),
        (lambda: of_logs(scenarios.cross(rng=1).logs, (0, 1)), "an id for each"),
        (lambda: delayed(scenarios.cross(rng=1), np.nan), "steps must be a whole number"),
        (lambda: delayed(scenarios.cross(rng=1), 0, "a"), "lost must be a share"),
        (lambda: TeamNoise(range="a"), "range must be a number"),
        (lambda: Team([(0, 0, 0), (3, 0, 0)], reach=np.nan), "reach a distance"),
        (lambda: Team([(0, 0, 0), (3, 0, 0)], fov=[1, 2, 3]), "one for each of the 2 robots"),
        (lambda: Team([(0, 0, 0), (3, 0, 0)], spurious=(0, 0, 1, 1)), "spurious must be"),
        (lambda: Team([(0, 0, 0), (3, 0, 0)]).record(Route({5: [(1, 1)]}), 3), "a way for robot 5"),
        (lambda: Team([(0, 0, 0), (3, 0, 0)]).record(Route({}), 0), "at least one step"),
        (
            lambda: PairFilters(np.ones((2, 3)), [np.eye(3)] * 2, WHITE).update([1, -1], np.ones((2, 2))),
            "who must name",
        ),
        (lambda: PairFilters(np.ones((2, 3)), [np.eye(3)] * 2, WHITE).update([1, 1], np.ones((2, 2))), "two readings"),
        (lambda: PairFilters(np.ones((2, 3)), [np.eye(3)] * 2, WHITE).update([0, 1], np.ones((1, 2))), "who must name"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(make, told):
    with pytest.raises(ValueError, match=told):
        make()


def test_clocks_an_hour_apart_are_no_team():
    logs = [dataclasses.replace(log, times=log.times + 1.2e9) for log in scenarios.cross(rng=1).logs]
    with pytest.raises(ValueError, match="clock of robot 2"):
        TeamLog((*logs[:2], dataclasses.replace(logs[2], times=logs[2].times + 3600)), (0, 1, 2))


def test_where_the_truth_is_unknown_the_other_steps_are_laid_on_it():
    log = scenarios.rectangle(rng=1, laps=1)
    truth, x = log.truth.copy(), transform(log.truth, 0.2, np.array([1, 2]))
    truth[50:60] = np.nan
    errors = frame_errors(x, truth)
    assert errors.turned == pytest.approx(-0.2) and np.isnan(errors.aligned).sum() == 10
    assert np.nanmax(errors.aligned) < 1e-9
