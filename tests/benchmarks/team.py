"""How well a team finds itself and holds its formation: the figures of lab 5, over many runs.

python tests/benchmarks/team.py [--runs 30]
"""

import argparse
import dataclasses
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from team_answers import answer, start_errors, started  # noqa: E402

from labkit import metrics, wrap  # noqa: E402
from labkit.team import TeamNoise, dead_reckoned, frame_errors, replay, scenarios, seen_from  # noqa: E402
from labkit.team.bound import least_squares  # noqa: E402
from labkit.team.formation import WAY, run, triangle  # noqa: E402
from labkit.team.pairs import PairFilters  # noqa: E402

NOISE = TeamNoise()
WHITE = dataclasses.replace(NOISE, scale=0.0, turn_scale=0.0, drift=0.0)
CROSSING = ((0, 0, 0), (-1.8, -1.6, 0.3), (-2.0, 1.5, -0.2))  # each follower starts on the other's side


def start(runs):
    for scenario in (scenarios.cross, scenarios.rectangle):
        far, turned = start_errors(scenario, runs)
        print(
            f"start after 3.3 m, {scenario.__name__}: {100 * far:.1f} cm, {np.rad2deg(turned):.2f} degrees rms (at most 13, 1.0)"
        )


def filters(runs):
    for scenario, due in (
        (scenarios.cross, "2.3 / 2.1"),
        (scenarios.rectangle, "1.8 / 1.9"),
        (scenarios.moving, "6.2 / 2.1"),
    ):
        errors = []
        for seed in range(runs):
            log = scenario(rng=seed)
            one = frame_errors(replay(started(log, seed), log)[0], log.truth)
            odo = frame_errors(dead_reckoned(log), log.truth)
            errors.append([one.ego.mean(), one.aligned.mean(), odo.ego.mean(), odo.aligned.mean()])
        e = 100 * np.median(errors, axis=0)
        print(
            f"{log.name}: ego {e[0]:.1f}, aligned {e[1]:.1f} cm (at most {due}); odometry {e[2]:.0f}, {e[3]:.0f}"
        )


def honesty(runs):
    last, whole, values = [], [], []
    for seed in range(runs):
        log = scenarios.cross(rng=seed, noise=WHITE)
        kf = started(log, seed, WHITE, inflate=1.0)
        x0, P0 = kf.x.copy(), kf.P.copy()
        x, P = replay(kf, log)
        best = frame_errors(least_squares(log, x0, P0, WHITE), log.truth)
        one = frame_errors(x, log.truth)
        last.append(one.ego[-1] / best.ego[-1])
        whole.append(one.aligned.mean() / best.aligned.mean())
        e = x - log.truth
        e[..., 2] = wrap(e[..., 2])
        e = e.reshape(len(e), -1)
        values.append(np.einsum("ki,ki->k", e, np.linalg.solve(P + 1e-12 * np.eye(9), e[..., None])[..., 0]))
    mean = np.mean(values, axis=0)
    low, high = metrics.chi2_bounds(9, runs=runs)
    print(
        f"white odometry: filter / least squares, last step {np.median(last):.2f} (1.05), whole run {np.median(whole):.2f} (2.1)"
    )
    print(
        f"NEES per dimension {mean.mean() / 9:.2f}, {100 * np.mean((low < mean) & (mean < high)):.0f} % of the steps inside the bounds (90)"
    )


def hard(runs):
    pairs, dark = [], []
    for seed in range(runs):
        both = [scenarios.rectangle(rng=seed, probability=p) for p in (0.0, 0.3)]
        pairs.append(
            [frame_errors(replay(started(log, seed), log)[0], log.truth).aligned.mean() for log in both]
        )
        log = scenarios.rectangle(rng=seed, probability=0.0, dark=(300, 600), laps=2)
        dark.append(frame_errors(replay(started(log, seed), log)[0], log.truth).ego[610])
    clean, false = np.median(pairs, axis=0)
    print(f"false readings behind the gate: {100 * (false / clean - 1):+.0f} % (at most 5)")
    print(f"60 s without sight, 2 s later: {100 * np.percentile(dark, 95):.1f} cm in 95 % (at most 10)")


def formation(runs):
    sigma = np.tile([0.13, 0.13, np.deg2rad(1.0)], (3, 1))
    sigma[0] = 1e-6
    for name, options in (("S4", {}), ("S4 from a crossing start", {"start": CROSSING})):
        done = []
        for seed in range(runs):
            team = triangle(rng=seed, **options)
            x0 = team.poses + sigma * np.random.default_rng(seed + 1000).standard_normal((3, 3))
            done.append(
                run(team, answer("GroupEKF")(x0, np.diag(sigma.ravel() ** 2), NOISE), answer("force"), WAY)
            )
        again = np.concatenate([one.recoveries() for one in done])
        print(
            f"{name}: slot error {100 * np.percentile([one.rms for one in done], 95):.1f} cm in 95 % (3), "
            f"again after a turn {np.nanpercentile(again, 95):.1f} s in 95 % (8.5), never: {np.isnan(again).sum()}, "
            f"least distance {min(one.least for one in done):.2f} m (.8), finished {sum(one.finished for one in done)} of {runs}"
        )


def cost():
    h = answer("h")
    for n in (4, 30, 100):
        rng = np.random.default_rng(0)
        x0 = np.column_stack([rng.uniform(-8, 8, (n, 2)), rng.uniform(-3, 3, n)])
        readings = [(i, 0, h(x0[i], x0[0])) for i in range(1, n)]
        kf, u = answer("GroupEKF")(x0, 0.01 * np.eye(3 * n), NOISE), np.tile([0.05, 0.0, 0.01], (n, 1))
        begin = time.perf_counter()
        for _ in range(10):
            kf.predict(u)
            kf.update(readings)
        print(f"joint filter, n = {n}: {100 * (time.perf_counter() - begin):.2f} ms a step")
    views = seen_from(rng.uniform(-8, 8, (1000, 3)), rng.uniform(-1, 1, (1, 3)))
    pairs, z = (
        PairFilters(views, np.tile(0.01 * np.eye(3), (1000, 1, 1)), NOISE),
        np.column_stack([np.hypot(*views[:, :2].T), np.arctan2(views[:, 1], views[:, 0])]),
    )
    begin = time.perf_counter()
    for _ in range(20):
        pairs.predict(np.array([0.05, 0, 0.01]), np.tile([0.05, 0.0, 0.01], (1000, 1)))
        pairs.update(np.arange(1000), z)
    print(f"pair filters, n = 1000: {50 * (time.perf_counter() - begin):.2f} ms a step (at most 1)")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=30)
    told = parser.parse_args()
    for part in (start, filters, honesty, hard, formation):
        part(told.runs)
    cost()
