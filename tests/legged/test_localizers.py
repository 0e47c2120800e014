"""Localizers of a legged robot, each against what it should give, and all of them where nothing helps."""

from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter, KalmanFilter

from labkit import FilterError, Landmark, metrics, replay, wrap
from labkit.geometry import compose
from labkit.legged import (
    FIELD,
    FieldLog,
    FuzzyGrid,
    Hybrid,
    LeggedRobot,
    Memory,
    Noise,
    ParticleFilter,
    Sighting,
    Triangulation,
    poses_around,
    race,
    robot,
    table,
)
from labkit.legged.fuzzygrid import FLOOR
from labkit.legged.race import Result, steps_until_found
from labkit.legged.trapezoid import Trapezoids, fused

from helpers.localizers import CONTESTANTS, answer, ekf, hybrid

EXACT = Noise(slip=0.0, spin=0.0)
PLAIN = Noise(odometry=0.1, range_beacon=0.05, range_goal=0.05, bearing=0.035, bearing_partial=0.1)
RUNS = 20


@cache
def recorded(noise="real", seed=0, steps=200, kidnap=()):
    return LeggedRobot(noise, rng=seed).record(steps, kidnap=kidnap)


def cut(log, keep):
    """A log with only those of its sightings that `keep` (M,) says."""
    return replace(log, **{name: getattr(log, name)[keep] for name in ("seen", "seen_id", "seen_step", "complete")})


@cache
def guided(noise, controls, steps):
    """A log of a robot that makes the same motion at every step, wherever that leads."""
    truth = [np.array([0.5, -0.5, 0.3])]
    for _ in range(steps):
        truth.append(compose(truth[-1], controls))
    maker = LeggedRobot(noise, rng=0)
    pan, truth = LeggedRobot(noise, rng=1).record(steps).pan, np.array(truth)
    moves = np.tile(np.array(controls, dtype=float), (steps, 1))
    made = {"map": FIELD.map, "sensor": "rb", "frame": "robot", "truth": truth, "pan": pan, "noise": maker.noise}
    times = robot.DT * np.arange(steps + 1)
    return FieldLog(times, maker._odometry(moves), **maker._look(truth[1:], pan), **made)


def far(a, b):
    """How far two poses (..., 3) are apart, metres and radians in one number."""
    d = np.asarray(a) - b
    return np.hypot(d[..., 0], d[..., 1]) + abs(wrap(d[..., 2]))


# Poses, rings and motions


def test_from_each_pose_of_a_ring_the_landmark_is_seen_where_it_was_seen():
    rng = np.random.default_rng(0)
    for lm in FIELD.map:
        r, bearing = rng.uniform(0.1, 5), rng.uniform(-np.pi, np.pi)
        poses = poses_around(lm.p, r, bearing, rng.uniform(-9, 9, 50))
        away = lm.p - poses[:, :2]
        np.testing.assert_allclose(np.hypot(*away.T), r)
        np.testing.assert_allclose(wrap(np.arctan2(*away.T[::-1]) - poses[:, 2] - bearing), 0, atol=1e-9)
        assert (abs(poses[:, 2]) <= np.pi).all()
    assert np.ptp(poses[:, 0]) > r  # all around


def test_the_motion_that_lab_4_asks_for_is_a_composition():
    x, u = np.random.default_rng(1).uniform(-3, 3, (2, 40, 3))
    np.testing.assert_allclose(compose(x, u), [answer("motion")(a, b) for a, b in zip(x, u)])


# Trapezoids

PHI = np.linspace(-np.pi, np.pi, 36001)[1:]


def values(trapezoid, phi=PHI):
    rise = (trapezoid.s - abs(wrap(phi - trapezoid.theta))) / (trapezoid.s - trapezoid.c)
    return trapezoid.b + (trapezoid.h - trapezoid.b) * np.clip(rise, 0, 1)


def pairs(kind, n=60):
    """Pairs of trapezoids anywhere on the circle whose cores, flanks or not even supports overlap."""
    rng = np.random.default_rng(2)
    while n:
        c = rng.uniform(0.01, 0.8, 2)
        s = c + rng.uniform(0.05, 0.9, 2)
        theta = np.pi - rng.uniform(-1, 1, 2) if n % 2 else rng.uniform(-np.pi, np.pi, 2)
        h, b = rng.uniform(0.4, 1, 2), rng.uniform(0, 0.3, 2)
        D = abs(wrap(theta[0] - theta[1]))
        spare = 0.01  # nearer than this to a border is for nobody to say
        found = {
            "core": D < c.sum() - spare,
            "flank": c.sum() + spare < D < s.sum() - spare,
            "none": D > s.sum() + spare,
        }
        if found[kind] and s.sum() + D < 2 * np.pi - spare:
            n -= 1
            yield [Trapezoids(*each) for each in zip(wrap(theta), c, s, h, b)]


def within(trapezoid, half):
    return abs(wrap(PHI - trapezoid.theta)) <= half


