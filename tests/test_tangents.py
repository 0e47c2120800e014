"""The curve, its tangent and a belief pushed through both; and a library's filter beside the student's."""

import numpy as np
import pytest
from matplotlib import pyplot as plt

from labkit.history import by_filterpy, make_filter, replay
from labkit.notebook.answers import load_answer
from labkit.tangents import show_tangent

from helpers.reference import ROOT, record, solution


@pytest.fixture(scope="module")
def answers():
    return [load_answer("03_range_bearing_ekf", name, ROOT / "solutions") for name in ("h", "jacobian")]


@pytest.mark.parametrize("sigma, impossible", [(0.2, False), (1.5, True)])
def test_only_a_wide_belief_gets_impossible_ranges_from_the_tangent(answers, sigma, impossible, monkeypatch):
    monkeypatch.setattr(plt, "show", lambda: None)
    show_tangent(*answers, np.array([0.0, 1.0]), 1.0, sigma)
    left, right = plt.gcf().axes
    curve, tangent = (line.get_ydata() for line in left.lines[:2])
    assert curve.min() >= 1 and (tangent.min() < 0) == impossible
    assert (tangent <= curve + 1e-9).all() and np.isclose(curve - tangent, 0, atol=1e-3).any()
    edge = min(
        patch.get_xy()[:, 0].min()
        for patch in right.patches
        if hasattr(patch, "get_xy") and np.ndim(patch.get_xy()) == 2
    )
    assert (edge < 0) == impossible
    plt.close("all")


def test_filterpys_filter_is_the_solutions(answers):
    log, KF = record("rb", landmarks=8), solution("rb")
    mine, other = replay(make_filter(KF, log), log), by_filterpy(log, *answers, like=make_filter(KF, log))
    for name in ("x", "P", "x_prior", "P_prior", "R"):
        np.testing.assert_allclose(getattr(mine, name), getattr(other, name), atol=1e-9)
