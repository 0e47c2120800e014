"""What labs 4 and 5 say and do not print, over many walks."""

from itertools import pairwise

import numpy as np

from labkit import metrics, replay, wrap
from labkit.legged import FIELD, FuzzyGrid, Hybrid, LeggedRobot, race, steps_until_found

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


def test_after_a_kidnapping_a_gate_refuses_what_is_right_and_without_one_most_come_back():
    walks = [LeggedRobot("real", rng=seed).record(300, kidnap=150) for seed in SEEDS]
    gated, free = ([replay(ekf(log, gate=gate), log) for log in walks] for gate in (13.8, np.inf))
    ends = [np.array([metrics.distances(*run)[-1] for run in zip(runs, walks)]) for runs in (gated, free)]
    assert np.median(ends[0]) > 2 and np.median(ends[1]) < 0.4 and 5 <= (ends[1] > 1).sum() <= 10
    spread = [np.sqrt(run.P[160:, :2, :2].trace(axis1=1, axis2=2)) for run in gated]
    assert 0.04 < np.median([one[0] for one in spread]) < 0.1 < np.median([one[-1] for one in spread]) < 0.25


def test_half_of_the_false_alarms_move_a_filter_without_a_gate_by_half_a_metre():
    moved, off, back = [], [], []
    for seed in SEEDS:
        log = LeggedRobot("real", rng=seed).record(300)
        kf, errors, alarms = ekf(log, gate=np.inf), [], []
        for k, (u, y) in enumerate(zip(log.controls, log.measurements())):
            kf.predict(u)
            true = [answer("h")(log.truth[k + 1], log.map[log.map.index(lm)]) for lm in y]
            nu = [(abs(lm.p[0] - h[0]), abs(wrap(lm.p[1] - h[1]))) for lm, h in zip(y, true)]
            lies = [one for one, h in zip(nu, true) if one[1] > 1 or one[0] > 0.7 * h[0]]
            before = kf.xk_k
            kf.update(y)
            errors.append(np.hypot(*(kf.xk_k - log.truth[k + 1])[:2]))
            if lies and np.hypot(*(before - log.truth[k + 1])[:2]) < 0.2:
                moved.append(np.hypot(*(kf.xk_k - before)[:2]))
                off.append(lies[0])
                alarms.append(k)
        back += [next((i for i, e in enumerate(errors[k + 1 :], 1) if e < 0.2), 300) for k in alarms]
    assert 30 < len(moved) and 0.5 < np.median(moved) < 1 and np.median(back) > 20
    assert (np.median(off, axis=0) > (1.2, np.pi / 2 - 0.1)).all()


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


def test_two_rings_cross_at_two_spots_and_the_third_range_decides():
    grid, robot = FuzzyGrid(), np.array([-0.8, 1.2])
    possible, spots = np.ones(grid.px.shape), []
    for k in (0, 1, 3):
        distance = np.hypot(FIELD.map[k].p[0] - grid.px, FIELD.map[k].p[1] - grid.py)
        r = np.hypot(*(FIELD.map[k].p - robot))
        possible = answer("fuse_range")(possible, distance, r, sigma=0.05 * r)
        spots.append([side.max() > 0.9 for side in (possible[grid.py < -0.5], possible[grid.py > 0.5])])
        middle = possible[abs(grid.py) < 0.2].max()
    assert spots[1:] == [[True, True], [False, True]] and middle < 0.5


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
