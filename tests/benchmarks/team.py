"""How well a team finds itself and holds its formation: the figures of lab 6, over many runs.

python tests/benchmarks/team.py [--runs 30]
"""

import argparse
import dataclasses
import sys
import time
import warnings
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from labkit import Landmark, metrics, random_map, replay  # noqa: E402
from labkit.geometry import relative  # noqa: E402
from labkit.metrics import nees_per_dimension  # noqa: E402
from labkit.notebook.answers import load_answer  # noqa: E402
from labkit.team import FrameWarning, TeamNoise, dead_reckoned, frame_errors, scenarios  # noqa: E402
from labkit.team.formation import CROSSING, WAY, run, three  # noqa: E402
from labkit.team.pairs import PairFilters  # noqa: E402
from labkit.team.smoother import least_squares  # noqa: E402

from helpers.team_answers import answer, rules, start_errors, started  # noqa: E402

NOISE = TeamNoise()
WHITE = dataclasses.replace(NOISE, scale=0.0, turn_scale=0.0, drift=0.0)


def start(runs):
    for scenario in (scenarios.cross, scenarios.rectangle):
        far, turned = start_errors(scenario, runs)
        print(
            f"start after 3.3 m, {scenario.__name__}: {100 * far:.1f} cm,"
            f" {np.rad2deg(turned):.2f} degrees rms (at most 13, 1.0)"
        )


def filters(runs):
    for scenario, due in (
        (scenarios.cross, "2.3 / 2.1"),
        (scenarios.rectangle, "1.8 / 1.9"),
        (scenarios.moving, "6.2 / 2.1"),
    ):
        for name in ("dead reckoning", "PaperEKF", "GroupEKF", "ConvertedKF"):
            errors = []
            for seed in range(runs):
                log, value = scenario(rng=seed), np.nan
                if name == "dead reckoning":
                    x = dead_reckoned(log)
                else:
                    h = replay(started(log, seed, KF=name), log)
                    x, part = h.x, np.delete(np.arange(3 * log.n), 2) if name == "PaperEKF" else None
                    value = nees_per_dimension(h, log, part).mean()
                one = frame_errors(x, log.truth)
                errors.append([100 * one.ego.mean(), 100 * one.aligned.mean(), value])
            e = np.median(errors, axis=0)
            print(
                f"{log.name}, {name}: ego {e[0]:.1f}, aligned {e[1]:.1f} cm (GroupEKF at most {due}),"
                f" NEES per dimension {e[2]:.2f}"
            )


def honesty(runs):
    last, whole, values = [], [], []
    for seed in range(runs):
        log = scenarios.cross(rng=seed, noise=WHITE)
        kf = started(log, seed, WHITE, inflate=1.0)
        x0, P0 = kf.x.copy(), kf.P.copy()
        h = replay(kf, log)
        best = frame_errors(least_squares(log, x0, P0, WHITE), log.truth)
        one = frame_errors(h.x, log.truth)
        last.append(one.ego[-1] / best.ego[-1])
        whole.append(one.aligned.mean() / best.aligned.mean())
        values.append(9 * nees_per_dimension(h, log))
    mean = np.mean(values, axis=0)
    low, high = metrics.chi2_bounds(9, runs=runs)
    print(
        f"white odometry: filter / least squares, last step {np.median(last):.2f} (1.05),"
        f" whole run {np.median(whole):.2f} (2.1)"
    )
    print(
        f"NEES per dimension {mean.mean() / 9:.2f},"
        f" {100 * np.mean((low < mean) & (mean < high)):.0f} % of the steps inside the bounds (90)"
    )


def hard(runs):
    pairs, dark = [], []
    for seed in range(runs):
        both = [scenarios.rectangle(rng=seed, probability=p) for p in (0.0, 0.3)]
        pairs.append([frame_errors(replay(started(log, seed), log).x, log.truth).aligned.mean() for log in both])
        log = scenarios.rectangle(rng=seed, probability=0.0, dark=(300, 600), laps=2)
        dark.append(frame_errors(replay(started(log, seed), log).x, log.truth).ego[610])
    clean, false = np.median(pairs, axis=0)
    print(f"false readings behind the gate: {100 * (false / clean - 1):+.0f} % (at most 5)")
    print(f"60 s without sight, 2 s later: {100 * np.percentile(dark, 95):.1f} cm in 95 % (at most 10)")