@pytest.mark.parametrize("kind", ["core", "flank", "none"])
def test_two_fuzzy_headings_are_fused_as_their_product_says(kind):
    apart = 0.0
    for one, two in pairs(kind):
        theta, c, s, h = map(float, fused(one, two))
        product, both = values(one) * values(two), within(one, one.s) & within(two, two.s)
        support = abs(wrap(PHI - theta)) <= s + 2e-4
        assert abs(theta) <= np.pi and 0 <= c <= s <= np.pi and 0 < h <= 1
        apart = max(apart, abs(wrap(one.theta) - two.theta))
        if kind == "core":
            core = within(one, one.c) & within(two, two.c)
            assert h == pytest.approx(one.h * two.h) == pytest.approx(product.max())
            assert np.sum(core != (abs(wrap(PHI - theta)) <= c)) <= 4 and not (both & ~support).any()
        elif kind == "flank":
            flanks = both & ~within(one, one.c) & ~within(two, two.c)
            D = abs(wrap(one.theta - two.theta))
            between = flanks & (abs(wrap(PHI - one.theta)) + abs(wrap(PHI - two.theta)) < D + 1e-6)
            best = np.where(between, product, -1)
            assert c == 0 and h == pytest.approx(best.max(), abs=2e-3)
            assert abs(wrap(PHI[best > best.max() - 1e-9] - theta)).min() < 2e-2 and not (both & ~support).any()
        else:
            stays, other = (one, two) if one.h * two.b >= two.h * one.b else (two, one)
            assert [c, s, h] == pytest.approx([stays.c, stays.s, stays.h * other.b])
            assert abs(wrap(theta - stays.theta)) < 1e-9
    assert apart > np.pi  # some lie across +-pi


def test_fusing_does_not_ask_which_comes_first_nor_where_zero_is():
    for kind in ("core", "flank", "none"):
        for one, two in pairs(kind, 20):
            theta, *shape = map(float, fused(one, two))
            other, *same = map(float, fused(two, one))
            assert same == pytest.approx(shape) and abs(wrap(other - theta)) < 1e-9
            turned, *same = map(float, fused(replace(one, theta=one.theta + 2), replace(two, theta=two.theta + 2)))
            assert same == pytest.approx(shape) and abs(wrap(turned - theta - 2)) < 1e-9


@pytest.mark.parametrize("theta", [0.0, 1.5, -2.5, 3.0, 3.1, -3.1])
def test_who_knows_no_heading_takes_the_one_that_is_seen(theta):
    anything, seen = Trapezoids(0.0, np.pi, np.pi, 0.8, 0.01), Trapezoids(theta, 0.3, 0.9, 0.5, 0.2)
    got, *shape = map(float, fused(anything, seen))
    assert abs(wrap(got - theta)) < 1e-9 and shape == pytest.approx([0.3, 0.9, 0.4])


def test_many_are_fused_as_one_is():
    ones, twos = (list(t) for t in zip(*pairs("core", 20), *pairs("flank", 20), *pairs("none", 20)))
    stacked = [
        Trapezoids(*np.array([[getattr(t, k) for k in ("theta", "c", "s", "h", "b")] for t in each]).T)
        for each in (ones, twos)
    ]
    np.testing.assert_allclose(fused(*stacked), np.array([fused(a, b) for a, b in zip(ones, twos)]).T)


# The grid


def certain(cell, heading):
    """(grid, pose): a grid that knows its pose, the middle of one of its cells."""
    grid = FuzzyGrid("real", cell=cell)
    row, column = np.array(grid.h.shape) // 2
    grid.h[:], grid.h[row, column] = FLOOR, 1.0
    grid.theta[row, column], grid.c[row, column], grid.s[row, column] = heading, 0.01, 0.05
    grid._locate()
    return grid, np.array([grid.px[row, column], grid.py[row, column], heading])


@pytest.mark.parametrize("cell", [0.05, 0.1, 0.2])
@pytest.mark.parametrize("u", [(0.025, 0.01, 0.05), (-0.003, 0.021, -0.03), (0.3, 0, 0.6), (0, 0, 0.1)])
def test_a_certain_cell_walks_as_the_robot_does_and_does_not_drift(cell, u):
    grid, pose = certain(cell, 2.9)
    for _ in range(200):
        grid.predict(np.array(u))
        pose = compose(pose, u)
        assert far(grid.xk_k, pose) < 1e-9
        grid._locate()  # from the cells, where `predict` has gone by odometry
        assert far(grid.xk_k, pose) < 1e-9
    row, column = np.unravel_index(grid.h.argmax(), grid.h.shape)
    assert grid.h[row, column] == 1.0 and np.hypot(*(pose[:2] - (grid.px[row, column], grid.py[row, column]))) < cell
    assert max(abs(grid.px[row, column] - grid.x[column]), abs(grid.py[row, column] - grid.y[row])) <= cell / 2 + 1e-9


def test_cells_go_along_their_own_headings():
    grid, _ = certain(0.1, 0.0)
    (row, column), grid.h[:] = np.unravel_index(grid.h.argmax(), grid.h.shape), FLOOR
    for turn, (dr, dc) in {0.0: (0, 1), np.pi / 2: (1, 0), np.pi: (0, -1), -np.pi / 2: (-1, 0)}.items():
        grid.h[row + 5 * dr, column + 5 * dc], grid.theta[row + 5 * dr, column + 5 * dc] = 1.0, turn
    for _ in range(4):
        grid.predict(np.array([0.1, 0, 0]))
    best = {(int(r) - row, int(c) - column) for r, c in np.argwhere(grid.h == 1.0)}
    assert best == {(0, 9), (9, 0), (0, -9), (-9, 0)}


def sound(grid):
    assert FLOOR <= grid.h.min() and grid.h.max() <= 1 + 1e-12
    assert (grid.c >= 0).all() and (grid.c <= grid.s).all() and (grid.s <= np.pi).all()
    assert (
        np.isfinite([grid.h, grid.theta, grid.c, grid.s, grid.px, grid.py]).all() and (abs(grid.theta) <= np.pi).all()
    )
    assert 0 <= grid.quality <= 1 and 0 < grid.size <= 2 * grid.field.half.max() + 1e-9
    believable(grid.xk_k, grid.Pk_k)


