"""Lab 4: the functions around the filter."""

from labkit.instructor.authoring.spec import Check, Mistake, Right

LAB = "04_legged_robot"
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

ANGLES = [-3.1, -2.0, -0.9, -0.55, -0.3, 0.0, 0.25, 0.5, 0.7, 1.2, 2.9, 3.1]
MEMBERSHIP = [
    case("number", "a heading on the flank", [""], "membership", 0.75, 0.2, 0.3, 0.9, 0.8, 0.1),
    case("many", "many headings at once", [""], "membership", ANGLES, 0.2, 0.3, 0.9, 1.0, 0.1),
    case("across", "a trapezoid across 180 degrees", [""], "membership", ANGLES, 3.0, 0.4, 1.3, 0.7, 0.05),
    case("triangle", "no core at all: a triangle", [""], "membership", ANGLES, -0.4, 0.0, 0.8, 0.9, 0.2),
]
BODY = "return b + (h - b) * np.clip((s - away) / (s - c), 0, 1)"
MEMBERSHIP_MISTAKES = [
    Mistake(
        "not-wrapped",
        "The difference of the angles is not wrapped: 179 and -179 degrees are 2 degrees apart.",
        [("np.abs(wrap(phi - theta))", "np.abs(phi - theta)")],
    ),
    Mistake(
        "wrapped-last",
        "The absolute value is taken before the wrapping: wrap the difference, then take its absolute value.",
        [("np.abs(wrap(phi - theta))", "wrap(np.abs(phi - theta))")],
    ),
    Mistake(
        "degrees",
        "The angles are taken for degrees: all of them are in radians.",
        [("np.abs(wrap(phi - theta))", "np.rad2deg(np.abs(wrap(phi - theta)))")],
    ),
    Mistake(
        "no-abs",
        "The distance has lost its absolute value: the trapezoid falls off to both sides.",
        [("np.abs(wrap(phi - theta))", "wrap(phi - theta)")],
    ),
    Mistake(
        "no-bias",
        "The bias is missing: outside the support the value is b, not 0.",
        [(BODY, BODY.replace("b + (h - b)", "h"))],
    ),
    Mistake(
        "too-high",
        "The height is too large by the bias: the flank rises from b by h - b, to h.",
        [(BODY, BODY.replace("(h - b)", "h"))],
    ),
    Mistake(
        "no-clip",
        "Nothing is cut off: clip the ramp to [0, 1] before it is scaled.",
        [(BODY, "return b + (h - b) * (s - away) / (s - c)")],
    ),
    Mistake(
        "one-end",
        "The ramp is cut off at one end only: clip it at 0 and at 1.",
        [(BODY, BODY.replace("np.clip((s - away) / (s - c), 0, 1)", "np.minimum((s - away) / (s - c), 1)"))],
        [(BODY, BODY.replace("np.clip((s - away) / (s - c), 0, 1)", "np.maximum((s - away) / (s - c), 0)"))],
    ),
    Mistake(
        "triangle",
        "The core is not used: the value is h on all of it, and the flank is s - c wide.",
        [(BODY, BODY.replace("(s - c)", "s"))],
    ),
    Mistake(
        "reversed",
        "The ramp runs the wrong way: it is 1 at the core and 0 at the end of the support.",
        [(BODY, BODY.replace("(s - away) / (s - c)", "(away - c) / (s - c)"))],
    ),
    Mistake(
        "whole-widths",
        "c and s are taken for whole widths: they are *half* the core and *half* the support.",
        [(BODY, "return b + (h - b) * np.clip((s / 2 - away) / (s / 2 - c / 2), 0, 1)")],
    ),
]