def formation(runs):
    sigma = np.tile([0.13, 0.13, np.deg2rad(1.0)], (3, 1))
    sigma[0] = 1e-6
    for name, options in (("S4", {}), ("S4 from a crossing start", {"start": CROSSING})):
        done = []
        for seed in range(runs):
            team = three(rng=seed, **options)
            x0 = team.poses + sigma * np.random.default_rng(seed + 1000).standard_normal((3, 3))
            done.append(
                run(team, answer("GroupEKF")(x0, np.diag(sigma.ravel() ** 2), NOISE, inflate=10.0), rules(), WAY)
            )
        again = np.concatenate([one.recoveries() for one in done])
        print(
            f"{name}: slot error {100 * np.percentile([one.rms for one in done], 95):.1f} cm in 95 % (3), "
            f"again after a turn {np.nanpercentile(again, 95):.1f} s in 95 % (8.5), never: {np.isnan(again).sum()}, "
            f"least distance {min(one.least for one in done):.2f} m (.8), "
            f"finished {sum(one.finished for one in done)} of {runs}"
        )


def cost():
    h = answer("h")
    near = sorted(random_map(25, rng=1), key=lambda lm: np.hypot(*lm.p))[:3]
    y = [Landmark((np.hypot(*lm.p), np.arctan2(lm.p[1], lm.p[0])), lm.id) for lm in near]
    lab3 = load_answer("03_range_bearing_ekf", "KF", ROOT / "solutions")
    kf = lab3((0.0, 0.0), 3 * np.eye(2), 0.06 * np.eye(2), np.diag([0.04, 0.0076]), random_map(25, rng=1))
    due = per_step(lambda: (kf.predict(np.array([0.1, 0.0])), kf.update(y)))
    print(f"lab 3's filter, 3 landmarks: {due:.3f} ms a step")
    for n in (4, 30, 100):
        rng = np.random.default_rng(0)
        x0 = np.column_stack([rng.uniform(-8, 8, (n, 2)), rng.uniform(-3, 3, n)])
        readings = [(i, 0, h(x0[i], x0[0])) for i in range(1, n)]
        u = np.tile([0.05, 0.0, 0.01], (n, 1))
        for name in ("GroupEKF", "FastEKF"):
            # Without a gate: the robots drive and the readings stay, so that more and more would be left out.
            kf = answer(name)(x0, 0.01 * np.eye(3 * n), NOISE, gate=np.inf)
            took = per_step(lambda: (kf.predict(u), kf.update(readings)), 5)
            limit = {4: " (at most 3 times)", 100: " (at most 10 ms)"}.get(n, "") if name == "FastEKF" else ""
            print(f"{name}, n = {n}: {took:.2f} ms a step, {took / due:.1f} times lab 3's{limit}")
    views = relative(rng.uniform(-1, 1, (1, 3)), rng.uniform(-8, 8, (1000, 3)))
    pairs, z = (
        PairFilters(views, np.tile(0.01 * np.eye(3), (1000, 1, 1)), NOISE, gate=np.inf),
        np.column_stack([np.hypot(*views[:, :2].T), np.arctan2(views[:, 1], views[:, 0])]),
    )
    u, v, who = np.array([0.05, 0, 0.01]), np.tile([0.05, 0.0, 0.01], (1000, 1)), np.arange(1000)
    took = per_step(lambda: (pairs.predict(u, v), pairs.update(who, z)))
    print(f"pair filters, n = 1000: {took:.2f} ms a step (at most 1)")


def per_step(call, steps=20):
    """Milliseconds of a call: the best of ten means of `steps` calls."""
    took = []
    for _ in range(10):
        begin = time.perf_counter()
        for _ in range(steps):
            call()
        took.append((time.perf_counter() - begin) / steps)
    return 1e3 * min(took)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=30)
    told = parser.parse_args()
    warnings.simplefilter("ignore", FrameWarning)  # of the paper's filter, where observers move
    for part in (start, filters, honesty, hard, formation):
        part(told.runs)
    cost()
