"""What a student's filter is asked so that its numbers tell which quantity in it is wrong: see labkit.checks.identify."""

import numpy as np

from .inputs import STATE, Q

X0, P0 = [0.3, -0.4], [[0.5, 0.12], [0.12, 0.3]]
U = [[0.6, -0.9], [-0.4, 0.3]]
WIDE = [[1e6, 0.0], [0.0, 1e6]]  # beside which the sensor's noise is nothing
TINY = [[1e-9, 0.0], [0.0, 1e-9]]
TURN = 2 * np.pi
# Limits of d2, and innovations that are to be let pass by them or not.
GATES = [
    *((2.0, off) for off in ((0.5, 0), (0, 0.2), (1.0, 0), (0, 0.4), (1.6, 0), (0, 0.9))),
    *((6.0, off) for off in ((0.6, 0), (0, 0.3), (0, 0.5), (1.6, 0.3))),
    *((40.0, off) for off in ((0.0, 0.9), (2.0, 0), (3.6, 0), (0, 2))),
]
OFF = (0.03, 0.02)  # so that what depends on the sign of an innovation does not stand on its edge
NEXT = (-0.4, -2.0)  # so far, from the second landmark of XY_MAP, that the fourth is nearer
LITTLE = (3e-3, 2e-3)  # the same, so little that H is the same from the measurement


XY_MAP = [[0, 1.9, 0.9], [1, -1.2, 0.8], [2, 0.4, -2.0], [3, -1.6, -1.4]]
# Ids that are places of other landmarks; seen from X0: in each quadrant, due east, west, north and south.
RB_MAP = [[7, 1.9, 0.9], [3, -1.2, 0.8], [5, 0.4, -2.0], [4, -1.6, -1.4]]
RB_MAP += [[6, 2.8, -0.4], [2, -1.9, -0.45], [1, 0.3, 1.5], [0, 0.3, -1.9]]


def expected(sensor, x, place):
    """What a robot at x should measure of a landmark at a place, as a list."""
    d = np.subtract(place, x)
    return [float(v) for v in (d if sensor == "xy" else (np.hypot(*d), np.arctan2(d[1], d[0])))]


def scaled(matrix, factor):
    return (np.array(matrix) * factor).tolist()


WEIGHTS = {
    "motion": 20,
    "spread": 20,
    "expected": 10,
    "H": 10,
    "R": 10,
    "gain": 10,
    "empty": 10,
    "runs": 10,
}  # per cent
GATED = WEIGHTS | {"gate": 5, "runs": 5}
UPDATE = {"expected": 20, "H": 15, "R": 10, "gain": 15, "gate": 15, "empty": 15, "runs": 10}  # where `predict` is given


def near(rng, values, by=0.15):
    """Each of the values a little larger or smaller, never the same."""
    values = np.array(values, dtype=float)
    return values * (1 + rng.choice([-1, 1], values.shape) * rng.uniform(0.03, by, values.shape))


def another(rng, P):
    """Another covariance: as large, with standard deviations and correlations a little different."""
    P = np.array(P)
    sigma = np.sqrt(np.diag(P))
    between = near(rng, np.triu(P / np.outer(sigma, sigma), 1), 0.1)
    sigma = near(rng, sigma, 0.1)
    return np.outer(sigma, sigma) * (np.eye(len(P)) + between + between.T)


def drawn(sensor, R, map):
    """A function of a random generator: the same probes with other numbers; landmarks stay in their directions."""

    def draw(rng):
        x0 = np.add(X0, rng.uniform(-0.5, 0.5, 2))
        places = [[id, *(x0 + near(rng, 1) * np.subtract(place, X0)).tolist()] for id, *place in map]
        more = {"x0": x0.tolist(), "u": near(rng, U).tolist(), "dt": float(near(rng, 1))}
        more |= {name: another(rng, of).tolist() for name, of in (("P0", P0), ("Q", Q))}
        return probing(sensor, another(rng, R).tolist(), places, **more)

    return draw


