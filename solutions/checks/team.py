"""Lab 6's filters: the paper's, in which one robot moves, and that of a group."""

import numpy as np

from labkit.instructor.authoring.spec import Check, Mistake, Parts, Right

from .probes import GATED, drawn_poses, pose_probing, seen_from

LAB = "06_observers"

X0 = [[0.1, -0.2, 0.3], [-4.0, 1.5, -0.4], [3.5, 2.5, -2.6]]
P0 = [[0.04 if i == j else 0.03 if i // 3 == j // 3 else 0.002 for j in range(9)] for i in range(9)]
NOISE = {"walk": 0.05, "side": 0.03, "turn": 0.06, "range": 0.08, "bearing": 0.03, "lateral": 0.2}
U = [[0.5, 0.1, 0.2], [0.3, -0.05, -0.3], [0.0, 0.0, 0.0]]
SEEN = {
    "a": [1, 0, 4.2, 0.2],
    "b": [2, 0, 4.2, -0.02],
    "back": [0, 1, 4.9, 2.2],
    "edge": [0, 1, 4.5, -3.12],
    "b2": [2, 0, 4.8, 0.2],
    "close": [1, 0, 0.95, 0.5],
    "far": [1, 0, 3.9, 0.3],
    "false": [1, 2, 2.0, 1.5],
}


def run(id, title, *calls, x0=X0, **options):
    calls = [
        ["predict", U] if call is None else ["update", {"team.readings": [SEEN[name] for name in call]}]
        for call in calls
    ]
    make = [{"x0": x0, "P0": P0, "noise": {"team.noise": NOISE}}, options]
    return {"id": id, "title": title, "look": ["x", "P", "d2"], "make": make, "calls": calls}


ACROSS = [[0.1, -0.2, 3.0], *X0[1:]]
PREDICT = [
    run("predict", "predict, one step", None),
    run("twice", "predict two steps, the heading across 180 degrees", None, None, x0=ACROSS),
    run("inflate", "another inflate", None, inflate=9.0),
]
READING = [
    run("one", "update with one reading", ["a"]),
    run("self", "a reading of robot 0 itself", ["back"]),
    run("edge", "a bearing across 180 degrees", ["edge"], x0=[[0.1, -0.2, -0.35], *X0[1:]]),
    run("close", "a reading from close by: R at the expected range", ["close"], x0=[X0[0], [-0.35, -0.4, 0.1], X0[2]]),
    run(
        "round",
        "a heading that the update carries across 180 degrees",
        ["far"],
        x0=[[0.1, -0.2, 0.3], [3.9, 1.5, 3.13], X0[2]],
    ),
]
PAPER = [
    run("empty", "update without a reading changes nothing", []),
    run("two", "update with two readings, one after the other", ["a", "b"]),
    run("false", "a false reading beside an honest one: the gate", ["false", "a"]),
    run("gate", "another gate", ["a", "b2"], gate=3.0),
    run("again", "two updates, one after the other", ["a"], ["b"]),
    run("both", "predict, then update", None, ["b", "back"]),
]
EKF = [
    run("predict", "predict, one step", None),
    run("twice", "predict two steps, one heading across 180 degrees", None, None, x0=ACROSS),
    run("inflate", "another inflate", None, inflate=9.0),
]
COS, F_BLOCK = "cos, sin = np.cos(self.x[i, 2]), np.sin(self.x[i, 2])", "[[1, 0, -dy], [0, 1, dx], [0, 0, 1]]"
ADD_X, ADD_P = "self.x[i] += [dx, dy, u[i, 2]]", "self.P = F @ self.P @ F.T + slips"
SLIP, EACH = "W @ np.diag(self.inflate * sigma**2) @ W.T", "for i, sigma in enumerate(self.noise.of_step(u)):"
D2 = "self.d2.append(nu @ np.linalg.solve(S, nu))"
GAIN, NEW_P, NEW_X = (
    "K = np.linalg.solve(S, H @ self.P).T",
    "self.P = self.P - K @ S @ K.T",
    "self.x = self.x + (K @ nu).reshape(-1, 3)",
)
BLOCKS = "H[:, here], H[:, there] = jacobians(self.x[i], self.x[j])"
FIRST, SLIPS = "self.x[0, :2] += turn @ u[0, :2]", "self.P[:2, :2] += turn @ np.diag(slips) @ turn.T"
S = "S = H @ self.P @ H.T + np.diag(sigma**2)"
PAPER_MISTAKES = [
    Mistake(
        "not-turned",
        "The step of robot 0 is added as it is: it is known in the robot's own frame, and has to be turned by its heading.",
        [(FIRST, "self.x[0, :2] += u[0, :2]")],
    ),
    Mistake(
        "nothing-turned",
        "Nothing is turned by the heading: step and noise are known in the robot's own frame, so Rot @ step and Rot Q Rot'.",
        [(FIRST, "self.x[0, :2] += u[0, :2]"), (SLIPS, "self.P[:2, :2] += np.diag(slips)")],
    ),
    Mistake(
        "heading-noise",
        "The heading of robot 0 gets noise: in the paper's filter only its position does.",
        [
            (
                SLIPS,
                "turn = np.array([[*turn[0], 0], [*turn[1], 0], [0, 0, 1]])\n        slips = self.inflate * self.noise.of_step(u[0]) ** 2\n        self.P[:3, :3] += turn @ np.diag(slips) @ turn.T",
            )
        ],
    ),
    Mistake(
        "turned-back",
        "The step is turned the wrong way: Rot has -sin at the upper right.",
        [
            (
                "[[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]]",
                "[[np.cos(theta), np.sin(theta)], [-np.sin(theta), np.cos(theta)]]",
            )
        ],
        [(FIRST, FIRST.replace("turn @", "turn.T @"))],
    ),
    Mistake(
        "heading-first",
        "The step is turned by the heading after it: take the heading before the step.",
        [("theta = self.x[0, 2]", "theta = self.x[0, 2] + u[0, 2]"), ("wrap(theta + u[0, 2])", "wrap(theta)")],
    ),
    Mistake(
        "heading-stays",
        "The heading of robot 0 stays as it was: add what it has turned.",
        [("        self.x[0, 2] = wrap(theta + u[0, 2])\n", "")],
    ),
    Mistake(
        "heading-not-wrapped",
        "The heading is outside (-pi, pi] after predict: wrap it.",
        [("wrap(theta + u[0, 2])", "theta + u[0, 2]")],
    ),
    Mistake(
        "others-move",
        "The others move too: in the paper's prediction only robot 0 does.",
        [(FIRST, "self.x[:, :2] += u[:, :2] @ turn.T")],
    ),
    Mistake(
        "q-not-turned",
        "Q is added as it is: along and across the way have to be turned by the heading, Rot Q Rot'.",
        [(SLIPS, "self.P[:2, :2] += np.diag(slips)")],
    ),
    Mistake(
        "q-turned-back",
        "Rot Q Rot' has its transpose in the wrong place.",
        [(SLIPS, "self.P[:2, :2] += turn.T @ np.diag(slips) @ turn")],
    ),
    Mistake("q-forgotten", "Q is missing in predict.", [(SLIPS, "pass")]),
    Mistake(
        "no-inflate",
        "`self.inflate` is not used: Q has it as a factor.",
        [("self.inflate * self.noise.of_step(u[0])[:2]", "self.noise.of_step(u[0])[:2]")],
    ),
    Mistake(
        "inflate-squared",
        "`self.inflate` is squared: it is a factor of the variances.",
        [("self.inflate * self.noise.of_step(u[0])[:2] ** 2", "(self.inflate * self.noise.of_step(u[0])[:2]) ** 2")],
    ),
    Mistake(
        "q-not-squared",
        "Q holds standard deviations: a covariance holds their squares.",
        [("self.noise.of_step(u[0])[:2] ** 2", "self.noise.of_step(u[0])[:2]")],
    ),
    Mistake(
        "of-metre",
        "Q is taken for a metre or for another robot's step: use `self.noise.of_step(u[0])`.",
        [("self.noise.of_step(u[0])[:2] ** 2", "np.array([self.noise.walk, self.noise.side]) ** 2")],
    ),
    Mistake(
        "rows",
        "The blocks of H stand in the wrong columns: robot i has 3 * i to 3 * i + 3.",
        [("slice(3 * i, 3 * i + 3), slice(3 * j, 3 * j + 3)", "slice(i, i + 3), slice(j, j + 3)")],
    ),
    Mistake(
        "observer-only",
        "H has only the observer's block: a reading depends on the target's pose as well.",
        [(BLOCKS, "H[:, here] = jacobians(self.x[i], self.x[j])[0]")],
    ),
    Mistake(
        "target-only",
        "H has only the target's block: a reading depends on the observer's pose as well.",
        [(BLOCKS, "H[:, there] = jacobians(self.x[i], self.x[j])[1]")],
    ),
    Mistake(
        "blocks-swapped",
        "The two blocks of H have changed places: i is the observer, j the target.",
        [(BLOCKS, "H[:, there], H[:, here] = jacobians(self.x[i], self.x[j])")],
    ),
    Mistake(
        "roles-swapped",
        "Observer and target are mixed up: in (i, j, z) robot i saw robot j.",
        [("for i, j, z in seen:", "for j, i, z in seen:")],
    ),
    Mistake("not-wrapped", "The bearing innovation is not wrapped.", [("            nu[1] = wrap(nu[1])\n", "")]),
    Mistake(
        "innovation-sign",
        "The correction points the wrong way: the innovation is z minus what is expected, and K nu is added.",
        [("nu = z - expected", "nu = expected - z")],
    ),
    Mistake(
        "r-not-squared",
        "R holds standard deviations: a covariance holds their squares.",
        [(S, S.replace("sigma**2", "sigma"))],
    ),
    Mistake(
        "r-order",
        "R is in the order (bearing, range): a reading is (range, bearing).",
        [(S, S.replace("sigma**2", "sigma[::-1] ** 2"))],
    ),
    Mistake(
        "no-gate",
        "There is no gate: readings with a d2 of self.gate or more are left out.",
        [("if self.d2[-1] < self.gate:", "if True:")],
    ),
    Mistake(
        "gate-fixed",
        "The gate lets too much through: compare d2 itself (not its root) with `self.gate` (not with 13.8).",
        [("if self.d2[-1] < self.gate:", "if self.d2[-1] < 13.8:")],
    ),
    Mistake(
        "d2-root",
        "`self.d2` holds the roots: it is nu' S^-1 nu, a square.",
        [(D2, "self.d2.append(np.sqrt(nu @ np.linalg.solve(S, nu)))")],
    ),
    Mistake(
        "h-swapped",
        "Observer and target have changed places in h: first the observer, h(self.x[i], self.x[j]).",
        [("expected = h(self.x[i], self.x[j])", "expected = h(self.x[j], self.x[i])")],
    ),
    Mistake(
        "stops-at-gate",
        "After a reading beyond the gate the update ends: leave out that reading only, and go on with the next.",
        [
            (
                "            if self.d2[-1] < self.gate:\n",
                "            if self.d2[-1] >= self.gate:\n                break\n            if True:\n",
            )
        ],
    ),
    Mistake(
        "heading-0-kept",
        "Robot 0's heading is left as it was: the update corrects all 3n numbers. (In a run its heading stays, for its variance is 0.)",
        [(NEW_X, NEW_X + " * (np.arange(self.x.size).reshape(-1, 3) != 2)")],
    ),
    Mistake(
        "update-not-wrapped",
        "A heading is outside (-pi, pi] after update: wrap the third column.",
        [
            (
                "                " + NEW_X + "\n                self.x[:, 2] = wrap(self.x[:, 2])\n",
                "                " + NEW_X + "\n",
            )
        ],
    ),
    Mistake(
        "d2-grows",
        "`self.d2` still holds those of the updates before: start each update with an empty list.",
        [("        self.d2 = []\n        for i, j", "        for i, j")],
    ),
    Mistake("p-not-updated", "`update` leaves the covariance as it was.", [(NEW_P, "pass")]),
    Mistake("x-not-corrected", "`update` leaves the poses as they were.", [(NEW_X, "pass")]),
    Mistake(
        "reshaped",
        "K nu is cut up the wrong way: robot i has three numbers in a row, so `.reshape(-1, 3)`.",
        [(NEW_X, "self.x = self.x + (K @ nu).reshape(3, -1).T")],
    ),
]
IN_PREDICT = [mistake.id for mistake in PAPER_MISTAKES[: [m.id for m in PAPER_MISTAKES].index("of-metre") + 1]]
IN_LOOP = ["no-gate", "gate-fixed", "stops-at-gate", "d2-grows"]
EKF_MISTAKES = [
    Mistake(
        "paper",
        "Only robot 0 moves: every robot has its own odometry, observers too.",
        [(EACH, "u = np.concatenate([u[:1], 0 * u[1:]])\n        " + EACH)],
    ),
    Mistake(
        "world-frame",
        "The steps are added as they are: each is in its robot's own frame, and has to be turned by its heading.",
        [("dx, dy, _ = W @ u[i]", "dx, dy, _ = u[i]")],
    ),
    Mistake(
        "turned-back",
        "The steps are turned the wrong way: delta is W u, and W has -sin at the upper right.",
        [("dx, dy, _ = W @ u[i]", "dx, dy, _ = W.T @ u[i]")],
    ),
    Mistake(
        "heading-of-0",
        "All steps are turned by robot 0's heading: each robot has its own.",
        [(COS, COS.replace("[i, 2]", "[0, 2]"))],
    ),
    Mistake(
        "without-0",
        "Robot 0 stays where it is: it moves as all others do.",
        [(EACH, EACH + "\n            if i == 0:\n                continue")],
    ),
    Mistake(
        "heading-first",
        "The step is turned by the heading after it: take the heading before the step.",
        [(COS, "cos, sin = np.cos(self.x[i, 2] + u[i, 2]), np.sin(self.x[i, 2] + u[i, 2])")],
    ),
    Mistake(
        "w-missing",
        "W is missing: along and across the way have to be turned by the heading, W Q W'.",
        [(SLIP, "np.diag(self.inflate * sigma**2)")],
    ),
    Mistake(
        "w-transposed",
        "W Q W' has its transpose in the wrong place.",
        [(SLIP, "W.T @ np.diag(self.inflate * sigma**2) @ W")],
    ),
    Mistake(
        "f-transposed", "F P F' has its transpose in the wrong place.", [(ADD_P, "self.P = F.T @ self.P @ F + slips")]
    ),
    Mistake(
        "blocks-only",
        "The covariances *between* robots are lost, or are not moved: F is one matrix (3n, 3n), and F P F' reaches all blocks of P.",
        [(ADD_P, "self.P = self.P * np.kron(np.eye(n), np.ones((3, 3)))\n        " + ADD_P)],
        [(ADD_P, "self.P = np.where(np.kron(np.eye(n), np.ones((3, 3))) > 0, F @ self.P @ F.T + slips, self.P)")],
    ),
    Mistake(
        "f-of-u",
        "F has the odometry in its last column: it is the step turned into the common frame, (-delta_y, delta_x).",
        [(F_BLOCK, "[[1, 0, -u[i, 1]], [0, 1, u[i, 0]], [0, 0, 1]]")],
    ),
    Mistake(
        "q-of-robot-0",
        "Every robot gets the noise of robot 0's step: use `self.noise.of_step(u[i])`.",
        [(SLIP, SLIP.replace("sigma**2", "self.noise.of_step(u[0]) ** 2"))],
    ),
    Mistake(
        "inflate-squared",
        "`self.inflate` is squared: it is a factor of the variances.",
        [(SLIP, SLIP.replace("self.inflate * sigma**2", "(self.inflate * sigma) ** 2"))],
    ),
    Mistake(
        "f-identity",
        "F is the identity (or missing): a heading that is off carries the position astray when the robot drives.",
        [(F_BLOCK, "np.eye(3)")],
    ),
    Mistake(
        "f-signs",
        "The last column of F is (-dy, dx): the derivative of a turned vector is the vector turned by 90 degrees.",
        [(F_BLOCK, "[[1, 0, dy], [0, 1, -dx], [0, 0, 1]]")],
        [(F_BLOCK, "[[1, 0, dx], [0, 1, dy], [0, 0, 1]]")],
    ),
    Mistake(
        "no-inflate",
        "`self.inflate` is not used: Q has it as a factor.",
        [(SLIP, SLIP.replace("self.inflate * sigma**2", "sigma**2"))],
    ),
    Mistake(
        "q-not-squared",
        "Q holds standard deviations: a covariance holds their squares.",
        [(SLIP, SLIP.replace("sigma**2", "sigma"))],
    ),
    Mistake("q-forgotten", "Q is missing in predict.", [(ADD_P, "self.P = F @ self.P @ F.T")]),
    Mistake("x-not-moved", "`predict` leaves the poses as they were.", [(ADD_X, "pass")]),
    Mistake(
        "heading-not-wrapped",
        "A heading is outside (-pi, pi] after predict: wrap the third column.",
        [("        self.x[:, 2] = wrap(self.x[:, 2])\n        " + ADD_P, "        " + ADD_P)],
    ),
]
SEQUENCE = """class PaperEKF(PaperEKF):
    def update(self, seen):
        self.d2, n = [], self.x.size
        for i, j, z in seen:
            nu = z - h(self.x[i], self.x[j])
            nu[1] = wrap(nu[1])
            H = np.zeros((2, n))
            H[:, 3 * i : 3 * i + 3], H[:, 3 * j : 3 * j + 3] = jacobians(self.x[i], self.x[j])
            R = np.diag([self.noise.range**2, self.noise.of_bearing(h(self.x[i], self.x[j])[0]) ** 2])
            S = H @ self.P @ H.T + R
            self.d2.append(float(nu @ np.linalg.inv(S) @ nu))
            if self.d2[-1] >= self.gate:
                continue
            K = self.P @ H.T @ np.linalg.inv(S)
            self.x = self.x + (K @ nu).reshape(n // 3, 3)
            self.x[:, 2] = wrap(self.x[:, 2])
            A = np.eye(n) - K @ H
            self.P = A @ self.P @ A.T + K @ R @ K.T
"""
SLICES = """class GroupEKF(GroupEKF):
    def predict(self, u):
        for i, ui in enumerate(u):
            a = slice(3 * i, 3 * i + 3)
            c, s = np.cos(self.x[i, 2]), np.sin(self.x[i, 2])
            W = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
            step = W @ ui
            F = np.eye(3)
            F[:2, 2] = -step[1], step[0]
            self.P[a] = F @ self.P[a]
            self.P[:, a] = self.P[:, a] @ F.T
            self.P[a, a] += W @ np.diag(self.inflate * self.noise.of_step(ui) ** 2) @ W.T
            self.x[i] += step
            self.x[i, 2] = wrap(self.x[i, 2])
"""


def team_probing(pairs, x0, P0, u):
    def made(x0, P0, factor, gate):
        noise = {
            name: value * factor if name in ("range", "bearing", "lateral") else value for name, value in NOISE.items()
        }
        return [{"x0": x0, "P0": P0, "noise": {"team.noise": noise}}, {"gate": gate}]

    return pose_probing(
        x0,
        P0,
        made,
        lambda x0, pair: seen_from(x0[pair[0]], x0[pair[1]]),
        lambda pair, z: ("team.readings", [*pair, *z], 2),
        ["x", "P"],
        u,
        pairs,
    )


PAIRS = [(1, 0), (2, 0), (1, 2), (0, 2)]
BEGIN = X0, np.array(P0) + 0.02 * np.diag(np.arange(9)), [U, [[-0.2, 0.15, -0.1], [0.1, 0.2, 0.25], [0.4, -0.1, 0.05]]]
# `GroupEKF` has the paper's update, and a `predict` of its own.
DIVIDED = Parts(GATED, drawn_poses(*BEGIN, lambda x0, P0, u: team_probing(PAIRS, x0, P0, u)))


CHECKS = [
    Check(
        "team-predict",
        LAB,
        "PaperEKF",
        "filter",
        PREDICT,
        [],
        [mistake for mistake in PAPER_MISTAKES if mistake.id in IN_PREDICT],
        team_probing((), *BEGIN),
    ),
    Check(
        "team-reading",
        LAB,
        "PaperEKF",
        "filter",
        READING,
        [Right("inverse", [(GAIN, "K = self.P @ H.T @ np.linalg.inv(S)")]), Right("joseph", SEQUENCE)],
        [mistake for mistake in PAPER_MISTAKES if mistake.id not in IN_PREDICT + IN_LOOP],
        team_probing(PAIRS, *BEGIN),
    ),
    Check(
        "team-paper",
        LAB,
        "PaperEKF",
        "filter",
        PAPER,
        [Right("inverse", [(GAIN, "K = self.P @ H.T @ np.linalg.inv(S)")]), Right("joseph", SEQUENCE)],
        [mistake for mistake in PAPER_MISTAKES if mistake.id in IN_LOOP],
        divided=DIVIDED,
    ),
    Check(
        "team-ekf",
        LAB,
        "GroupEKF",
        "filter",
        EKF,
        [Right("slices", SLICES)],
        EKF_MISTAKES,
        team_probing((), *BEGIN),
        divided=DIVIDED,
    ),
]
