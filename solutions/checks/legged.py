"""Lab 4: the extended Kalman filter, first with one sighting, then with a variable number of them and a gate."""

import numpy as np

from labkit.instructor.authoring.spec import Check, Mistake, Parts, Right
from labkit.geometry import compose
from labkit.legged import LeggedRobot

from .legged_parts import ANALYTIC, FIELD, JACOBIAN_MISTAKES, LAB, NOISE, STACK_MISTAKES, Y
from .probes import UPDATE, drawn_poses, pose_probing, seen_from

STATE = ["xk_k", "Pk_k", "d2"]
X0, P0 = [0.4, -0.7, 0.15], [[0.05, 0.01, 0.004], [0.01, 0.03, -0.006], [0.004, -0.006, 0.02]]
SMALL = [[value / 20 for value in row] for row in P0]
NOISY = {**NOISE, "slip": 0.02, "spin": 0.04}
WEST = [0.4, 0.3, 0.05]
LIE = ["pink-yellow", 0.6, -2.0, True]  # a false alarm


def scenario(id, title, calls, x0=X0, P=P0, options=(), **more):
    calls = [[name, arg if name == "predict" else {"legged.sightings": arg}] for name, arg in calls]
    make = [{"x0": x0, "P0": P, "m": {"legged.map": FIELD}, "noise": {"legged.noise": NOISY}}, dict(options)]
    return {"id": id, "title": title, "look": STATE, "make": make, "calls": calls, **more}


def walk(seed, steps=20, every=5):
    """A short walk in strides of `every` steps, some of it without a landmark."""
    log = LeggedRobot("real", pose=[-0.6, 0.4, 1.2], rng=seed).record(steps * every)
    calls, stride = [], np.zeros(3)
    for k, (u, y) in enumerate(zip(log.controls, log.measurements()), 1):
        stride = compose(stride, u)
        if k % every == 0:
            calls += [
                ("predict", stride.round(4).tolist()),
                ("update", [[lm.id, *lm.p.round(4).tolist(), lm.complete] for lm in y]),
            ]
            stride = np.zeros(3)
    title = f"a walk of {steps} strides"
    return scenario("walk", title, calls, x0=[-0.55, 0.35, 1.25], at=[2, 10, 20, 2 * steps])


STEP, BACK = [0.3, -0.12, 0.2], [-0.1, 0.2, -0.3]
ALL = [
    scenario("empty", "update without a landmark changes nothing", [("update", [])]),
    scenario("one", "update with one landmark", [("update", [Y[0]])]),
    scenario("partial", "update with a landmark that is cut off", [("update", [Y[2]])]),
    scenario("many", "update with four landmarks", [("update", [Y[2], Y[0], Y[3], Y[1]])]),
    scenario("edge", "a bearing across 180 degrees", [("update", [Y[4]])], x0=WEST),
    scenario(
        "wrap",
        "an update that carries the heading across 180 degrees",
        [("update", [["blue goal", 2.4, -2.95, True]])],
        x0=[0.4, -0.7, 3.1],
    ),
    scenario("lie", "a false alarm beside an honest sighting: the gate", [("update", [LIE, Y[0]])]),
    scenario("only-lie", "nothing but a false alarm", [("update", [LIE])]),
    scenario("gate", "another gate: 3", [("update", [["blue-pink", 1.62, -0.38, True], Y[2]])], options={"gate": 3.0}),
    scenario(
        "doubtful",
        "a sighting that is five standard deviations off",
        [("update", [["blue-pink", 1.62, 0.05, True], Y[2]])],
    ),
    scenario("beyond", "a robot beyond the field", [("update", [["blue goal", 1.2, 3.05, True]])], x0=[4.2, 0.1, 0.1]),
    scenario("twice", "two updates, one after the other, the second empty", [("update", [Y[0]]), ("update", [])]),
    walk(3),
]
ALONE = ("empty", "one", "partial", "edge", "wrap", "beyond", "twice")  # one landmark at most, within the gate