def probing(sensor, R, map, x0=X0, P0=P0, Q=Q, u=U, dt=1.0):
    """The probes of a filter with two states: a dictionary for the check's data. u: two of them;  dt: a factor."""
    places = {id: place for id, *place in map}
    factor = dt
    first, second, third, *_ = places

    def probe(id, *calls, P0=P0, Q=Q, R=R, dt=0.25, **more):
        make = [{"x0": x0, "P0": P0, "Q": Q, "R": R, "m": {"map": map}}, {"dt": factor * dt}]
        start = {} if id.startswith("made") else {"begin": {"xk_k": x0, "Pk_k": P0}}
        return {"id": id, "make": make, "calls": list(calls), "look": [*STATE, "Q", "R"], **start, **more}

    def update(id, *ids, off=LITTLE, step=1e-3, before=(), **more):
        """An update with these landmarks; off: how far the last one's measurement is from what is expected at x0."""
        seen = [[name, *expected(sensor, x0, places[name])] for name in ids]
        seen[-1][1:] = [float(v) for v in np.add(seen[-1][1:], off)]
        more |= {"step": step, "first": 1} if step else {}
        return probe(id, *before, ["update", {"landmarks": seen}], **more)

    u, back = (["predict", one] for one in u)
    loose = {"P0": scaled(P0, 4), "R": scaled(R, 400)}  # so that a filter with a gate of its own lets pass what is far
    far = [(0, TURN - 0.05), (0, 0.05 - TURN), (0, 2.2), (0, -2.2), (4.0, 0)] if sensor == "rb" else [NEXT]
    probes = [
        probe("made"),
        probe("made dt", dt=0.5),
        *(probe(f"predict {n}", call, dt=dt) for n, (call, dt) in enumerate([(u, 0.25), (u, 0.5), (back, 0.2)])),
        *(probe(f"noise {n}", u, P0=TINY, dt=dt) for n, dt in enumerate([0.25, 0.5])),
        probe("empty", ["update", {"landmarks": []}]),
        update("one", first),
        update("one P", first, P0=scaled(P0, 3)),
        update("one R", first, R=scaled(R, 2)),
        update("one scaled", first, P0=scaled(P0, 3), R=scaled(R, 3)),
        update("one Q", first, Q=scaled(Q, 2)),
        update("one dt", first, dt=0.5),
        update("one wide", first, P0=WIDE),
        update("one narrow", first, P0=scaled(P0, 1e-6)),
        update("other", second),
        update("other wide", second, P0=WIDE),
        update("other narrow", second, P0=scaled(P0, 1e-6)),
        *(update(f"at {id}", id) for id in [*places][2:]),
        update("two", second, first, off=(0, 0)),
        update("three", third, first, second, off=(0, 0)),
        update("near", second, **loose),
        update("bent", second, off=(0.5, 0.4), **loose),
        update("bent narrow", second, off=(0.5, 0.4), P0=scaled(P0, 1e-4), R=scaled(R, 16)),
        update("more bent", second, off=(0.5, 0.4), P0=scaled(P0, 4)),
        update("moved", second, before=[u]),
        *([update("two far", second, first, off=(0, TURN - 0.05), step=0)] if sensor == "rb" else []),
        *(update(f"far {n}", second, off=off, step=0, **loose) for n, off in enumerate(far)),
    ]
    return {"rows": ["dx", "dy"] if sensor == "xy" else ["range", "bearing"], "probes": probes}