def believable(x, P):
    """x (..., 3) and P (..., 3, 3) are finite, P is a covariance and nowhere zero."""
    assert np.isfinite(x).all() and np.isfinite(P).all()
    np.testing.assert_allclose(P, np.swapaxes(P, -1, -2), atol=1e-12)
    assert np.linalg.eigvalsh(P).min() > 0


@pytest.mark.parametrize(("noise", "cell"), [("real", 0.1), ("harsh", 0.1), ("paper", 0.2), ("harsh", 0.05)])
def test_a_grid_stays_sound_and_finds_the_robot(noise, cell):
    log = recorded(noise, seed=3, steps=150, kidnap=75)
    grid, found = FuzzyGrid(log.noise.told(), cell=cell), []
    sound(grid)
    for u, y in zip(log.controls, log.measurements()):
        grid.predict(u)
        sound(grid)
        grid.update(y)
        sound(grid)
        found.append(grid.xk_k)
    off = np.hypot(*(np.array(found) - log.truth[1:])[:, :2].T)
    assert np.median(off[30:75]) < 0.3 and np.median(off[110:]) < 0.4
    grid.reset()
    assert (grid.h == 1).all() and (grid.c == np.pi).all() and grid.quality == 0 and grid.size == pytest.approx(5.8)
    assert grid.Pk_k[0, 0] + grid.Pk_k[1, 1] == pytest.approx((5.8**2 + 4**2) / 12)


def test_the_same_log_gives_the_same_grid():
    log, made = recorded("harsh"), [FuzzyGrid("harsh"), FuzzyGrid("harsh")]
    one, two = (replay(grid, log) for grid in made)
    np.testing.assert_array_equal(one.x, two.x)
    np.testing.assert_array_equal(made[0].h, made[1].h)


# Particles


def test_the_weights_of_the_particles_add_up_to_one():
    log = recorded("harsh", kidnap=100)
    particles = ParticleFilter(300, log.noise.told(), rng=5)
    for u, y in zip(log.controls, log.measurements()):
        particles.predict(u)
        particles.update(y)
        assert particles.w.sum() == pytest.approx(1) and (particles.w >= 0).all()
        assert particles.particles.shape == (300, 3) and np.isfinite(particles.particles).all()
        assert 0 <= particles.quality <= 1 and particles.size > 0
        believable(particles.xk_k, particles.Pk_k)


def test_the_same_rng_gives_the_same_particles():
    log = recorded()
    one, two, given, other = (
        replay(ParticleFilter(200, "real", rng=rng), log).x for rng in (3, 3, np.random.default_rng(3), 4)
    )
    np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(one, given)
    assert not np.array_equal(one, other)


def test_particles_find_the_robot_and_find_it_again():
    logs = [recorded("real", seed, 200, 100) for seed in range(5)]
    result = race({"MCL": CONTESTANTS["MCL 500"]}, logs)[0]
    assert (result.found() < 60).all() and (result.recovered() < 80).all()


# Triangulation


def test_triangulation_is_exact_once_it_has_seen_two_landmarks():
    for seed in range(5):
        log = recorded(EXACT, seed, 100, 60)
        off, seen = far(replay(Triangulation(), log).x, log.truth), set()
        for k in range(60):
            seen |= {s.id for s in log.measurements()[k]}
            assert len(seen) < 2 or off[k + 1] < 1e-9
        assert len(seen) >= 2


def test_triangulation_takes_two_landmarks_of_one_image():
    pose = np.array([0.3, -0.8, 2.0])
    y = [Sighting(answer("h")(pose, lm), lm.id, complete=False) for lm in FIELD.map[1:3]]
    kf = Triangulation()
    kf.update(y[:1])
    assert far(kf.xk_k, np.zeros(3)) == 0  # one leaves it open
    kf.update(y[1:])
    assert far(kf.xk_k, pose) < 1e-9
    believable(kf.xk_k, kf.Pk_k)


# Memory


def test_a_memory_knows_where_things_are_now_and_were_then():
    log, memory = recorded(EXACT, 7), Memory(None, "harsh", most=10)
    assert len(memory.remembered()) == 0
    for k, (u, y) in enumerate(zip(log.controls, log.measurements())):
        memory.predict(u)
        memory.update(y)
        past, last = memory.remembered(), np.flatnonzero(log.seen_step <= k)[-10:]
        assert len(past) == len(last) and all(
            len(a) == len(last) for a in (past.places, past.sigma, past.since, past.before)
        )
        if not len(last):
            continue
        np.testing.assert_array_equal(past.seen, log.seen[last])  # the oldest first
        then = compose(np.tile(log.truth[k + 1], (len(last), 1)), past.before)
        np.testing.assert_allclose(far(then, log.truth[log.seen_step[last] + 1]), 0, atol=1e-9)
        np.testing.assert_allclose(far(compose(then, past.since), log.truth[k + 1]), 0, atol=1e-9)
        away = past.places - then[:, :2]
        np.testing.assert_allclose(np.hypot(*away.T), past.seen[:, 0])
        np.testing.assert_allclose(wrap(np.arctan2(*away.T[::-1]) - then[:, 2] - past.seen[:, 1]), 0, atol=1e-9)


def test_a_memory_says_how_good_each_sighting_was():
    noise, memory = Noise(0.1, 0.05, 0.2, 0.03, 0.3, range_floor=0.1), Memory(None, "real")
    memory.noise = noise
    memory.update([Sighting((2, 0), "blue goal"), Sighting((2, 0), "pink-blue", complete=False)])
    np.testing.assert_allclose(memory.remembered().sigma, [[0.5, 0.03], [0.2, 0.3]], atol=1e-5)