GRID = [[1.0, 0.8, 0.6, 0.02], [0.5, 0.9, 0.3, 0.01], [0.01, 0.2, 1.0, 0.7]]
FAR = [[1.0, 1.3, 1.7, 2.2], [0.9, 1.25, 1.6, 2.1], [1.1, 1.4, 1.8, 2.25]]
FUSION = [
    case("one", "a grid of 3 x 4 cells", [""], "fuse_range", GRID, FAR, 1.5, 0.15, 0.1, 0.2, 0.08),
    case("bias", "another bias and a larger cell", [""], "fuse_range", GRID, FAR, 1.2, 0.15, 0.3, 0.05, 0.1),
    case("contradiction", "a range that fits no cell", [""], "fuse_range", GRID, FAR, 4.0, 0.1, 0.1, 0.2, 0.05),
]
E, S = "e = np.abs(distance - r)", "S = np.clip(1 - 0.9 * (e - (sigma + 0.3 * cell)) / (2 * sigma), b, 1)"
LAST = "return np.maximum(product / product.max(), floor)"
FUSION_MISTAKES = [
    Mistake(
        "no-abs",
        "The error has lost its absolute value: a cell that is too near fits as badly as one that is too far.",
        [(E, "e = distance - r")],
        [(E, "e = r - distance")],
    ),
    Mistake(
        "no-core",
        "The flat top is missing: up to sigma + 0.3 cell a cell stays fully possible.",
        [(S, S.replace("(e - (sigma + 0.3 * cell))", "e"))],
    ),
    Mistake(
        "cell-forgotten",
        "The size of the cell is missing in the flat top: sigma + 0.3 cell.",
        [(S, S.replace(" + 0.3 * cell", ""))],
    ),
    Mistake(
        "divided-by-two",
        "`/ 2 * sigma` divides by 2 and *multiplies* by sigma: write `/ (2 * sigma)`.",
        [(S, S.replace("/ (2 * sigma)", "/ 2 * sigma"))],
    ),
    Mistake(
        "brackets",
        "`e - sigma + 0.3 * cell` adds the cell's part: subtract both, `e - (sigma + 0.3 * cell)`.",
        [(S, S.replace("(e - (sigma + 0.3 * cell))", "(e - sigma + 0.3 * cell)"))],
    ),
    Mistake("no-factor", "The factor 0.9 is missing.", [(S, S.replace("0.9 * ", ""))]),
    Mistake("one-sigma", "The flank is 2 sigma wide.", [(S, S.replace("(2 * sigma)", "sigma"))]),
    Mistake(
        "no-bias",
        "S falls below the reliability b: a sighting may be false, so it may never rule a cell out.",
        [(S, S.replace("b, 1)", "0, 1)"))],
        [(S, S.replace("b, 1)", "None, 1)"))],
    ),
    Mistake("above-one", "S is above 1 where the cell fits well: it ends at 1.", [(S, S.replace("b, 1)", "b, None)"))]),
    Mistake(
        "minimum",
        "The smaller of the two is taken: to fuse is to multiply here. (The minimum is a classic too, but less accurate.)",
        [("product = possible * S", "product = np.minimum(possible, S)")],
    ),
    Mistake(
        "belief-forgotten",
        "What the grid believed before is lost: multiply it by S.",
        [("product = possible * S", "product = S")],
    ),
    Mistake(
        "added", "The two are added: to fuse is to multiply.", [("product = possible * S", "product = possible + S")]
    ),
    Mistake(
        "not-normalised",
        "The result is not divided by its largest value.",
        [(LAST, "return np.maximum(product, floor)")],
    ),
    Mistake(
        "sum-normalised",
        "The result is divided by its sum, as a probability would be: divide by the largest value.",
        [(LAST, "return np.maximum(product / product.sum(), floor)")],
    ),
    Mistake(
        "no-floor",
        "The floor is missing: a cell that falls to nothing could never come back.",
        [(LAST, "return product / product.max()")],
    ),
    Mistake(
        "floor-first",
        "The floor is applied before the division: it is the last step.",
        [(LAST, "product = np.maximum(product, floor)\n    return product / product.max()")],
    ),
]

NARROW, TALL = (
    [[0.01, 0.002, 0.0], [0.002, 0.02, 0.001], [0.0, 0.001, 0.03]],
    [[0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.04]],
)
SURE_XY = [[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 1.3]]
NEARLY = [[0.11, 0.05, 0.0], [0.05, 0.11, 0.0], [0.0, 0.0, 0.7]]


def spread_case(id, title, P, *limits):
    return case(id, title, ["lost?"], "lost_by_spread", P, *limits)


def diagonal(*variances):
    return [[v if i == j else 0.0 for j in range(3)] for i, v in enumerate(variances)]


