"""Lab 4: the functions around the filter."""

from labkit.instructor.authoring.spec import Check, Mistake, Right

LAB = "04_legged_robot"
POSE, RB = ["x", "y", "heading"], ["range", "bearing"]
FIELD = [
    ["yellow goal", -2.7, 0.0],
    ["blue goal", 2.7, 0.0],
    ["pink-yellow", -1.35, 1.9],
    ["yellow-pink", -1.35, -1.9],
    ["pink-blue", 1.35, 1.9],
    ["blue-pink", 1.35, -1.9],
]
NOISE = {
    "odometry": 0.2,
    "slip": 0.004,
    "spin": 0.006,
    "range_beacon": 0.06,
    "range_goal": 0.11,
    "range_floor": 0.03,
    "bearing": 0.035,
    "bearing_partial": 0.31,
}
POSES = [
    ("east", "a robot that faces east", [0.4, -0.7, 0.0]),
    ("up", "a robot that faces up and left", [-1.2, 0.5, 2.1]),
    ("back", "a robot that faces down", [0.8, 0.9, -1.3]),
]


def case(id, title, look, name, *args):
    return {"id": id, "title": title, "look": look, "calls": [[name, *args]]}


MOVE, LEAD = (
    "dx, dy = c * u[0] - s * u[1], s * u[0] + c * u[1]",
    "return np.array([x[0] + dx, x[1] + dy, wrap(x[2] + u[2])])",
)
TURN = "    c, s = np.cos(x[2]), np.sin(x[2])\n    " + MOVE
MOTION = [
    *(case(id, title, [""], "motion", pose, [0.3, -0.12, 0.2]) for id, title, pose in POSES),
    case("stand", "a robot that only turns", [""], "motion", [0.3, 0.2, 1.0], [0.0, 0.0, 0.5]),
    case("beyond", "a robot far from the middle, beyond the field", [""], "motion", [4.4, -3.9, 0.6], [0.6, 0.5, 0.6]),
    case("over", "a turn across 180 degrees", [""], "motion", [0.3, 0.2, 2.6], [0.5, 0.4, 0.8]),
]
MOTION_MISTAKES = [
    Mistake(
        "world-frame",
        "The odometry is added as it is: it is in the robot's own frame and has to be turned into the "
        "world by the heading first.",
        [(MOVE, "dx, dy = u[0], u[1]")],
    ),
    Mistake(
        "turned-back",
        "The odometry is turned the wrong way: from the robot's frame into the world, cos and sin stand "
        "as in eqs 3 and 4, with a minus before u[1] sin.",
        [(MOVE, "dx, dy = c * u[0] + s * u[1], -s * u[0] + c * u[1]")],
    ),
    Mistake(
        "sign-of-sideways",
        "The step to the left has the wrong sign in x: a robot that faces up and steps left goes toward smaller x.",
        [(MOVE, MOVE.replace("- s * u[1]", "+ s * u[1]"))],
    ),
    Mistake(
        "sin-for-cos",
        "sin and cos have changed places: a robot with heading 0 that walks ahead moves along x.",
        [(TURN, TURN.replace("c, s =", "s, c =", 1))],
    ),
    Mistake(
        "new-heading",
        "The step is turned by the *new* heading: eqs 3 and 4 use the heading before the turn.",
        [(TURN, TURN.replace("np.cos(x[2]), np.sin(x[2])", "np.cos(x[2] + u[2]), np.sin(x[2] + u[2])"))],
    ),
    Mistake(
        "half-turn",
        "The step is turned by the heading halfway through the turn. That would be a good idea too, but eqs 3 "
        "and 4 use the heading before the turn.",
        [(TURN, TURN.replace("np.cos(x[2]), np.sin(x[2])", "np.cos(x[2] + u[2] / 2), np.sin(x[2] + u[2] / 2)"))],
    ),
    Mistake(
        "not-wrapped",
        "The new heading is not wrapped: bring it into (-pi, pi] with `wrap`.",
        [(LEAD, LEAD.replace("wrap(x[2] + u[2])", "x[2] + u[2]"))],
    ),
    Mistake(
        "position-wrapped",
        "The whole pose is wrapped, metres included: only the heading is an angle.",
        [(LEAD, "return wrap(np.array([x[0] + dx, x[1] + dy, x[2] + u[2]]))")],
    ),
    Mistake(
        "ahead-only",
        "The step to the left (u[1]) is not used: a robot with legs can walk sideways.",
        [(MOVE, "dx, dy = c * u[0], s * u[0]")],
    ),
    Mistake(
        "heading-not-turned",
        "The heading stays as it was: add u[2].",
        [(LEAD, LEAD.replace("wrap(x[2] + u[2])", "x[2]"))],
    ),
    Mistake(
        "degrees",
        "The heading is taken for degrees: it is in radians, as cos and sin want it.",
        [(TURN, TURN.replace("np.cos(x[2]), np.sin(x[2])", "np.cos(np.deg2rad(x[2])), np.sin(np.deg2rad(x[2]))"))],
        [(TURN, TURN.replace("np.cos(x[2]), np.sin(x[2])", "np.cos(np.rad2deg(x[2])), np.sin(np.rad2deg(x[2]))"))],
    ),
    Mistake(
        "step-only",
        "Only the step comes back: add it to the old position.",
        [(LEAD, LEAD.replace("x[0] + ", "").replace("x[1] + ", ""))],
    ),
]