def test_a_memory_is_asked_only_when_somebody_wants_to_know():
    asked, found = [], (np.ones(3), 0.01 * np.eye(3))

    def restart(past):
        asked.append(len(past))
        return found if len(past) >= 4 else None

    log, memory = recorded(), Memory(restart, "real")
    for u, y in zip(log.controls[:60], log.measurements()):
        memory.predict(u)
        memory.update(y)
    assert not asked
    assert memory.quality == 1 and memory.size == pytest.approx(0.02**0.5) and asked == [10]
    np.testing.assert_array_equal(memory.xk_k, found[0])
    assert asked == [10]
    memory.reset()
    assert memory.quality == 0 and memory.size == np.inf and asked == [10] and len(memory.remembered()) == 0
    assert memory.Pk_k[0, 0] == pytest.approx(2.9**2 / 3)


@pytest.mark.parametrize("most", [0, -3])
def test_a_memory_of_nothing_is_refused(most):
    with pytest.raises(ValueError, match="most"):
        Memory(None, "real", most=most)


@pytest.mark.slow
def test_a_restart_finds_the_pose():
    for seed in range(10):
        log = recorded("paper", seed, 60)
        memory = Memory(answer("restart"), log.noise.told())
        h = replay(memory, log)
        sure = h.P[:, 0, 0] < 0.35**2
        assert sure.any() and np.hypot(*(h.x - log.truth)[sure][:, :2].T).max() < 0.5


# Taking turns


class Walker:
    """A finder that goes by odometry and is as sure as it is told."""

    size, quality = 0.1, 1.0

    def __init__(self):
        self.map = {lm.id: lm.p for lm in FIELD.map}
        self.reset()
        self.resets, self.moves, self.images = 0, [], []

    def reset(self):
        self.xk_k, self.Pk_k, self.resets = np.array([1.0, 0, 3.0]), np.eye(3), getattr(self, "resets", 0) + 1

    def predict(self, u):
        self.moves.append(np.array(u))
        self.xk_k = compose(self.xk_k, u)

    def update(self, y):
        self.images.append(y)


class Quick:
    """A quick one whose d2 are told beforehand."""

    def __init__(self, x0, P0):
        self.xk_k, self.Pk_k, self.d2 = np.array(x0), np.array(P0), []

    def predict(self, u):
        self.xk_k = compose(self.xk_k, u)

    def update(self, y):
        self.d2 = [float(lm.p[0]) for lm in y]


def sight(*d2):
    return [Sighting((value, 0), "blue goal") for value in d2]


def steps(kf, images, u=(0.1, 0.02, 0.3)):
    modes = []
    for y in images:
        kf.predict(np.array(u))
        kf.update(y)
        modes.append(kf.mode)
    return modes


def test_the_quick_one_takes_over_after_enough_good_images_in_a_row():
    finder = Walker()
    kf = Hybrid(finder, Quick, lambda P, d2: False, frames=3)
    assert steps(kf, [sight(1), [], sight(1), [], []]) == ["find"] * 5  # an empty image says nothing
    finder.size = 2.0
    assert steps(kf, [sight(1)]) == ["find"]
    finder.size, finder.quality = 0.1, 0.5
    assert steps(kf, [sight(1)]) == ["find"]
    finder.quality = 0.7
    assert steps(kf, [sight(1)] * 3) == ["find", "find", "follow"]
    assert isinstance(kf.tracker, Quick) and kf.xk_k is kf.tracker.xk_k
    np.testing.assert_array_equal(kf.xk_k, finder.xk_k)
    np.testing.assert_array_equal(kf.Pk_k, np.eye(3))
    steps(kf, [sight(1)] * 5)
    assert len(finder.moves) == 10 == len(finder.images)  # asleep since


def test_the_quick_one_gives_up_when_lost_says_so():
    finder, told = Walker(), []

    def lost(P, d2):
        told.append(d2)
        return len(d2) >= 4 and (d2 > 10).all()

    kf = Hybrid(finder, Quick, lost, frames=1, memory=4)
    assert steps(kf, [sight(1), sight(1, 20), sight(20), [], sight(20, 20), sight(1)]) == ["follow"] * 4 + [
        "find",
        "follow",
    ]
    assert [d2.tolist() for d2 in told] == [[1, 20], [1, 20, 20], [1, 20, 20], [20, 20, 20, 20]]
    assert finder.resets == 1 and isinstance(told[0], np.ndarray)
    steps(kf, [sight(3)])
    assert told[-1].tolist() == [3]  # it starts with an empty memory


@pytest.mark.parametrize("background", [1, 3, 7])
def test_in_the_background_the_finder_walks_every_nth_step_but_all_of_the_way(background):
    finder = Walker()
    kf = Hybrid(finder, Quick, lambda P, d2: len(d2) and d2[-1] > 10, background=background, frames=1)
    u, pose = (0.1, -0.05, 0.4), finder.xk_k
    images = [sight(1), *[sight(1 + k / 100) for k in range(23)], sight(99)]
    assert steps(kf, images, u) == ["follow"] * 24 + ["find"]
    for _ in images:
        pose = compose(pose, u)
    assert far(finder.xk_k, pose) < 1e-9 and far(kf.xk_k, pose) < 1e-9 and finder.resets == 0
    assert [y[0].p[0] for y in finder.images] == [
        y[0].p[0] for k, y in enumerate(images, 1) if k == 1 or k % background == 0
    ]
    assert steps(kf, [sight(1)] * 2, u) == ["follow"] * 2


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"background": -1}, "background must be a whole number, 0 or more"),
        ({"background": 1.5}, "background must be"),
        ({"background": np.nan}, "background must be"),
        ({"frames": 0}, "frames must be a whole number, 1 or more"),
        ({"memory": 0}, "memory must be"),
        ({"memory": 2.5}, "memory must be"),
    ],
)
def test_what_a_hybrid_cannot_be_is_named(options, message):
    with pytest.raises(ValueError, match=message):
        Hybrid(Walker(), Quick, lambda P, d2: False, **options)


