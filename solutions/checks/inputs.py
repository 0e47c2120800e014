"""Inputs and code that the filters of labs 1 and 3 have in common."""

import numpy as np

from labkit import Robot, random_map, simulate

STATE = ["xk_k", "Pk_k"]
X0 = [0.4, -0.7]
P0 = [[0.5, 0.15], [0.15, 0.3]]
Q = [[0.08, 0.03], [0.03, 0.05]]


KEEPS = (
    "Your filter goes on in the array x0 or P0 that it was given, and changes it. Here that is fine; but whoever made "
    "the filter finds other numbers there afterwards. It is safer to keep copies, in `__init__`."
)

GATED = (
    "Your filter leaves out a measurement that is very far from what it expects: a gate of your own. That is a good idea, "
    "and lab 4 will have one. But then a filter that is itself far off refuses what is right."
)


def filter_scenario(id, title, R, map, calls, dt=0.25, **more):
    """Inputs for a filter that starts at X0, P0; calls are ('predict', u) or ('update', [(id, p), ...])."""
    calls = [[name, arg if name == "predict" else {"landmarks": [[i, *p] for i, p in arg]}] for name, arg in calls]
    make = [{"x0": X0, "P0": P0, "Q": Q, "R": R, "m": {"map": map}}, {"dt": dt}]
    return {"id": id, "title": title, "look": STATE, "make": make, "calls": calls, **more}


def first_scenarios(R, map):
    """The constructor, predict, and an update without a landmark."""
    made, fields = "the constructor: x0, P0, Q times dt, R divided by dt", [*STATE, "Q", "R"]
    back = ("predict", [-0.3, 0.5])
    return [
        filter_scenario("fields", made, R, map, [], dt=0.2, look=fields),
        filter_scenario("predict", "predict, one step", R, map, [("predict", [0.4, -0.6])]),
        filter_scenario("predict-dt", "predict, two steps of 0.5 s", R, map, [back, back], dt=0.5),
        filter_scenario("empty", "update without a landmark changes nothing", R, map, [("update", [])]),
        filter_scenario("kept", "x0 and P0 stay as they were", R, map, [back], advice=KEEPS, frozen=True),
    ]


def drive(R, sensor, seed, most=9):
    """The scenario of 40 steps among 14 landmarks, some of them in the dark, most of them in view at once.

    A right filter may leave out what is beyond 3 sigma: take a seed without such.
    """
    rng = np.random.default_rng(seed)
    world = random_map(14, rng)
    log = simulate(Robot(X0, np.array(Q), np.array(R), type=sensor, rng=rng), world, steps=40)
    calls = []
    for u, y in zip(log.controls, log.measurements()):
        calls += [("predict", u.tolist()), ("update", [(lm.id, lm.p.round(4).tolist()) for lm in y[:most]])]
    places = [[lm.id, *lm.p.round(4).tolist()] for lm in world]
    return filter_scenario("drive", "a drive of 40 steps", R, places, calls, at=[2, 10, 40, 80])


def with_update(body):
    """A form of a solution: its filter with another `update`."""
    lines = "\n".join(f"        {line}" for line in body.strip("\n").split("\n"))
    return f"class KF(KF):\n    def update(self, y):\n        if len(y) == 0:\n            return\n{lines}\n"


FLOAT32 = [
    ("x0, dtype=float", "x0, dtype=np.float32"),
    ("P0, dtype=float", "P0, dtype=np.float32"),
    ("np.array(Q) * dt", "np.array(Q, dtype=np.float32) * dt"),
    ("np.array(R) / dt", "np.array(R, dtype=np.float32) / dt"),
]


IN_PLACE = [  # the handout's constructor, and a filter that changes what it was given
    ("np.array(x0, dtype=float)", "x0"),
    ("np.array(P0, dtype=float)", "P0"),
    ("self.xk_k = self.xk_k + self.dt * u", "self.xk_k += self.dt * u"),
    ("self.Pk_k = self.Pk_k + self.Q", "self.Pk_k += self.Q"),
    ("self.xk_k = self.xk_k + K @ innovation", "self.xk_k += K @ innovation"),
    ("self.Pk_k = self.Pk_k - K @ S @ K.T", "self.Pk_k -= K @ S @ K.T"),
]


def gated(R, map, seen):
    """The scenario of one measurement that no gate lets pass: a note for who has one."""
    stays = [[X0, P0]] * 2, None
    title = "a measurement that cannot be"
    return filter_scenario("gated", title, R, map, [("update", [seen])], advice=GATED, kept=stays)


def update_scenarios(R, seen, home):
    """A function that makes scenarios of updates for one sensor; `seen` has a measurement for each id."""

    def scenario(id, title, *updates, map=home, R=R, **more):
        """Updates, each with the landmarks of these ids; a tuple (name, id) is seen under another name."""
        pairs = [[(i, i) if isinstance(i, int) else i for i in ids] for ids in updates]
        calls = [("update", [(name, seen[i]) for name, i in ids]) for ids in pairs]
        return filter_scenario(id, title, R, map, calls, **more)

    return scenario
