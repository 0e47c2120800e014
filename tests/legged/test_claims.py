"""What labs 4 and 5 say and do not print, over many walks."""

from itertools import pairwise

import numpy as np

from labkit import metrics, replay
from labkit.legged import FuzzyGrid, Hybrid, LeggedRobot, race, steps_until_found

from helpers.localizers import answer, ekf

SEEDS = range(30)


def test_the_papers_wide_start_converges_mostly_and_without_a_gate_nearly_always():
    """P0 = I, and a start that is drawn from it."""
    walks = [LeggedRobot("paper", rng=seed).record(90) for seed in SEEDS]
    starts = [log.truth[0] + np.random.default_rng(1000 + seed).normal(0, 1, 3) for log, seed in zip(walks, SEEDS)]
    for gate, least in ((13.8, 22), (np.inf, 28)):
        runs = [(replay(ekf(log, x0, np.eye(3), gate=gate), log), log) for log, x0 in zip(walks, starts)]
        steps = [steps_until_found(metrics.distances(*run)[1:]) for run in runs]
        assert np.isfinite(steps).sum() >= least and np.nanmedian(steps) < 8


def test_measured_numbers_reach_p_by_side_roads():
    """Jacobians are taken at the estimate: from another start, P is another one, by a few per cent."""
    most = 0.0
    for seed in SEEDS:
        log = LeggedRobot("paper", rng=seed).record(60)
        other = log.truth[0] + np.random.default_rng(seed).normal(0, 0.1, 3)
        one, two = (np.sqrt(np.trace(replay(ekf(log, x0), log).P[:, :2, :2], axis1=1, axis2=2)) for x0 in (None, other))
        most = max(most, abs(two / one - 1)[20:].max())
    assert 0.01 < most < 0.1


def test_the_ramp_meets_its_bias_at_1_8_sigma():
    sigma, cell = 0.1, 0.1
    e = sigma + 0.3 * cell + sigma * np.array([0, 1, 1.7, 1.8, 3])
    S = answer("fuse_range")(np.ones(6), np.array([2.0, *(2 + e)]), 2.0, sigma, cell, 0.2)
    np.testing.assert_allclose(S, [1, 1, 1 - 0.45, 1 - 0.45 * 1.7, 0.2, 0.2])


def test_larger_cells_lose_precision_but_less_than_they_grow():
    walks = [LeggedRobot("real", rng=seed).record(115) for seed in SEEDS]
    fine, coarse = race(
        {f"{cell}": lambda log, cell=cell: FuzzyGrid(log.noise.told(), cell=cell) for cell in (0.1, 0.4)}, walks
    )
    assert 1.5 < coarse.tracking.mean() / fine.tracking.mean() < 4


def test_a_hybrid_counts_its_switches():
    log = LeggedRobot("real", rng=3).record(250, kidnap=120)
    both = Hybrid(FuzzyGrid(log.noise.told()), lambda x0, P0: ekf(log, x0, P0), answer("lost"))
    modes = [both.mode]
    for u, y in zip(log.controls, log.measurements()):
        both.predict(u)
        both.update(y)
        modes.append(both.mode)
    assert both.switches == sum(a != b for a, b in pairwise(modes)) == 3