def test_a_hybrid_needs_a_finder_that_knows_how_good_it_is():
    with pytest.raises(ValueError, match=r"finder must be a FuzzyGrid or a ParticleFilter; .* has no `reset`"):
        Hybrid(Triangulation(), Quick, lambda P, d2: False)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: FuzzyGrid(cell=0.01), "cell must be from 0.02 to 2 m"),
        (lambda: FuzzyGrid(cell=3), "cell must be"),
        (lambda: FuzzyGrid(cell=np.nan), "cell must be"),
        (lambda: FuzzyGrid("none"), "noise must be"),
        (lambda: ParticleFilter(9), "n must be a whole number"),
        (lambda: ParticleFilter(99.5), "n must be"),
        (lambda: ParticleFilter(np.nan), "n must be"),
        (lambda: ParticleFilter(100, "none"), "noise must be"),
        (lambda: Memory(None, "none"), "noise must be"),
    ],
)
def test_bad_input_is_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def follower():
    """A Hybrid in which the solution's EKF is at work."""
    kf = hybrid(recorded(), Walker(), frames=1)
    kf.update([Sighting((2, 0), "blue goal")])
    assert kf.mode == "follow"
    return kf


LOCALIZERS = {
    "grid": FuzzyGrid,
    "particles": lambda: ParticleFilter(50, rng=0),
    "triangulation": Triangulation,
    "memory": lambda: Memory(answer("restart")),
    "hybrid that finds": lambda: hybrid(recorded(), FuzzyGrid()),
    "hybrid that follows": follower,
}


@pytest.mark.parametrize("name", LOCALIZERS)
@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda kf: kf.predict(np.array([0.1, np.nan, 0])), "u must be three finite numbers"),
        (lambda kf: kf.predict(np.array([0.1, 0, np.inf])), "u must be three finite numbers"),
        (lambda kf: kf.predict(np.array([0.1, 0])), "u must be three finite numbers"),
        (lambda kf: kf.update([Sighting((1, 0), "blue goal"), Sighting((1, 0), "lamp post")]), "lamp post"),
        (lambda kf: kf.update([raw(np.nan, 0)]), "sighting of blue goal that is no range and bearing"),
        (lambda kf: kf.update([raw(1, np.nan)]), "sighting of blue goal that is no range"),
        (lambda kf: kf.update([raw(-1, 0)]), "sighting of blue goal that is no range"),
    ],
)
def test_what_no_localizer_can_use_is_named_and_does_no_harm(name, act, message):
    kf = LOCALIZERS[name]()
    before = np.array(kf.xk_k), np.array(kf.Pk_k)
    with pytest.raises(ValueError, match=message):
        act(kf)
    np.testing.assert_array_equal(kf.xk_k, before[0])
    np.testing.assert_array_equal(kf.Pk_k, before[1])


def raw(r, bearing):
    """A sighting that the class itself would refuse."""
    sighting = Sighting((1, 0), "blue goal")
    sighting.p = np.array([r, bearing], dtype=float)
    return sighting


@pytest.mark.parametrize("name", ["grid", "particles", "triangulation"])
def test_a_plain_landmark_counts_as_wholly_in_view(name):
    one, two = LOCALIZERS[name](), LOCALIZERS[name]()
    pose = np.array([0.5, 0.2, 1.0])
    y = [Sighting(answer("h")(pose, lm), lm.id) for lm in FIELD.map[:3]]
    one.update(y)
    two.update([Landmark(lm.p, lm.id) for lm in y])
    np.testing.assert_array_equal(one.xk_k, two.xk_k)


# The solution's EKF


def test_the_numeric_jacobian_is_the_exact_one():
    rng = np.random.default_rng(0)
    for x in [*rng.uniform(-3, 3, (300, 3)), *([x, 0, np.pi] for x in (-1.0, 1.0, 2.0))]:
        for lm in FIELD.map:
            dx, dy = lm - np.array(x)[:2]
            r = np.hypot(dx, dy)
            exact = [[-dx / r, -dy / r, 0], [dy / r**2, -dx / r**2, -1]]
            np.testing.assert_allclose(answer("jacobian")(np.array(x, dtype=float), lm), exact, atol=1e-4)


def test_the_jacobians_of_the_motion_are_its_slopes():
    step, (motion, jacobians) = 1e-6, map(answer, ("motion", "motion_jacobians"))
    for x, u in zip(*np.random.default_rng(1).uniform(-3, 3, (2, 50, 3))):
        A, W = jacobians(x, u)
        for matrix, move in ((A, lambda e, x=x, u=u: motion(x + e, u)), (W, lambda e, x=x, u=u: motion(x, u + e))):
            slope = [(move(e) - move(-e)) / (2 * step) for e in step * np.eye(3)]
            np.testing.assert_allclose(matrix, np.array(slope).T, atol=1e-6)