A_ROWS = "[1, 0, -s * u[0] - c * u[1]], [0, 1, c * u[0] - s * u[1]]"
W_ROWS = "W = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])"
JACOBIANS = [case(id, title, ["A", "W"], "motion_jacobians", pose, [0.3, -0.12, 0.2]) for id, title, pose in POSES]
JACOBIANS_MISTAKES = [
    Mistake(
        "a-identity",
        "A is the identity: the position does depend on the heading, so two entries of its last column "
        "are the derivatives by it.",
        [(A_ROWS, "[1, 0, 0], [0, 1, 0]")],
    ),
    Mistake(
        "a-no-identity",
        "The identity is missing in A: a pose that is off by 1 cm before the step is off by 1 cm after it.",
        [(A_ROWS, "[0, 0, -s * u[0] - c * u[1]], [0, 0, c * u[0] - s * u[1]]")],
    ),
    Mistake(
        "a-sign",
        "The entry of A for x and the heading has the wrong sign: the derivative of cos is -sin.",
        [("[1, 0, -s * u[0] - c * u[1]]", "[1, 0, s * u[0] - c * u[1]]")],
        [("[1, 0, -s * u[0] - c * u[1]]", "[1, 0, s * u[0] + c * u[1]]")],
        [("[1, 0, -s * u[0] - c * u[1]]", "[1, 0, -s * u[0] + c * u[1]]")],
    ),
    Mistake(
        "a-sign-y",
        "The entry of A for y and the heading has a wrong sign: the derivative of sin is cos, that of cos is -sin.",
        [("[0, 1, c * u[0] - s * u[1]]", "[0, 1, c * u[0] + s * u[1]]")],
        [("[0, 1, c * u[0] - s * u[1]]", "[0, 1, -c * u[0] - s * u[1]]")],
        [("[0, 1, c * u[0] - s * u[1]]", "[0, 1, -c * u[0] + s * u[1]]")],
    ),
    Mistake(
        "a-not-derived",
        "The last column of A holds the step itself: it must be the derivative of the step by the heading.",
        [(A_ROWS, "[1, 0, c * u[0] - s * u[1]], [0, 1, s * u[0] + c * u[1]]")],
    ),
    Mistake(
        "a-transposed",
        "A is transposed: a row for each of (x', y', heading'), a column for each of (x, y, heading).",
        [("return A, W", "return A.T, W")],
    ),
    Mistake(
        "w-identity",
        "W is the identity: the noise of the odometry sits in the robot's frame, so W turns it into the world.",
        [(W_ROWS, "W = np.eye(3)")],
    ),
    Mistake(
        "w-turned-back",
        "W turns the wrong way: its upper rows are those of eq. 10, cos, -sin and sin, cos.",
        [(W_ROWS, W_ROWS.replace("[c, -s, 0], [s, c, 0]", "[c, s, 0], [-s, c, 0]"))],
    ),
    Mistake(
        "w-times-u",
        "W is multiplied by the odometry: it is a rotation, whatever the step.",
        [(W_ROWS, W_ROWS + " * u")],
    ),
    Mistake(
        "w-no-heading",
        "The heading's noise is lost: the last entry of W is 1.",
        [(W_ROWS, W_ROWS.replace("[0, 0, 1]", "[0, 0, 0]"))],
    ),
    Mistake("swapped", "The two results are swapped: first A, then W.", [("return A, W", "return W, A")]),
    Mistake(
        "new-heading",
        "The Jacobians are taken at the heading *after* the turn: use the old one, x[2].",
        [("def motion_jacobians(x, u):\n", "def motion_jacobians(x, u):\n    x = x + np.array([0, 0, 1]) * u\n")],
    ),
]

