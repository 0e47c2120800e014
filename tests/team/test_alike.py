"""Lab 8's open filters beside GroupEKF: what `compare` says of right ones, and of mistakes that a run does not show."""

import numpy as np
import pytest

from labkit import wrap
from labkit.team.alike import compare
from labkit.team.frame import relative_rms
from labkit.team.invariant import turned_about_origin

from helpers.team_answers import answer


def said(KF, capsys):
    """{step: what is told of it}, but for steps that come out the same."""
    compare(KF, answer("GroupEKF"))
    lines = capsys.readouterr().out.splitlines()
    return {line[:28].strip(): line[38:] for line in lines if not line.endswith("the same")}


@pytest.mark.parametrize("name", ["FastEKF", "InvariantEKF"])
def test_right_filters_do_the_same(name, capsys):
    assert said(answer(name), capsys) == {}


class TooEarly(answer("InvariantEKF")):
    """T before the step."""

    def predict(self, u):
        early, start = np.linalg.inv(self.frame()), self.P_xi
        super().predict(u)
        slips = self.frame() @ (self.P_xi - start) @ self.frame().T
        self.P_xi = start + early @ slips @ early.T


class Unfilled(answer("FastEKF")):
    def update(self, seen):
        super().update(seen)
        self.d2 = []


class Ungated(answer("FastEKF")):
    def update(self, seen):
        self.gate = np.inf
        super().update(seen)


class Added(answer("InvariantEKF")):
    """x + K nu."""

    def update(self, seen):
        before = self.x.copy()
        super().update(seen)
        turn = wrap(self.x[:, 2:] - before[:, 2:])
        self.x = before + np.hstack([self.x[:, :2] - before[:, :2] - turn * before[:, 1::-1] * [-1, 1], turn])


@pytest.mark.parametrize(
    "KF, steps",
    [
        (TooEarly, {"a step of odometry"}),
        (Unfilled, {"a reading just as expected", "one a little off", "one over the half turn"}),
        (Ungated, {"one beyond the gate", "the same, beside a good one"}),
        (Added, {"one a little off"}),
    ],
)
def test_what_a_whole_run_does_not_show(KF, steps, capsys):
    found = said(KF, capsys)
    assert steps <= found.keys()
    if KF is TooEarly:
        assert set(found) == steps and found["a step of odometry"].startswith("P differs: ")


def test_a_turn_about_the_origin_is_the_same_for_all():
    poses, xi = np.array([[1.0, 2.0, 3.0], [-4.0, 0.5, 0.1]]), np.array([0.0, 0.0, 0.3])
    there = turned_about_origin(poses, np.tile(xi, (2, 1)))
    c, s = np.cos(0.3), np.sin(0.3)
    np.testing.assert_allclose(there[:, :2], poses[:, :2] @ [[c, s], [-s, c]])
    np.testing.assert_allclose(there[:, 2], wrap(poses[:, 2] + 0.3))
    track = np.random.default_rng(1).normal(size=(5, 2, 3))
    turned = np.array([turned_about_origin(pose, np.tile([0.2, -1.0, 0.7], (2, 1))) for pose in track])
    assert relative_rms(turned, track) < 1e-12  # which is why nobody in the team can know it
