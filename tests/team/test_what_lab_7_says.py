"""What lab 7 tells in words, over thirty seeds where it is about chance."""

import copy

import numpy as np

from labkit import replay
from labkit.geometry import compose
from labkit.team import TeamNoise, frame_errors, later, near, scenarios
from labkit.team.formation import WAY, run, three

from helpers.team_answers import rules, started

NOISE = TeamNoise()


def by_odometry(log, runs, seed):
    """(runs, 3) where robot 0 is at the end of a log, by other odometers on the same way."""
    rng, truth = np.random.default_rng(seed), np.asarray(log.truth)[:, 0]
    cos, sin = np.cos(truth[:-1, 2]), np.sin(truth[:-1, 2])
    d = np.diff(truth, axis=0)
    u = np.stack([cos * d[:, 0] + sin * d[:, 1], cos * d[:, 1] - sin * d[:, 0], (d[:, 2] + 3) % (2 * np.pi) - 3], -1)
    bias = rng.standard_normal((runs, 3)) * [NOISE.scale, NOISE.turn_scale, NOISE.drift]
    poses = np.tile(truth[0], (runs, 1))
    for step, sigma in zip(u, NOISE.of_step(u)):
        told = step * (1 + bias[:, [0, 0, 1]]) + sigma * rng.standard_normal((runs, 3))
        told[:, 2] += bias[:, 2] * np.hypot(*step[:2])
        poses = compose(poses, told)
    return poses


def parted(minutes, steps):
    """Filters (30) of the same team that saw nobody for so long, and the log of so many steps after it."""
    apart, again = scenarios.parted(minutes, rng=0)
    kf, filters = started(apart, 0), []
    replay(kf, apart)
    for pose in by_odometry(apart, 30, seed=1):
        filters.append(copy.deepcopy(kf))
        filters[-1].x[0] = pose
    return filters, later(again, 0, steps)


def off(kf, log, gate=13.8) -> float:
    """[m] where the observers have robot 0 at the end of a log; leaves the filter as it was."""
    one = copy.deepcopy(kf)
    one.gate = gate
    return float(frame_errors(replay(one, log).x, log.truth).ego[-1])


def test_after_ten_minutes_a_second_is_enough_and_after_twenty_the_gate_may_shut_out_the_truth():
    filters, log = parted(10, 6)
    assert sum(off(kf, log) < 0.1 for kf in filters) >= 27
    filters, log = parted(20, 75)
    assert 5 <= sum(off(kf, log) > 1 for kf in filters) <= 20
    assert max(off(kf, log, np.inf) for kf in filters) < 0.05


class Odometer:
    """What is left of a filter that hears of no reading."""

    def __init__(self, x, P):
        self.x, self.P = np.array(x), P

    def predict(self, u):
        self.x = compose(self.x, u)

    def update(self, seen):
        pass


def test_with_odometry_alone_followers_lose_their_slots_by_half_a_metre():
    ends = []
    for seed in range(30):
        team = three(rng=seed)
        ends.append(run(team, Odometer(*near(team.poses, seed)), rules(), WAY).error[-1])
    assert min(ends) > 0.1 and 0.35 < np.median(ends) < 0.6