APPEND = "self.d2.append(nu[block] @ np.linalg.solve(S[block, block], nu[block]))"
KEEP = "keep = np.repeat(np.array(self.d2) < self.gate, 2)"
S = "S = H @ self.Pk_k @ H.T + R"
NONE = "        if not keep.any():\n            return\n"
K = "K = np.linalg.solve(S, H @ self.Pk_k).T"
X, WRAPX = "self.xk_k = self.xk_k + K @ nu", "        self.xk_k[2] = wrap(self.xk_k[2])\n"
P = "self.Pk_k = I_KH @ self.Pk_k @ I_KH.T + K @ R @ K.T"
GUARD = "        if not y:\n            return\n"
SEQUENTIAL = """class EKF(EKF):
    def update(self, y):
        self.d2 = []
        for lm in y:
            nu, H, R = stack([lm], self.map, self.xk_k, self.noise)
            S = H @ self.Pk_k @ H.T + R
            self.d2.append(float(nu @ np.linalg.inv(S) @ nu))
            if self.d2[-1] < self.gate:
                K = self.Pk_k @ H.T @ np.linalg.inv(S)
                self.xk_k = self.xk_k + K @ nu
                self.xk_k[2] = wrap(self.xk_k[2])
                self.Pk_k = (np.eye(3) - K @ H) @ self.Pk_k
"""

RIGHT = [
    Right("short form", [(P, "self.Pk_k = I_KH @ self.Pk_k")]),
    Right("analytic", ANALYTIC),
    Right("inverse", [(K, "K = self.Pk_k @ H.T @ np.linalg.inv(S)")]),
    Right("K S K'", [(P, "self.Pk_k = self.Pk_k - K @ S @ K.T")]),
    Right("d2 array", [(KEEP, "self.d2 = np.array(self.d2)\n        keep = np.repeat(self.d2 < self.gate, 2)")]),
    Right("sequential", SEQUENTIAL, other=True),
]

# What parts have to say about themselves they say in their own checks; these show in the filter as well.
PARTS = [m for m in JACOBIAN_MISTAKES if m.id in ("half", "no-heading")][:1] + [
    m for m in STACK_MISTAKES if m.id in ("innovation-not-wrapped", "not-squared", "never-partial")
]

ONE_MISTAKES = [
    Mistake(
        "empty-crash",
        "`update` does not expect an empty list: with no landmark in view there is nothing to correct.",
        [(GUARD, "")],
    ),
    Mistake("heading-not-wrapped", "After the update the heading is outside (-pi, pi]: wrap it.", [(WRAPX, "")]),
    Mistake(
        "position-wrapped",
        "The whole pose is wrapped, metres included: only the heading is an angle.",
        [(WRAPX, "        self.xk_k = wrap(self.xk_k)\n")],
    ),
    Mistake(
        "x-not-corrected",
        "`update` leaves the pose as it was: is the corrected one assigned to self.xk_k?",
        [(X, "self.xk_k + K @ nu")],
    ),
    Mistake("sign", "The correction points the wrong way: add K nu.", [(X, X.replace("+ K", "- K"))]),
    Mistake("x-replaced", "The correction replaces the pose: add it to the prediction.", [(X, "self.xk_k = K @ nu")]),
    Mistake(
        "p-not-updated",
        "`update` leaves the covariance as it was: a sighting makes the pose more certain.",
        [(P, "pass")],
    ),
    Mistake(
        "p-half-joseph",
        "The second half of the Joseph form is missing: (I - K H) P (I - K H)' + K R K'.",
        [(P, "self.Pk_k = I_KH @ self.Pk_k @ I_KH.T")],
    ),
    Mistake(
        "p-plus",
        "I + K H instead of I - K H: the covariance grows in `update`.",
        [("I_KH = np.eye(3) - K @ H", "I_KH = np.eye(3) + K @ H")],
    ),
    Mistake(
        "s-without-r",
        "R is missing in S: the innovation is uncertain because of the estimate (H P H') and of the sensor (R).",
        [(S, "S = H @ self.Pk_k @ H.T + 1e-9 * np.eye(len(nu))")],
    ),
    Mistake("s-without-p", "H P H' is missing in S: S = H P H' + R.", [(S, "S = R.copy()")]),
    Mistake(
        "gain-inverts-r",
        "The gain inverts R instead of S = H P H' + R.",
        [(K, "K = self.Pk_k @ H.T @ np.linalg.inv(R)")],
    ),
    Mistake("gain-not-inverted", "S is not inverted in the gain: K = P H' S^-1.", [(K, "K = self.Pk_k @ H.T @ S")]),
]