def test_without_a_gate_the_solution_is_filterpys_ekf():
    """Its Jacobians taken numerically, so that neither side borrows from the other."""
    log, noise = recorded("real", 2, 250), recorded("real", 2, 250).noise.told()
    mine, other = ekf(log, gate=np.inf), ExtendedKalmanFilter(dim_x=3, dim_z=2)
    other.x, other.P = mine.xk_k.copy(), mine.Pk_k.copy()
    places = {lm.id: lm.p for lm in log.map}

    def slope(f, x, residual=np.subtract, step=1e-6):
        return np.stack([residual(f(x + e), f(x - e)) for e in step * np.eye(3)], axis=1) / (2 * step)

    def expected(x, y):
        d = np.array([places[lm.id] for lm in y]) - x[:2]
        return np.stack([np.hypot(*d.T), np.arctan2(d[:, 1], d[:, 0]) - x[2]], axis=1).ravel()

    def residual(a, b):
        d = a - b
        d[1::2] = wrap(d[1::2])
        return d

    images = 0
    for u, y in zip(log.controls, log.measurements()):
        mine.predict(u)
        mine.update(y)
        Q = np.diag((noise.odometry * abs(u) + [noise.slip, noise.slip, noise.spin]) ** 2)

        def walk(x, u):
            c, s = np.cos(x[2]), np.sin(x[2])
            return x + [c * u[0] - s * u[1], s * u[0] + c * u[1], u[2]]

        A, W = slope(partial(walk, u=u), other.x), slope(partial(walk, other.x), u)
        other.x, other.P = walk(other.x, u), A @ other.P @ A.T + W @ Q @ W.T
        if y:
            r = expected(other.x, y)[::2]
            bearing = [noise.bearing if lm.complete else noise.bearing_partial for lm in y]
            R = np.diag(np.stack([[noise.of_range(lm) for lm in y] * r, bearing], axis=1).ravel() ** 2)
            z, images = np.concatenate([lm.p for lm in y]), images + 1
            look = partial(expected, y=y)
            other.update(z, partial(slope, look, residual=residual), look, R=R, residual=residual)
        assert far(mine.xk_k, other.x) < 1e-6
        np.testing.assert_allclose(mine.Pk_k, other.P, atol=1e-6)
    assert images > 100


def test_with_a_heading_that_is_known_and_nothing_in_view_the_solution_is_a_linear_filter():
    noise, theta, rng = Noise(odometry=0.2, slip=0.01, spin=0.0), 2.2, np.random.default_rng(0)
    mine = answer("EKF")([1.0, 0.5, theta], np.diag([0.04, 0.09, 0.0]), FIELD.map, noise)
    turn = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])
    other = KalmanFilter(dim_x=2, dim_z=2)
    other.x, other.P, other.F = np.array([1.0, 0.5]), np.diag([0.04, 0.09]), np.eye(2)
    for u in rng.uniform(-0.1, 0.1, (100, 2)):
        mine.predict(np.array([*u, 0.0]))
        mine.update([])
        other.predict(u=u, B=turn, Q=turn @ np.diag((0.2 * abs(u) + 0.01) ** 2) @ turn.T)
        np.testing.assert_allclose(mine.xk_k, [*other.x, theta])
        np.testing.assert_allclose(mine.Pk_k[:2, :2], other.P)
        assert not mine.Pk_k[2].any()


def test_the_gate_leaves_a_lie_out_and_says_how_surprising_it_was():
    pose, kf = np.array([0.0, 0.5, 0.3]), ekf(recorded(), x0=(0.05, 0.5, 0.3))
    y = [Sighting(answer("h")(pose, lm), lm.id) for lm in FIELD.map[1:4]]
    honest = ekf(recorded(), x0=(0.05, 0.5, 0.3))
    honest.update([y[0], y[2]])
    y[1].p[:] = 0.4, -2.0
    kf.update(y)
    np.testing.assert_allclose(kf.xk_k, honest.xk_k)
    np.testing.assert_allclose(kf.Pk_k, honest.Pk_k)
    assert len(kf.d2) == 3 and kf.d2[1] > 100 and max(kf.d2[0], kf.d2[2]) < 1
    kf.update([y[1]])
    assert len(kf.d2) == 1 and kf.d2[0] > 100
    np.testing.assert_array_equal(kf.update([]), kf.d2 or None)


@pytest.mark.parametrize("noise", ["paper", "real", "harsh"])
@pytest.mark.parametrize("gate", [13.8, np.inf])
def test_the_covariance_stays_one(noise, gate):
    log = recorded(noise, 4, 200, 100)
    h = replay(ekf(log, gate=gate), log)
    believable(h.x, h.P)
    believable(h.x_prior, h.P_prior)
    assert (abs(h.x[:, 2]) <= np.pi).all()


@pytest.mark.slow
def test_the_solution_is_consistent():
    """Mean NEES over 40 runs lies within its 95 % chi-square bounds at 85 % of the steps or more."""
    nees = []
    for seed in range(40):
        log = recorded(PLAIN, seed, 150)
        first = log.truth[0] + np.random.default_rng(1000 + seed).normal(0, 0.1, 3)
        nees.append(metrics.nees(replay(ekf(log, first, noise=PLAIN), log), log))
    mean, (low, high) = np.mean(nees, axis=0), metrics.chi2_bounds(3, runs=40)
    assert np.mean((low < mean) & (mean < high)) >= 0.85
    assert 2.6 < mean.mean() < 3.6


# How well, how soon: figures of the lab, with room