CHANGE = "change = h(x + e, landmark) - h(x - e, landmark)"
DIVIDE = "H[:, j] = change / (2 * step)"
PLACES = [
    ("ahead", "a landmark ahead", [0.4, -0.7, 0.3], "blue goal"),
    ("left", "a landmark to the left", [0.8, -0.9, -0.4], "pink-yellow"),
    ("behind", "a landmark behind the robot", [0.5, 0.2, 0.3], "yellow-pink"),
    ("edge", "a landmark straight behind: its bearing is 180 degrees", [0.5, 0.0, 0.0], "yellow goal"),
]
AT = {name: [x, y] for name, x, y in FIELD}


def jacobian_case(id, title, pose, name):
    return case(id, title, [""], "jacobian", pose, {"landmark": [name, *AT[name]]})


JACOBIAN = [jacobian_case(*place) for place in PLACES]
JACOBIAN.append(
    case(
        "step",
        "another step, straight behind",
        [""],
        "jacobian",
        [0.5, 0.0, 0.0],
        {"landmark": ["yellow goal", *AT["yellow goal"]]},
        3e-3,
    )
)
ANALYTIC = """def jacobian(x, landmark, step=1e-5):
    dx, dy = landmark - x[:2]
    q = dx**2 + dy**2
    r = q**0.5
    return np.array([[-dx / r, -dy / r, 0], [dy / q, -dx / q, -1]])
"""
JACOBIAN_MISTAKES = [
    Mistake(
        "difference-not-wrapped",
        "The difference of two bearings is not wrapped: near 180 degrees the derivative becomes "
        "enormous. `wrap` it before you divide.",
        [("        change[1] = wrap(change[1])\n        H", "        H")],
    ),
    Mistake(
        "wrapped-after",
        "The quotient is wrapped instead of the difference of the two bearings: wrap first, then divide.",
        [
            (
                "        change[1] = wrap(change[1])\n        H[:, j] = change / (2 * step)",
                "        H[:, j] = change / (2 * step)\n        H[1, j] = wrap(H[1, j])",
            )
        ],
    ),
    Mistake(
        "half",
        "The result is twice too large: x + e and x - e are 2 steps apart.",
        [(DIVIDE, "H[:, j] = change / step")],
    ),
    Mistake(
        "no-brackets",
        "`/ 2 * step` divides by 2 and then multiplies by step: brackets keep them together, `/ (2 * step)`.",
        [(DIVIDE, "H[:, j] = change / 2 * step")],
    ),
    Mistake(
        "one-sided",
        "Forward and backward are mixed: h(x + e) - h(x) belongs to one step, h(x + e) - h(x - e) to two.",
        [(CHANGE, "change = h(x + e, landmark) - h(x, landmark)")],
    ),
    Mistake("not-divided", "The difference is not divided by the step.", [(DIVIDE, "H[:, j] = change")]),
    Mistake(
        "sign",
        "The sign is wrong: it is h(x + e) minus h(x - e).",
        [(CHANGE, "change = h(x - e, landmark) - h(x + e, landmark)")],
    ),
    Mistake(
        "all-at-once",
        "All components move at once, so every column is the same: only component j may move (eq. 18 leaves "
        "that open, but means it).",
        [("e = np.zeros(3)\n        e[j] = step", "e = np.full(3, step)")],
    ),
    Mistake(
        "not-reset",
        "The components that moved before stay moved: make a new e for each j.",
        [
            (
                "    for j in range(3):\n        e = np.zeros(3)\n        e[j]",
                "    e = np.zeros(3)\n    for j in range(3):\n        e[j]",
            )
        ],
    ),
    Mistake(
        "no-heading",
        "The column of the heading is missing or 0: the bearing changes when the robot turns.",
        [("    return H\n", "    H[:, 2] = 0\n    return H\n")],
        [("    return H\n", "    return H[:, :2]\n")],
    ),
    Mistake(
        "transposed",
        "The Jacobian is transposed: a row for each of (range, bearing), a column for each of (x, y, heading).",
        [("    return H\n", "    return H.T\n")],
    ),
    Mistake(
        "degrees",
        "The bearing row is in degrees: it must be in radians, like the bearing.",
        [("    return H\n", "    H[1] = np.rad2deg(H[1])\n    return H\n")],
    ),
]

