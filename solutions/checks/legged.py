"""Lab 4: the extended Kalman filter with odometry, a variable number of sightings and a gate."""

import numpy as np

from labkit.instructor.authoring.spec import Check, Mistake, Right
from labkit.geometry import compose
from labkit.legged import LeggedRobot

from .legged_parts import (
    ANALYTIC,
    FIELD,
    JACOBIAN_MISTAKES,
    JACOBIANS_MISTAKES,
    LAB,
    MOTION_MISTAKES,
    NOISE,
    STACK_MISTAKES,
    Y,
)
from .probes import pose_probing, seen_from

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
SCENARIOS = [
    scenario("predict", "predict, one step", [("predict", STEP)], P=SMALL),
    scenario(
        "predict-turned", "predict for a robot that faces backward", [("predict", STEP)], x0=[0.4, -0.7, 2.6], P=SMALL
    ),
    scenario("stand", "predict for a robot that stands: it may still slip", [("predict", [0.0, 0.0, 0.0])], P=SMALL),
    scenario(
        "over",
        "predict two steps, across 180 degrees",
        [("predict", STEP), ("predict", BACK)],
        x0=[0.4, -0.7, 3.05],
        P=SMALL,
    ),
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

FLOOR = "floor = np.array([self.noise.slip, self.noise.slip, self.noise.spin])"
Q = "Q = np.diag((self.noise.odometry * np.abs(u) + floor) ** 2)"
MOVE_X, MOVE_P = "self.xk_k = motion(self.xk_k, u)", "self.Pk_k = A @ self.Pk_k @ A.T + W @ Q @ W.T"
JAC = "A, W = motion_jacobians(self.xk_k, u)"
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
PARTS = (
    [m for m in MOTION_MISTAKES if m.id in ("world-frame", "turned-back", "new-heading", "ahead-only")]
    + [m for m in JACOBIANS_MISTAKES if m.id in ("w-turned-back",)]
    + [m for m in JACOBIAN_MISTAKES if m.id in ("half", "no-heading")][:1]
    + [m for m in STACK_MISTAKES if m.id in ("innovation-not-wrapped", "not-squared", "never-partial")]
)

MISTAKES = [
    Mistake(
        "moved-first",
        "The Jacobians are taken at the pose *after* the step: compute A and W before you move.",
        [(JAC, "pass"), (MOVE_X, f"{MOVE_X}\n        {JAC}")],
    ),
    Mistake(
        "q-not-turned",
        "Q is added as it is (or W is the identity): it is in the robot's frame, and W Q W' turns it into the world.",
        [(MOVE_P, MOVE_P.replace("W @ Q @ W.T", "Q"))],
    ),
    Mistake("w-one-side", "W stands on one side only: W Q W'.", [(MOVE_P, MOVE_P.replace("W @ Q @ W.T", "W @ Q"))]),
    Mistake(
        "p-without-a",
        "P is not carried along by A (or A is the identity): A P A' + W Q W'. An error of the heading becomes one of the position when "
        "the robot walks.",
        [(MOVE_P, MOVE_P.replace("A @ self.Pk_k @ A.T", "self.Pk_k"))],
    ),
    Mistake(
        "a-one-side",
        "A stands on one side only: A P A'.",
        [(MOVE_P, MOVE_P.replace("A @ self.Pk_k @ A.T", "A @ self.Pk_k"))],
    ),
    Mistake(
        "a-transposed",
        "A' P A instead of A P A'.",
        [(MOVE_P, MOVE_P.replace("A @ self.Pk_k @ A.T", "A.T @ self.Pk_k @ A"))],
    ),
    Mistake(
        "q-forgotten",
        "Q is missing in predict: without it the filter becomes surer than it can be.",
        [(MOVE_P, "self.Pk_k = A @ self.Pk_k @ A.T")],
    ),
    Mistake(
        "q-not-squared", "Q holds standard deviations: a covariance holds their squares.", [(Q, Q.replace(" ** 2", ""))]
    ),
    Mistake(
        "q-of-paper",
        "This is the paper's Q, linear in |u|: a variance is the *square* of noise.odometry |u| + floor.",
        [(Q, "Q = np.diag(self.noise.odometry * np.abs(u))")],
    ),
    Mistake(
        "no-floor",
        "The floor is missing: a robot that stands, or walks straight ahead, still slips a little in every direction.",
        [(Q, Q.replace(" + floor", ""))],
    ),
    Mistake(
        "floor-of-variance",
        "The standard deviations are added before they are squared: (noise.odometry |u| + floor)^2.",
        [(Q, "Q = np.diag((self.noise.odometry * u) ** 2 + floor**2)")],
    ),
    Mistake(
        "no-abs",
        "The odometry's sign is kept: a step backward has noise as well, so use |u|.",
        [(Q, Q.replace("np.abs(u)", "u"))],
    ),
    Mistake(
        "slip-and-spin",
        "slip and spin are mixed up: slip is of the position (ahead and to the left), spin of the heading.",
        [(FLOOR, "floor = np.array([self.noise.slip, self.noise.spin, self.noise.spin])")],
        [(FLOOR, "floor = np.array([self.noise.spin, self.noise.spin, self.noise.slip])")],
    ),
    Mistake("x-not-moved", "`predict` leaves the pose as it was.", [(MOVE_X, "motion(self.xk_k, u)")]),
    Mistake("p-not-predicted", "`predict` leaves the covariance as it was.", [(MOVE_P, "pass")]),
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
        "The gate compares the square root of d2 with self.gate: it is meant for d2 itself.",
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
        "`self.d2` stays empty: keep the d2 of every landmark in view, you will need them in section 8.",
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

PLACES = {id: place for id, *place in FIELD}
LOOK = {"range_beacon", "range_goal", "range_floor", "bearing", "bearing_partial"}  # the sensor's noise


def made(x0, P0, factor, gate):
    noise = {name: value * factor if name in LOOK else value for name, value in NOISY.items()}
    return [{"x0": x0, "P0": P0, "m": {"legged.map": FIELD}, "noise": {"legged.noise": noise}}, {"gate": gate}]


PROBING = pose_probing(
    X0,
    P0,
    made,
    lambda x0, id: seen_from(x0, PLACES[id]),
    lambda id, z: ("legged.sightings", [id, *z, True], 1),
    ["xk_k", "Pk_k"],
    [STEP, BACK],
    ["yellow goal", "pink-yellow", "blue goal", "yellow-pink", "pink-blue"],
    lambda id, z: ("legged.sightings", [id, *z, False], 1),
)
CHECKS = [Check("legged-ekf", LAB, "EKF", "filter", SCENARIOS, RIGHT, PARTS + MISTAKES, PROBING)]
