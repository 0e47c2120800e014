"""What the tools that students judge themselves with say to what they cannot use: a sentence, and never a number."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from labkit import (
    FilterError,
    History,
    Landmark,
    Log,
    Map,
    Robot,
    explore,
    make_filter,
    metrics,
    play,
    replay,
    simulate,
)
from labkit.checks.feedback import LabError
from labkit.legged import LeggedRobot, race
from labkit.legged.race import Result
from labkit.plots import ConsistencyPanel, MapPanel, plot_mean_nees, show_run
from labkit.team import frame_errors, scenarios
from labkit.validation import as_covariance

from helpers.reference import Q, R, history, record, solution

KF = solution("xy")


@cache
def log():
    return record()


@cache
def good():
    return history(log())


def believing(P):
    """The good history with another P throughout."""
    return replace(good(), P=np.tile(np.array(P, dtype=float), (161, 1, 1)))


def logged(**other):
    """Three steps with four measurements, but for one field."""
    fields = {"times": np.arange(4.0), "controls": np.zeros((3, 2)), "seen_step": np.array([0, 0, 1, 2])}
    fields |= {"seen_id": np.arange(4), "seen": np.ones((4, 2)), "map": Map([Landmark((1, 1), 0)])}
    return Log(**fields | other)


def with_nan():
    P = good().P.copy()
    P[7, 0, 1] = np.nan
    return replace(good(), P=P)


@pytest.mark.parametrize("measure", [metrics.nees, metrics.inside, metrics.summary, metrics.nees_per_dimension])
@pytest.mark.parametrize(
    ("believed", "message"),
    [
        (lambda: believing(np.diag([0.1, -0.1])), "after step 0 of 160 has a negative variance"),
        (lambda: believing(-np.eye(2)), "after step 0 of 160 has a negative variance"),
        (lambda: believing([[1, 0.5], [0, 1]]), "after step 0 of 160 must be symmetric"),
        (with_nan, "after step 7 of 160 has an entry that is not a finite number"),
        (lambda: believing(np.zeros((2, 2))), "variance 0 after step 0, in a direction in which it is .* off"),
    ],
)
def test_what_is_no_covariance_measures_nothing(measure, believed, message):
    with pytest.raises(FilterError, match=message):
        measure(believed(), log())


def test_of_what_is_certain_and_right_the_nees_is_that_of_the_rest():
    h = good()
    P = h.P.copy()
    P[0] = np.diag([0.0, 4.0])
    x = h.x.copy()
    x[0] = log().truth[0] + [0.0, 2.0]
    assert metrics.nees(replace(h, x=x, P=P), log())[0] == pytest.approx(1.0)


def test_what_rounding_leaves_of_a_covariance_is_one():
    rng = np.random.default_rng(1)
    A = rng.normal(size=(300, 2, 1)) * 10.0 ** rng.uniform(-6, 3, (300, 1, 1))
    for P in A @ A.swapaxes(1, 2):  # singular: one eigenvalue is zero, give or take the rounding
        as_covariance(P * (1 + 1e-14 * rng.normal(size=(2, 2))), "P")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: metrics.rmse(log(), good()), "these are Log and History"),
        (lambda: metrics.rmse(good(), simulate(Robot((2, -2), Q, R["xy"]), Map(), 80)), "160 steps and the log .* 80"),
        (lambda: metrics.errors(replace(good(), x=np.zeros((161, 3))), log()), r"\(3,\), but the truth .* \(2,\)"),
        (lambda: metrics.errors(good(), replace(log(), truth=np.full((161, 2), np.nan))), "unknown throughout"),
        (lambda: metrics.heading_rmse(good(), log()), "no heading"),
        (lambda: metrics.nees_per_dimension(good(), log(), [0, 2]), "part must be a list of positions from 0 to 1"),
        (lambda: metrics.nis(replace(good(), R=np.array(0.1)), log()), "filter's R must be a 2 x 2 covariance"),
        (lambda: metrics.nis(good(), replace(log(), map=Map())), "which the map lacks: it is empty"),
        (lambda: metrics.nis(good(), replace(log(), map=log().map[:3])), r"lacks: its ids are \[0, 1, 2\]"),
        (lambda: metrics.mean_nis(*unseen()), "nothing was ever in view"),
        (lambda: metrics.chi2_bounds(2, level=95), "level must be a probability"),
        (lambda: metrics.chi2_bounds(2, runs=0), "runs must be a whole number"),
        (lambda: metrics.steps_to_converge(good(), log(), hold=0), "hold must be a whole number"),
        (lambda: make_filter(KF, log(), Q=0.1), "Q must be a 2 x 2 covariance, but its shape is"),
        (lambda: make_filter(KF, log(), R=0.1), "R must be a 2 x 2 covariance, but its shape is"),
        (lambda: make_filter(KF, log(), x0=np.zeros(3)), "P0 must be a 3 x 3 covariance"),
        (lambda: make_filter(KF, log(), x0=(np.nan, 0)), "x0 must be finite numbers"),
        (lambda: make_filter(make_filter(KF, log()), log()), "KF must be a class, but it is an object of the class KF"),
        (lambda: replay(KF, log()), "first a filter, say from make_filter"),
        (lambda: replay(log(), make_filter(KF, log())), "first a filter, say from make_filter"),
        (lambda: explore(KF, sensor="polar"), "sensor must be 'xy' or 'rb', but it is 'polar'"),
        (lambda: explore(KF, kind="NEES"), "kind must be 'nees' or 'nis', but it is 'NEES'"),
        (lambda: explore(KF, good()), "log must be a Log"),
        (lambda: explore(KF, Q=0.1), "Q must be a 2 x 2 covariance"),
        (lambda: play(good(), logged()), "160 steps and the log .* 3"),
        (lambda: play(good(), log(), most=0), "most must be a whole number"),
        (lambda: show_run(good(), log()), "in the other order"),
        (lambda: ConsistencyPanel(None, 1.0, "both"), "kind must be 'nees' or 'nis'"),
        (lambda: plot_mean_nees(None, np.arange(5), np.ones(5)), r"values must have the shape \(runs, 5\)"),
        (lambda: simulate(Map(), Robot((2, -2), Q, R["xy"])), "needs a Robot first"),
        (lambda: simulate(Robot((2, -2), Q, R["xy"]), Map(), steps=2.5), "steps must be a whole number"),
        (lambda: simulate(Robot((2, -2), Q, R["xy"]), [(1, 2)]), "list of Landmark objects is needed"),
        (lambda: Robot("here", Q, R["xy"]), "pose must be two finite numbers"),
        (lambda: Robot((0, 0), "Q", R["xy"]), "Q must be made of numbers"),
        (lambda: Robot((0, 0), Q, R["xy"], range="far"), "range must be a positive distance"),
        (lambda: logged(seen_step=np.array([0, 2, 1, 2])), "ascend, but measurement 2 is of step 1 .* step 2: sort"),
        (lambda: logged(seen_step=np.array([0, 1, 3, 5])), "from 0 to 2, .* measurement 2 is of step 3, as are 1 more"),
        (lambda: logged(seen_step=np.array([0.0, 1, 1, 2])), "seen_step must be whole numbers"),
        (lambda: logged(seen=np.ones((4, 3))), r"seen of a log cannot have the shape \(4, 3\)"),
        (lambda: logged(truth=np.ones(4)), r"truth of a log cannot have the shape \(4,\)"),
        (lambda: logged(frame="body"), "frame must be 'world' or 'robot'"),
        (lambda: frame_errors(np.ones((5, 2, 3)), np.ones((4, 2, 3))), "must have the same shape"),
        (lambda: frame_errors(np.ones((5, 2, 3)), np.ones((5, 2, 3)), who=2), "who must be a robot from 0 to 1"),
        (lambda: race({"EKF": lambda log: 1 / 0}, [LeggedRobot(rng=1).record(20)]), "could not be made"),
        (lambda: Result("EKF", *np.zeros((3, 1, 30)), 0.0, None).recovered(), "nobody was carried away"),
    ],
)
def test_what_cannot_be_used_is_told(call, message):
    with pytest.raises((ValueError, TypeError, LabError), match=message):
        call()


def unseen():
    empty = simulate(Robot((2, -2), Q, R["xy"], rng=1), Map())
    return history(empty), empty


def test_lists_make_a_log_too():
    made = logged(times=[0, 1, 2, 3], controls=[[0, 0]] * 3, seen_step=[0, 0, 1, 2], seen=[[1, 2]] * 4)
    assert made.count.tolist() == [2, 1, 1] and made.seen.dtype == float


def test_a_picture_of_what_is_no_covariance_is_refused_and_the_player_says_why():
    with pytest.raises(FilterError, match="negative variance"):
        MapPanel(_axes()).show(log(), believing(-np.eye(2)))
    assert "negative variance" in play(believing(-np.eye(2)), log()).text.value


def _axes():
    from matplotlib.figure import Figure

    return Figure().subplots()


def test_a_team_s_history_is_measured_as_before():
    team = scenarios.cross(rng=1)
    P = np.tile(0.01 * np.eye(9), (len(team) + 1, 1, 1))
    P[:, :3] = P[:, :, :3] = 0  # the origin is known exactly
    h = History(team.times, team.truth + 0.0, P, team.truth[1:], P[1:], None)
    assert metrics.nees_per_dimension(h, team).max() == 0