Y = [
    ["blue-pink", 1.62, -0.94, True],
    ["yellow goal", 3.4, 2.75, True],
    ["pink-blue", 2.9, 0.93, False],
    ["blue goal", 2.2, 0.1, False],
    ["yellow goal", 3.3, 3.12, True],
    ["blue goal", 6.1, 0.1, True],
]


def stack_case(id, title, which, pose=(0.4, -0.7, 0.15)):
    return case(
        id,
        title,
        ["nu", "H", "R"],
        "stack",
        {"legged.sightings": [Y[i] for i in which]},
        {"legged.map": FIELD},
        list(pose),
        {"legged.noise": NOISE},
    )


STACK = [
    stack_case("beacon", "one beacon", [0]),
    stack_case("partial", "a beacon that is only partly in view", [2]),
    stack_case("goal", "a goal, wholly in view", [1]),
    stack_case("many", "four landmarks, in another order than on the map", [2, 0, 3, 1]),
    stack_case("edge", "a bearing across 180 degrees", [4], (0.4, 0.3, 0.05)),
    stack_case("far", "a range that is more than 3.2 m off", [5]),
]
RANGE = "sigmas.append(noise.of_range(lm) * expected[0] + noise.range_floor)"
BEARING = "sigmas.append(noise.bearing if lm.complete else noise.bearing_partial)"
NU, OFF = "nu.append([off[0], wrap(off[1])])", "off = lm.p - expected"
STACK_RETURN = "return np.concatenate(nu), np.vstack(H), np.diag(np.square(sigmas))"
KNOWN = "known = m[m.index(lm)]"
STACK_MISTAKES = [
    Mistake(
        "innovation-not-wrapped",
        "The bearing innovation is not wrapped: bring it into (-pi, pi].",
        [(NU, "nu.append(off)")],
    ),
    Mistake(
        "metres-wrapped",
        "The whole innovation is wrapped, metres included: only the bearing is an angle.",
        [(NU, "nu.append(wrap(off))")],
    ),
    Mistake(
        "innovation-sign",
        "The innovation has the wrong sign: what was seen minus what is expected.",
        [(OFF, "off = expected - lm.p")],
    ),
    Mistake(
        "not-squared",
        "R holds standard deviations: a covariance holds their squares.",
        [("np.diag(np.square(sigmas))", "np.diag(sigmas)")],
    ),
    Mistake(
        "goal-as-beacon",
        "A goal's range is given a beacon's noise: `noise.of_range(lm)` knows the difference.",
        [("noise.of_range(lm) *", "noise.range_beacon *")],
    ),
    Mistake(
        "beacon-as-goal",
        "A beacon's range is given a goal's noise: `noise.of_range(lm)` knows the difference.",
        [("noise.of_range(lm) *", "noise.range_goal *")],
    ),
    Mistake(
        "not-times-range",
        "The fraction is not multiplied by the range: the noise of a range grows with it.",
        [("noise.of_range(lm) * expected[0]", "noise.of_range(lm)")],
    ),
    Mistake(
        "measured-range",
        "The noise is computed from the *measured* range: a range that came out too short would be trusted "
        "more than one that came out too long. Use the expected one.",
        [("noise.of_range(lm) * expected[0]", "noise.of_range(lm) * lm.p[0]")],
    ),
    Mistake(
        "floor-forgotten",
        "`noise.range_floor` is missing in the standard deviation of the range.",
        [(RANGE, RANGE.replace(" + noise.range_floor", ""))],
    ),
    Mistake(
        "floor-of-variance",
        "Standard deviations are added before squaring here: sigma = fraction * range + floor.",
        [(RANGE, "sigmas.append(np.hypot(noise.of_range(lm) * expected[0], noise.range_floor))")],
    ),
    Mistake(
        "never-partial",
        "A landmark that is only partly in view gets the noise of a complete one: look at `lm.complete`.",
        [(BEARING, "sigmas.append(noise.bearing)")],
    ),
    Mistake(
        "partial-reversed",
        "Complete and partial are swapped: a landmark that is wholly in view has the small bearing noise.",
        [("if lm.complete", "if not lm.complete")],
    ),
    Mistake(
        "always-partial",
        "Every bearing gets the noise of a landmark that is cut off: `lm.complete` is True for the others.",
        [(BEARING, "sigmas.append(noise.bearing_partial)")],
        [("if lm.complete", "if known.complete == 2")],
    ),
    Mistake(
        "bearing-degrees",
        "The bearing's noise is turned into degrees: everything stays in radians.",
        [(BEARING, "sigmas.append(np.rad2deg(noise.bearing if lm.complete else noise.bearing_partial))")],
    ),
    Mistake(
        "order",
        "R is in the order (bearing, range): a measurement is (range, bearing).",
        [(f"{RANGE}\n        {BEARING}", f"{BEARING}\n        {RANGE}")],
    ),
    Mistake(
        "from-sighting",
        "What is expected is computed from the sighting itself: find the landmark on the map.",
        [(KNOWN, "known = lm")],
    ),
    Mistake(
        "jacobian-of-sighting",
        "The Jacobian is computed from the sighting itself: it wants the landmark's place on the map, as h does.",
        [("H.append(jacobian(x, known))", "H.append(jacobian(x, lm))")],
    ),
    Mistake(
        "by-place",
        "The j-th sighting is taken for the j-th landmark of the map: find it with `m.index(lm)`.",
        [(KNOWN, "known = m[len(nu)]")],
    ),
    Mistake(
        "all-ranges-first",
        "All ranges come first, then all bearings: keep the two of one landmark side by side.",
        [("return np.concatenate(nu),", "return np.array(nu).T.ravel(),")],
    ),
    Mistake(
        "not-flat",
        "nu is a table (m, 2): make it one long vector (2m,).",
        [("return np.concatenate(nu),", "return np.array(nu),")],
    ),
    Mistake(
        "r-vector",
        "R is a vector: put it on the diagonal of a matrix, as `diag` does.",
        [("np.diag(np.square(sigmas))", "np.square(sigmas)")],
    ),
    Mistake(
        "h-beside",
        "The Jacobians stand side by side: they belong below one another, (2m, 3).",
        [("np.vstack(H)", "np.hstack(H)")],
    ),
    Mistake(
        "one-only",
        "Only the last sighting comes back: collect them in lists.",
        [(STACK_RETURN, "return np.array(nu[-1]), H[-1], np.diag(np.square(sigmas[-2:]))")],
    ),
]