SPREAD = [
    spread_case("sure", "a narrow covariance", NARROW),
    spread_case("position", "a wide position", TALL),
    spread_case("x", "wide in x only", diagonal(0.6, 0.01, 0.01)),
    spread_case("y", "wide in y only", diagonal(0.01, 0.6, 0.01)),
    spread_case("heading", "a wide heading", SURE_XY),
    spread_case("nearly", "wide, but not yet too wide", NEARLY),
    spread_case("nearly-xy", "a position that is not yet too wide", diagonal(0.11, 0.11, 0.001)),
    spread_case("limits", "other limits: 2 m and 2 rad", diagonal(3.0, 3.0, 0.01), 2.0, 2.0),
    spread_case("tiny", "a covariance that is very narrow", diagonal(0.01, 0.01, 1e-4)),
    spread_case("inside", "other limits, a narrow covariance", diagonal(1.5, 1.5, 3.0), 2.0, 2.0),
]
RULE = "return bool(np.sqrt(P[0, 0] + P[1, 1]) > position or np.sqrt(P[2, 2]) > heading)"
SPREAD_MISTAKES = [
    Mistake(
        "no-root",
        "The variances are compared with standard deviations: take the square root.",
        [(RULE, "return bool(P[0, 0] + P[1, 1] > position or P[2, 2] > heading)")],
    ),
    Mistake("and", "Both must be wide here: one of them is enough, so `or`.", [(RULE, RULE.replace(" or ", " and "))]),
    Mistake(
        "trace",
        "The heading's variance is added to those of the position: metres and radians do not add.",
        [(RULE, "return bool(np.sqrt(np.trace(P)) > position)")],
        [(RULE, "return bool(np.trace(P) > position)")],
    ),
    Mistake(
        "heading-forgotten",
        "The heading is not looked at.",
        [(RULE, "return bool(np.sqrt(P[0, 0] + P[1, 1]) > position)")],
    ),
    Mistake(
        "position-forgotten", "The position is not looked at.", [(RULE, "return bool(np.sqrt(P[2, 2]) > heading)")]
    ),
    Mistake(
        "reversed",
        "The comparison is the wrong way round: lost means that the spread is *above* the limit.",
        [(RULE, RULE.replace("return bool(", "return not ("))],
        [(RULE, RULE.replace(">", "<"))],
    ),
    Mistake(
        "fixed-limits",
        "`position` and `heading` are not used: 0.5 and 1.0 are only their defaults.",
        [(RULE, RULE.replace("> position", "> 0.5").replace("> heading", "> 1.0"))],
    ),
    Mistake(
        "largest",
        "The larger of the two standard deviations is taken: add the variances of x and y, then take the root.",
        [(RULE, "return bool(np.sqrt(max(P[0, 0], P[1, 1])) > position or np.sqrt(P[2, 2]) > heading)")],
    ),
    Mistake(
        "degrees",
        "The heading's spread is turned into degrees: P and the limit are in radians.",
        [(RULE, RULE.replace("np.sqrt(P[2, 2])", "np.rad2deg(np.sqrt(P[2, 2]))"))],
    ),
    Mistake(
        "x-only",
        "Only the variance of x is used: add that of y.",
        [(RULE, "return bool(np.sqrt(P[0, 0]) > position or np.sqrt(P[2, 2]) > heading)")],
    ),
    Mistake(
        "sum-of-sigmas",
        "The standard deviations are added: add the variances, then take the root.",
        [(RULE, "return bool(np.sqrt(P[0, 0]) + np.sqrt(P[1, 1]) > position or np.sqrt(P[2, 2]) > heading)")],
    ),
]


def lost_case(id, title, *calls):
    return {"id": id, "title": title, "look": ["lost?"], "calls": [["lost", *call] for call in calls]}