@cache
def carried():
    """Results of a race on walks with a kidnapping, by name."""
    spread = answer("lost_by_spread")

    def paper(log):
        return Hybrid(FuzzyGrid(log.noise.told()), lambda x0, P0: ekf(log, x0, P0), lambda P, d2: spread(P))

    names = ["EKF alone", "MCL + EKF", "grid + EKF", "grid (backgr.) + EKF", "memory + EKF"]
    logs = [recorded("real", seed, 300, 150) for seed in range(RUNS)]
    return {r.name: r for r in race({"paper's rule": paper, **{name: CONTESTANTS[name] for name in names}}, logs)}


@cache
def quiet():
    names = ["EKF alone", "grid alone", "grid + EKF", "memory + EKF"]
    logs = [LeggedRobot("real", rng=seed).record(300) for seed in range(RUNS)]
    return {r.name: r for r in race({name: CONTESTANTS[name] for name in names}, logs)}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["EKF alone", "paper's rule"])
def test_a_covariance_does_not_notice_a_kidnapping(name):
    assert np.isfinite(carried()[name].recovered()).mean() < 0.4


@pytest.mark.slow
@pytest.mark.parametrize("name", ["MCL + EKF", "grid + EKF", "grid (backgr.) + EKF", "memory + EKF"])
def test_surprises_do_and_every_robot_is_found_again(name):
    assert (carried()[name].recovered() <= 110).all()  # not so if any is NaN
    assert (carried()[name].found() <= 110).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["grid + EKF", "memory + EKF"])
def test_taking_turns_is_as_good_as_the_best_of_the_two(name):
    error = {r.name: 100 * r.tracking.mean() for r in quiet().values()}
    assert error[name] < 6.5
    assert error[name] < 0.75 * error["grid alone"]
    assert error[name] < 1.15 * error["EKF alone"]


# Where nothing helps

BLIND = Noise(0.2, 0.1, 0.15, 0.035, 0.314, occlusion=1.0)
AHEAD, CURVE, STILL = (0.05, 0.0, 0.0), (0.02, 0.01, 0.03), (0.0, 0.0, 0.0)


def told(log):
    """The log with the noise that a filter expects who has not heard the worst."""
    return replace(log, noise=recorded().noise)


@cache
def hard(name):
    lost = cut(recorded("real", 0, 360), recorded("real", 0, 360).seen_step < 60)
    return {
        "nothing in view, ever": lambda: told(recorded(BLIND, 0, 300)),
        "nothing in view any more": lambda: lost,
        "nothing but lies": lambda: told(recorded(replace(BLIND, false_positives=1.0), 0, 300)),
        "out of the field": lambda: guided("real", AHEAD, 300),
        "out of the field, blind": lambda: replace(lost, controls=np.tile([0.1, 0.0, 0.0], (360, 1))),
        "round and round": lambda: guided("harsh", CURVE, 300),
        "standing": lambda: guided("real", STILL, 300),
        "standing, blind": lambda: cut(guided("real", STILL, 300), guided("real", STILL, 300).seen_step < 60),
        "exact": lambda: told(recorded(EXACT, 0, 200)),
    }[name]()


@cache
def run(contestant, case):
    log = hard(case)
    return replay(CONTESTANTS[contestant](log), log)


CASES = [
    "nothing in view, ever",
    "nothing in view any more",
    "nothing but lies",
    "out of the field",
    "out of the field, blind",
    "round and round",
    "standing",
    "standing, blind",
    "exact",
]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("contestant", CONTESTANTS)
@pytest.mark.parametrize("case", CASES)
def test_no_localizer_breaks(contestant, case):
    h = run(contestant, case)
    believable(h.x, h.P)
    assert (abs(h.x[:, 2]) <= np.pi + 1e-9).all() and h.P[:, :2, :2].trace(axis1=1, axis2=2).max() < 1e3


@pytest.mark.parametrize("contestant", CONTESTANTS)
@pytest.mark.parametrize("case", ["nothing in view any more", "standing, blind"])
def test_a_localizer_that_sees_nothing_more_knows_less_and_less(contestant, case):
    spread = run(contestant, case).P[60:, :2, :2].trace(axis1=1, axis2=2)
    assert spread[-1] > spread[0]


@pytest.mark.parametrize("contestant", CONTESTANTS)
def test_a_localizer_that_never_sees_anything_is_never_sure(contestant):
    spread = run(contestant, "nothing in view, ever").P[:, :2, :2].trace(axis1=1, axis2=2)
    assert spread[-1] > spread[0] or spread.min() > 4  # all of the field is as little as one can know
    if contestant not in ("EKF alone", "EKF, no gate"):
        assert spread.min() > 4


@pytest.mark.parametrize("contestant", [name for name in CONTESTANTS if "EKF" in name and name != "EKF, no gate"])
@pytest.mark.parametrize("case", ["standing", "exact"])
def test_an_easy_walk_is_easy(contestant, case):
    off = run(contestant, case).x - hard(case).truth
    assert np.hypot(*off[100:, :2].T).max() < 0.25 and abs(wrap(off[100:, 2])).max() < 0.15


# Races


def still(log):
    return Triangulation()


def test_a_race_runs_everyone_over_everything():
    made, seen = [], []

    def make(log):
        made.append(log)
        return ekf(log)

    logs = [recorded("real", seed, 150, 120) for seed in range(3)]
    one, two = race({"EKF": make, "none": still}, iter(logs), lambda logs: seen.append(len(logs)) or logs)
    assert [log is other for log, other in zip(made, logs)] == [True] * 3 and seen == [3]
    assert (one.name, two.name) == ("EKF", "none") and one.distance.shape == one.turned.shape == (3, 151)
    for log, distance, turned in zip(logs, one.distance, one.turned):
        error = metrics.errors(replay(ekf(log), log), log)
        np.testing.assert_allclose(distance, np.hypot(*error[:, :2].T))
        np.testing.assert_allclose(turned, abs(error[:, 2]))
    assert one.tracking.shape == (3, 20) and one.kidnapped == 120 and one.seconds > 0
    np.testing.assert_array_equal(one.tracking, one.distance[:, 101:121])