def pose_probing(x0, P0, make, place, shown, look, u, ids, partial=None):
    """The probes of a filter with poses (labs 4 and 6), where neither dt nor Q nor R is told to the constructor.

    make: (x0, P0, factor, gate) -> what the constructor gets, with that much of the sensor's noise;
    place: (x0, id) -> what should be measured;  shown: (id, z) -> an entry of what `update` gets, with its kind and the
    place of its first number;  u: two steps;  ids: of what may be seen, or ();  partial: as `shown`, of what is seen
    in part, or None.
    """
    n = np.size(x0)
    tiny, wide = (np.eye(n) * size for size in (1e-9, 1e6))
    angles = {"angles": list(range(2, n, 3))}

    def probe(id, *calls, x0=x0, P0=P0, noise=1.0, gate=1e9, **more):
        P0 = np.array(P0).tolist()
        begin = {"begin": dict(zip(look, (x0, P0)))} if id != "made" else {}
        return {"id": id, "make": make(x0, P0, noise, gate), "calls": list(calls), "look": look, **begin, **more}

    def seen(*pairs, x0=x0, shown=shown):
        """An update with these (id, off): what is seen, and how far its measurement is from what is expected."""
        entries = [shown(one, np.add(place(x0, one), off).tolist())[1] for one, off in pairs]
        return ["update", {kind: entries}]

    def update(id, *which, off=OFF, step=1e-3, shown=shown, before=(), **more):
        more |= {"first": start} | angles | ({"step": step} if step else {})
        last = seen(*((one, (0, 0)) for one in which[:-1]), (which[-1], off), shown=shown)
        return probe(id, *before, last, **more)

    def surprise(id, *calls, **more):
        """Updates after which d2 is looked at; each a list of (id, off)."""
        return probe(id, *(seen(*pairs) for pairs in calls), **more) | {
            "look": [*look, "d2"],
            "after": True,
            "first": start,
            **angles,
        }

    P0 = np.array(P0)
    steps = [["predict", one] for one in u]
    probes = [
        probe("made"),
        *(probe(f"predict {k}", step, **angles) for k, step in enumerate(steps)),
        *(probe(f"noise {k}", step, P0=tiny) for k, step in enumerate(steps)),
        *(probe(f"across predict {k}", step, x0=_moved(x0, y)) for k, (step, y) in enumerate(zip(steps, (3.1, -3.1)))),
        probe("beyond predict", steps[0], x0=_moved(x0, x=4.2)),
    ]
    if ids:
        first, second, third, *more = ids
        kind, _, start = shown(first, [0.0, 0.0])
        loose = {"P0": 4 * P0, "noise": 20.0}
        far = [(0, TURN - 0.05), (0, 0.05 - TURN), (0, 2.2), (0, -2.2), (4.0, 0)]
        turned = [(y, off) for y in (3.12, -3.12) for off in (0.3, -0.3)]
        probes += [
            probe("empty", ["update", {kind: []}], **angles),
            update("one", first),
            update("one P", first, P0=3 * P0),
            update("one R", first, noise=np.sqrt(2)),
            update("one scaled", first, P0=3 * P0, noise=np.sqrt(3)),
            update("one wide", first, P0=wide),
            update("one narrow", first, P0=1e-6 * P0),
            *([update("partial", first, shown=partial)] if partial else []),
            update("other", second),
            update("other wide", second, P0=wide),
            update("other narrow", second, P0=1e-6 * P0),
            *(update(f"at {one}", one) for one in (third, *more)),
            update("two", second, first, off=(0, 0)),
            update("three", third, first, second, off=(0, 0)),
            update("near", second, **loose),
            update("bent", second, off=(0.3, 0.2), **loose),
            update("bent narrow", second, off=(0.3, 0.2), P0=1e-4 * P0, noise=4.0),
            update("more bent", second, off=(0.3, 0.2), P0=4 * P0),
            update("moved", second, before=steps[:1]),
            *(update(f"far {k}", second, off=off, step=0, **loose) for k, off in enumerate(far)),
            surprise("d2 one", [(first, OFF)]),
            surprise("d2 one P", [(first, OFF)], P0=3 * P0),
            surprise("d2 one R", [(first, OFF)], noise=np.sqrt(2)),
            surprise("d2 other", [(second, OFF)]),
            surprise("d2 both", [(first, OFF), (second, OFF)]),
            surprise("d2 empty", [(first, OFF)], []),
            surprise("d2 again", [(first, OFF)], [(second, OFF)]),
            surprise("d2 gated", [(first, OFF), (second, (0, 1.8))], gate=10.0),
            surprise("honest", [(first, OFF)], gate=10.0),
            surprise("lie", [(second, (0, 1.8))], gate=10.0),
            surprise("lie first", [(second, (0, 1.8)), (first, OFF)], gate=10.0),
            *(surprise(f"gate {k}", [(second, off)], gate=gate) for k, (gate, off) in enumerate(GATES)),
            *(
                probe(f"across update {k}", seen((second, (0, off)), x0=_moved(x0, y)), x0=_moved(x0, y))
                for k, (y, off) in enumerate(turned)
            ),
            probe("beyond update", seen((second, OFF), x0=_moved(x0, x=4.2)), x0=_moved(x0, x=4.2)),
        ]
    return {"rows": ["range", "bearing"], "probes": probes}


def drawn_poses(x0, P0, u, probes):
    """A function of a random generator: probes(x0, P0, u) with other numbers near these."""

    def draw(rng):
        pose = np.add(x0, rng.uniform(-0.15, 0.15, np.shape(x0)))
        return probes(pose.tolist(), another(rng, P0), near(rng, u).tolist())

    return draw


def _moved(x0, heading=None, x=None):
    """Poses all with this heading, or x."""
    moved = np.array(x0, dtype=float)
    for place, value in ((2, heading), (0, x)):
        moved[..., place] = moved[..., place] if value is None else value
    return moved.tolist()


def seen_from(pose, point):
    """Range and bearing of a point from a pose (x, y, heading)."""
    d = np.subtract(point[:2], pose[:2])
    turn = np.arctan2(d[1], d[0]) - pose[2]
    return [float(np.hypot(*d)), float(np.arctan2(np.sin(turn), np.cos(turn)))]