BAD, GOOD = 60.0, 1.5
LOST = [
    lost_case("calm", "no surprise, a narrow covariance", (NARROW, [GOOD] * 8), (NARROW, [GOOD, 3.0, 0.2])),
    lost_case("wide", "the paper's rule still counts", (TALL, [GOOD] * 8), (TALL, [])),
    lost_case("five", "five surprises among eight", (NARROW, [BAD, GOOD, BAD, BAD, GOOD, BAD, BAD, GOOD])),
    lost_case("four", "only four surprises among eight", (NARROW, [BAD, GOOD, BAD, BAD, GOOD, GOOD, BAD, GOOD])),
    lost_case("three", "three surprises in a row, at the end", (NARROW, [GOOD] * 5 + [22.0] * 3)),
    lost_case(
        "few",
        "fewer than eight sightings: seven surprises, then one, then none at all",
        (NARROW, [BAD] * 7),
        (NARROW, [BAD]),
        (NARROW, []),
    ),
    lost_case(
        "share",
        "another bound and another share",
        (NARROW, [20.0] * 8, 30.0),
        (NARROW, [20.0] * 8, 10.0),
        (NARROW, [BAD] * 4 + [GOOD] * 4, 13.8, 0.5),
    ),
]
SURPRISED = "surprised = len(d2) >= 8 and np.mean(np.asarray(d2) > bound) >= share"
EITHER = "return bool(lost_by_spread(P) or surprised)"
LOST_MISTAKES = [
    Mistake(
        "not-eight",
        "With fewer than eight sightings it decides already: one false alarm right after a switch would be enough.",
        [("len(d2) >= 8 and", "len(d2) > 0 and")],
    ),
    Mistake(
        "empty",
        "With no sightings yet the mean of nothing is asked for: wait until there are eight.",
        [("len(d2) >= 8 and np.mean(np.asarray(d2) > bound)", "sum(value > bound for value in d2) / len(d2)")],
    ),
    Mistake(
        "both", "Both rules must say so here: one is enough, so `or`.", [(EITHER, EITHER.replace(" or ", " and "))]
    ),
    Mistake(
        "paper-forgotten",
        "The paper's rule is lost: a covariance that is too wide still counts.",
        [(EITHER, "return bool(surprised)")],
    ),
    Mistake(
        "nis-forgotten",
        "Surprises never count: five among eight should be enough. Is it `len(d2) >= 8`, is d2 itself "
        "compared with bound, and is `surprised` used?",
        [(EITHER, "return lost_by_spread(P)")],
        [("len(d2) >= 8", "len(d2) > 8")],
    ),
    Mistake("more-than-share", "Exactly the share is enough: at least, so `>=`.", [(">= share", "> share")]),
    Mistake(
        "any",
        "One surprise is enough here: it may be a false alarm. Ask for the share, the number of surprises over that "
        "of the sightings.",
        [("np.mean(np.asarray(d2) > bound) >= share", "np.any(np.asarray(d2) > bound)")],
        [("np.mean(np.asarray(d2)", "np.sum(np.asarray(d2)")],
    ),
    Mistake(
        "all",
        "All eight have to be surprises here: after a kidnapping one may fit by chance. Ask for the share.",
        [("np.mean(np.asarray(d2) > bound) >= share", "np.all(np.asarray(d2) > bound)")],
    ),
    Mistake(
        "mean-of-d2",
        "The mean of d2 is compared with the bound: one huge value would be enough. Count the surprises instead.",
        [("np.mean(np.asarray(d2) > bound) >= share", "np.mean(d2) > bound")],
    ),
    Mistake(
        "below",
        "Sightings *below* the bound are counted: those are the honest ones.",
        [("np.asarray(d2) > bound", "np.asarray(d2) < bound")],
    ),
    Mistake(
        "fixed-bound",
        "bound and share are not used: the numbers 13.8 and 0.6 are only their defaults.",
        [("> bound) >= share", "> 13.8) >= 0.6")],
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
    ),
    Check(
        "legged-motion-jacobians",
        LAB,
        "motion_jacobians",
        "function",
        JACOBIANS,
        [Right("lists", [("return A, W", "return [A.tolist(), W.tolist()]")])],
        JACOBIANS_MISTAKES,
    ),
    Check(
        "legged-jacobian",
        LAB,
        "jacobian",
        "function",
        JACOBIAN,
        [Right("analytic", ANALYTIC), Right("larger step", [("step=1e-5", "step=1e-4")])],
        JACOBIAN_MISTAKES,
    ),
    Check(
        "legged-stack",
        LAB,
        "stack",
        "function",
        STACK,
        [Right("analytic", ANALYTIC), Right("lists", [("np.concatenate(nu),", "[v for pair in nu for v in pair],")])],
        STACK_MISTAKES,
    ),
    Check(
        "legged-membership",
        LAB,
        "membership",
        "function",
        MEMBERSHIP,
        [
            Right("interp", [(BODY, "return np.interp(away, [c, s], [h, b])")]),
            Right(
                "minimum",
                [
                    (
                        BODY,
                        BODY.replace(
                            "np.clip((s - away) / (s - c), 0, 1)", "np.maximum(0, np.minimum(1, (s - away) / (s - c)))"
                        ),
                    )
                ],
            ),
        ],
        MEMBERSHIP_MISTAKES,
    ),
    Check(
        "legged-fusion",
        LAB,
        "fuse_range",
        "function",
        FUSION,
        [
            Right(
                "where",
                [
                    (
                        S,
                        "S = 1 - 0.9 * (e - (sigma + 0.3 * cell)) / (2 * sigma)\n    S = np.where(S < b, b, np.where(S > 1, 1, S))",
                    )
                ],
            )
        ],
        FUSION_MISTAKES,
    ),
    Check(
        "legged-spread",
        LAB,
        "lost_by_spread",
        "function",
        SPREAD,
        [
            Right("plain", [(RULE, RULE.replace("bool(", "("))]),
            Right("hypot", [(RULE, "return P[0, 0] + P[1, 1] > position**2 or P[2, 2] > heading**2")]),
        ],
        SPREAD_MISTAKES,
    ),
    Check(
        "legged-lost",
        LAB,
        "lost",
        "function",
        LOST,
        [
            Right("loop", [(SURPRISED, "surprised = len(d2) == 8 and sum(v > bound for v in d2) / 8 >= share")]),
            Right("plain", [(EITHER, "return lost_by_spread(P) or surprised")]),
        ],
        LOST_MISTAKES,
    ),
]