SMALL = [[0.0025, 0.0005, 0.0002], [0.0005, 0.0015, -0.0003], [0.0002, -0.0003, 0.001]]
STEP = [0.3, -0.12, 0.2]


def predicted_case(id, title, x, u):
    noise = {"legged.noise": {**NOISE, "slip": 0.02, "spin": 0.04}}
    return case(id, title, ["pose", "P"], "predicted", x, SMALL, u, noise)


PREDICTED = [
    *(predicted_case(id, title, pose, STEP) for id, title, pose in POSES),
    predicted_case("stand", "a robot that stands: it may still slip", [0.4, -0.7, 0.15], [0.0, 0.0, 0.0]),
    predicted_case("backward", "a step backward", [0.4, -0.7, 2.6], [-0.1, 0.2, -0.3]),
    predicted_case("over", "a turn across 180 degrees", [0.4, -0.7, 3.05], STEP),
]
FLOOR = "floor = np.array([noise.slip, noise.slip, noise.spin])"
Q = "Q = np.diag((noise.odometry * np.abs(u) + floor) ** 2)"
JAC, MOVED = "A, W = motion_jacobians(x, u)", "return motion(x, u), A @ P @ A.T + W @ Q @ W.T"
PREDICTED_MISTAKES = [
    Mistake(
        "moved-first",
        "The Jacobians are those of the pose *after* the step: compute A and W before you move.",
        [(JAC, "A, W = motion_jacobians(motion(x, u), u)")],
    ),
    Mistake(
        "q-not-turned",
        "Q is added as it is (or W is the identity): it is in the robot's frame, and W Q W' turns it into the world.",
        [(MOVED, MOVED.replace("W @ Q @ W.T", "Q"))],
    ),
    Mistake("w-one-side", "W stands on one side only: W Q W'.", [(MOVED, MOVED.replace("W @ Q @ W.T", "W @ Q"))]),
    Mistake(
        "w-transposed",
        "This is W' Q W (or W is transposed): it is W Q W'.",
        [(MOVED, MOVED.replace("W @ Q @ W.T", "W.T @ Q @ W"))],
    ),
    Mistake(
        "noise-subtracted",
        "The noise of the step is subtracted: a step makes the pose less certain, so W Q W' is added.",
        [(MOVED, MOVED.replace("+ W @ Q", "- W @ Q"))],
    ),
    Mistake(
        "p-without-a",
        "P is not carried along by A (or A is the identity): A P A' + W Q W'. An error of the heading becomes one of the position when "
        "the robot walks.",
        [(MOVED, MOVED.replace("A @ P @ A.T", "P"))],
    ),
    Mistake("a-one-side", "A stands on one side only: A P A'.", [(MOVED, MOVED.replace("A @ P @ A.T", "A @ P"))]),
    Mistake(
        "a-transposed",
        "This is A' P A (or A is transposed): it is A P A'.",
        [(MOVED, MOVED.replace("A @ P @ A.T", "A.T @ P @ A"))],
    ),
    Mistake(
        "q-forgotten",
        "Q is missing in predict: without it the filter becomes surer than it can be.",
        [(MOVED, MOVED.replace(" + W @ Q @ W.T", ""))],
    ),
    Mistake(
        "q-not-squared", "Q holds standard deviations: a covariance holds their squares.", [(Q, Q.replace(" ** 2", ""))]
    ),
    Mistake(
        "q-of-paper",
        "This is the paper's Q, linear in |u|: a variance is the *square* of noise.odometry |u| + floor.",
        [(Q, "Q = np.diag(noise.odometry * np.abs(u))")],
    ),
    Mistake(
        "no-floor",
        "The floor is missing: a robot that stands, or walks straight ahead, still slips a little in every direction.",
        [(Q, Q.replace(" + floor", ""))],
    ),
    Mistake(
        "floor-of-variance",
        "The standard deviations are added before they are squared: (noise.odometry |u| + floor)^2.",
        [(Q, "Q = np.diag((noise.odometry * u) ** 2 + floor**2)")],
    ),
    Mistake(
        "no-abs",
        "The odometry's sign is kept: a step backward has noise as well, so use |u|.",
        [(Q, Q.replace("np.abs(u)", "u"))],
    ),
    Mistake(
        "slip-and-spin",
        "slip and spin are mixed up: slip is of the position (ahead and to the left), spin of the heading.",
        [(FLOOR, "floor = np.array([noise.slip, noise.spin, noise.spin])")],
        [(FLOOR, "floor = np.array([noise.spin, noise.spin, noise.slip])")],
        [(FLOOR, "floor = np.array([noise.slip, noise.slip, noise.slip])")],
        [(FLOOR, "floor = np.array([noise.spin, noise.spin, noise.spin])")],
        [(FLOOR, "floor = np.array([noise.spin, noise.slip, noise.slip])")],
    ),
    Mistake(
        "x-not-moved",
        "The pose comes back as it was: `motion` moves it.",
        [(MOVED, MOVED.replace("motion(x, u)", "x"))],
    ),
    Mistake("p-not-predicted", "The covariance comes back as it was.", [(MOVED, "return motion(x, u), P")]),
    Mistake(
        "swapped",
        "The two results are swapped: first the pose, then its covariance.",
        [(MOVED, "return " + ", ".join(MOVED[7:].rsplit(", ", 1)[::-1]))],
    ),
]