MISTAKES = [
    Mistake(
        "no-gate",
        "There is no gate: sightings with a d2 of self.gate or more are left out.",
        [(KEEP, "keep = np.repeat(np.array(self.d2) < np.inf, 2)")],
    ),
    Mistake(
        "gate-fixed", "The gate is always 13.8: compare with `self.gate`.", [(KEEP, KEEP.replace("self.gate", "13.8"))]
    ),
    Mistake(
        "gate-reversed",
        "The gate is the wrong way round: what fits is thrown away, and what does not is used.",
        [(KEEP, KEEP.replace("<", ">"))],
    ),
    Mistake(
        "gate-of-root",
        "The gate compares the square root of d2 with self.gate, or d2 with its square: it is meant for d2 itself.",
        [(KEEP, KEEP.replace("np.array(self.d2)", "np.sqrt(self.d2)"))],
    ),
    Mistake(
        "gate-for-all",
        "One bad sighting throws away all of the picture: decide for each landmark by itself.",
        [(KEEP, "keep = np.repeat(np.full(len(y), max(self.d2) < self.gate), 2)")],
    ),
    Mistake(
        "gate-of-sum",
        "d2 is computed from all landmarks together: each has its own, from its two numbers and its block of S.",
        [(KEEP, "self.d2 = [nu @ np.linalg.solve(S, nu)] * len(y)\n        " + KEEP)],
    ),
    Mistake(
        "gate-without-s",
        "d2 is the plain square of the innovation: divide by S, as metres and radians have different scales.",
        [(APPEND, "self.d2.append(nu[block] @ nu[block])")],
    ),
    Mistake(
        "gate-with-r",
        "d2 is computed with R instead of S = H P H' + R: when the filter is unsure, more is possible.",
        [(APPEND, APPEND.replace("S[block, block]", "R[block, block]"))],
    ),
    Mistake(
        "d2-root",
        "`self.d2` holds the square roots: keep d2 itself, the square.",
        [
            (APPEND, "self.d2.append(np.sqrt(nu[block] @ np.linalg.solve(S[block, block], nu[block])))"),
            (KEEP, KEEP.replace("np.array(self.d2)", "np.square(self.d2)")),
        ],
    ),
    Mistake(
        "d2-not-kept",
        "`self.d2` stays empty: keep the d2 of every landmark in view, you will need them in lab 5.",
        [(NONE, NONE.replace("        if", "        self.d2 = []\n        if", 1))],
    ),
    Mistake(
        "d2-only-kept",
        "`self.d2` holds only what passed the gate: keep the d2 of every landmark in view. The surprises are what "
        "you will need.",
        [(NONE, "        self.d2 = [v for v in self.d2 if v < self.gate]\n" + NONE)],
    ),
    Mistake(
        "d2-grows",
        "`self.d2` still holds those of the updates before: start each update with an empty list.",
        [("        self.d2 = []\n        if not y", "        if not y")],
    ),
    Mistake(
        "d2-old-when-empty",
        "With no landmark in view `self.d2` still holds the last ones: empty it first.",
        [
            (
                "        self.d2 = []\n        if not y:\n            return\n",
                "        if not y:\n            return\n        self.d2 = []\n",
            )
        ],
    ),
]

PLACES = {id: place for id, *place in FIELD}
LOOK = {"range_beacon", "range_goal", "range_floor", "bearing", "bearing_partial"}  # the sensor's noise


def made(x0, P0, factor, gate):
    noise = {name: value * factor if name in LOOK else value for name, value in NOISY.items()}
    return [{"x0": x0, "P0": P0, "m": {"legged.map": FIELD}, "noise": {"legged.noise": noise}}, {"gate": gate}]


def probing(x0, P0, u):
    return pose_probing(
        x0,
        P0,
        made,
        lambda x0, id: seen_from(x0, PLACES[id]),
        lambda id, z: ("legged.sightings", [id, *z, True], 1),
        ["xk_k", "Pk_k"],
        u,
        ["yellow goal", "pink-yellow", "blue goal", "yellow-pink", "pink-blue"],
        lambda id, z: ("legged.sightings", [id, *z, False], 1),
    )


BEGIN = X0, P0, [STEP, BACK]
PROBING = probing(*BEGIN)
ONE = [{**s, "look": ["xk_k", "Pk_k"]} for s in ALL if s["id"] in ALONE]  # before there are a gate and its d2
MANY = [s for s in ALL if s["id"] not in ("empty", "one", "partial", "edge")]
PROBING_ONE = {**PROBING, "probes": [probe for probe in PROBING["probes"] if "after" not in probe]}  # no gate yet
DIVIDED = Parts(UPDATE, drawn_poses(*BEGIN, probing))
CHECKS = [
    Check("legged-one", LAB, "EKF", "filter", ONE, RIGHT, PARTS + ONE_MISTAKES, PROBING_ONE),
    Check("legged-ekf", LAB, "EKF", "filter", MANY, RIGHT, MISTAKES + ONE_MISTAKES, PROBING, divided=DIVIDED),
]