@pytest.mark.parametrize(
    ("contestants", "logs", "message"),
    [
        ({"a": still}, [], "logs is empty"),
        ({}, [recorded()], "contestants is empty"),
        ({"a": still}, [recorded(steps=20), recorded(steps=21)], "logs of one length"),
        ({"a": still}, [recorded(steps=20), recorded(steps=20, kidnap=5)], "kidnapping at the same step"),
        ({"a": still}, [recorded(steps=20, kidnap=6), recorded(steps=20, kidnap=5)], "kidnapping at the same step"),
    ],
)
def test_what_no_race_can_be_is_named(contestants, logs, message):
    with pytest.raises(ValueError, match=message):
        race(contestants, logs)


def test_a_contestant_that_breaks_is_told_where():
    with pytest.raises(FilterError, match="stopped in step 1 of 20"):
        race({"a": lambda log: type("KF", (Triangulation,), {"update": lambda self, y: 1 / 0})()}, [recorded(steps=20)])


def test_found_means_near_and_staying_so():
    far_off, near = np.full(20, 1.0), np.full(20, 0.1)
    assert steps_until_found(near) == 1
    assert np.isnan(steps_until_found(far_off)) and np.isnan(steps_until_found(near[:9]))
    assert steps_until_found(near[:10]) == 1
    assert steps_until_found(np.concatenate([far_off, near])) == 21
    assert steps_until_found(np.concatenate([near[:9], far_off[:1], near])) == 11  # nine are not enough
    assert np.isnan(steps_until_found(np.full(20, 0.3))) and steps_until_found(np.full(20, 0.3), within=0.31) == 1
    assert steps_until_found(far_off * [*[1] * 15, *[0.1] * 5], hold=5) == 16


def test_times_count_from_the_start_and_from_the_kidnapping():
    distance = np.ones((2, 61))
    distance[0, 5:31], distance[0, 40:] = 0.1, 0.1  # the robot is carried away in step 30
    sure = np.ones((2, 61), dtype=bool)
    found = Result(name="a", distance=distance, turned=distance, sure=sure, seconds=0.001, kidnapped=30)
    np.testing.assert_array_equal(found.found(), [5, np.nan])
    np.testing.assert_array_equal(found.recovered(), [10, np.nan])
    sure[0, :12], sure[0, 50:] = False, False  # near by chance
    np.testing.assert_array_equal(found.found(), [12, np.nan])
    np.testing.assert_array_equal(found.recovered(), [10, np.nan])
    sure[0, 45:] = False
    assert np.isnan(found.recovered()).all()
    distance[1, 40:] = 0.1  # who is found only after the kidnapping was not found from nothing
    np.testing.assert_array_equal(found.found(), [12, np.nan])
    np.testing.assert_array_equal(found.recovered(), [np.nan, 10])


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("kidnap", [(), 120])
def test_a_table_has_a_line_for_each_contestant(kidnap):
    logs = [recorded("real", seed, 160, kidnap) for seed in range(2)]
    lost = {"never": lambda log: Memory(lambda past: None, "real")}
    results = race({"EKF": ekf, "triangulation": still, **lost}, logs)
    text = table(results).splitlines()
    lines = [line for line in text if line.split()[0] in ("EKF", "triangulation", "never")]
    assert [line.split()[0] for line in lines] == ["EKF", "triangulation", "never"]
    assert lines[0].endswith(" 1.0") and lines[2].count("-     -     0 %") == (2 if kidnap else 1)
    for line, result in zip(lines, results):
        assert f" {100 * result.tracking.mean():.1f} " in line and f" {1e3 * result.seconds:.3f} " in line
    assert len({len(line) for line in lines}) == 1


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("length", "kidnap"), [(80, ()), (200, 60)])
def test_a_table_of_walks_too_short_to_settle_is_still_a_table(length, kidnap):
    text = table(race({"EKF": ekf, "triangulation": still}, [recorded("real", 0, length, kidnap)]))
    assert "\nEKF " in text and "\ntriangulation " in text


def test_of_two_cells_as_possible_that_meet_the_same_one_stays_on_every_processor():
    grid = FuzzyGrid("real")
    rng = np.random.default_rng(0)
    grid.theta = rng.uniform(-np.pi, np.pi, grid.h.shape)  # they walk in all directions: many meet
    grid.h = rng.choice([0.01, 0.2, 1.0], grid.h.shape)
    x, y = grid.px + 0.3 * np.cos(grid.theta) - grid.x[0], grid.py + 0.3 * np.sin(grid.theta) - grid.y[0]
    row, column = np.rint(y / grid.cell).astype(int), np.rint(x / grid.cell).astype(int)
    due = {}
    for n in sorted(range(grid.h.size), key=lambda n: grid.h.flat[n]):
        due[row.flat[n], column.flat[n]] = grid.theta.flat[n]
    grid._shift(np.array([0.3, 0.0]))
    ny, nx = grid.h.shape
    kept = {place: theta for place, theta in due.items() if 0 <= place[0] < ny and 0 <= place[1] < nx}
    assert len(kept) < 0.8 * grid.h.size
    assert all(grid.theta[place] == theta for place, theta in kept.items())