CHECKS = [
    Check(
        "legged-motion",
        LAB,
        "motion",
        "function",
        MOTION,
        [
            Right(
                "matrix",
                [
                    (
                        LEAD,
                        "return np.append(x[:2] + np.array([[c, -s], [s, c]]) @ u[:2], np.arctan2(np.sin(x[2] + u[2]), np.cos(x[2] + u[2])))",
                    )
                ],
            ),
            Right("list", [(LEAD, LEAD.replace("np.array(", "list("))]),
        ],
        MOTION_MISTAKES,
        parts={"": [POSE]},
    ),
    Check(
        "legged-motion-jacobians",
        LAB,
        "motion_jacobians",
        "function",
        JACOBIANS,
        [Right("lists", [("return A, W", "return [A.tolist(), W.tolist()]")])],
        JACOBIANS_MISTAKES,
        parts={"A": [POSE, POSE], "W": [POSE, ["ahead", "left", "turn"]]},
    ),
    Check(
        "legged-jacobian",
        LAB,
        "jacobian",
        "function",
        JACOBIAN,
        [Right("analytic", ANALYTIC), Right("larger step", [("step=1e-5", "step=1e-4")])],
        JACOBIAN_MISTAKES,
        parts={"": [RB, POSE]},
    ),
    Check(
        "legged-stack",
        LAB,
        "stack",
        "function",
        STACK,
        [Right("analytic", ANALYTIC), Right("lists", [("np.concatenate(nu),", "[v for pair in nu for v in pair],")])],
        STACK_MISTAKES,
        parts={"nu": [RB], "H": [RB, POSE], "R": [RB, RB]},
    ),
    Check(
        "legged-predicted",
        LAB,
        "predicted",
        "function",
        PREDICTED,
        [
            Right("noise turned first", [(MOVED, "return motion(x, u), A @ P @ A.T + (W * np.diag(Q)) @ W.T")]),
            Right("list", [(MOVED, MOVED.replace("return ", "return [") + "]")]),
        ],
        PREDICTED_MISTAKES,
        parts={"x": [POSE], "P": [POSE, POSE]},
    ),
]
