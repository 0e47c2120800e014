"""Lab 3: the measurement function and its Jacobian."""

from labkit.instructor.authoring.spec import Check, Mistake, Right

from .inputs import X0

LAB = "03_range_bearing_ekf"
XY, RB = ["x", "y"], ["range", "bearing"]
# Seen from X0 = (0.4, -0.7): ahead, behind on the left, straight back (bearing 3.1), behind on the right, far, straight up.
MAP = [[0, 1.5, 2.0], [1, -2.2, 0.9], [2, -2.4, -0.6], [3, -0.5, -2.5], [4, 4.4, 1.3], [5, 0.4, 1.6]]

CENTRAL = """def jacobian(x, landmark, eps=1e-5):
    H = np.zeros((2, 2))
    for i in range(2):
        step = np.zeros(2)
        step[i] = eps
        d = h(x + step, landmark) - h(x - step, landmark)
        d[1] = wrap(d[1])
        H[:, i] = d / (2 * eps)
    return H
"""
FORWARD = """def jacobian(x, landmark):
    e = 1e-6
    columns = [np.array(h(x + d, landmark)) - h(x, landmark) for d in np.array([[e, 0], [0, e]])]
    return [[columns[0][0] / e, columns[1][0] / e], [columns[0][1] / e, columns[1][1] / e]]
"""
MATH = """import math
def h(x, landmark):
    dx, dy = landmark.p[0] - x[0], landmark.p[1] - x[1]
    return [math.sqrt(dx**2 + dy**2), math.atan2(dy, dx)]
"""

COMPLEX = """def h(x, landmark):
    z = complex(*(landmark.p - x))
    return abs(z), np.angle(z)
"""

H_LINES = "dx, dy = landmark - x\n    return np.array([np.hypot"
J_LINES = "dx, dy = landmark - x\n    r ="

H_MISTAKES = [
    Mistake(
        "arctan",
        "`arctan(dy / dx)` cannot tell ahead from behind: `arctan2(dy, dx)` looks at both signs.",
        [("np.arctan2(dy, dx)", "np.arctan(dy / dx)")],
    ),
    Mistake(
        "arctan-swapped",
        "The arguments of arctan2 are swapped: it takes dy first, then dx.",
        [("np.arctan2(dy, dx)", "np.arctan2(dx, dy)")],
    ),
    Mistake(
        "h-reversed",
        "dx and dy point from the landmark to the robot, so the bearing is half a turn off: they "
        "are landmark minus robot.",
        [(H_LINES, H_LINES.replace("landmark - x", "x - landmark"))],
    ),
    Mistake(
        "h-robot-forgotten",
        "Range and bearing are those of the landmark as seen from the origin: subtract the robot's position.",
        [(H_LINES, H_LINES.replace("landmark - x", "landmark.p"))],
    ),
    Mistake(
        "h-squared",
        "The square root is missing in the range: dx^2 + dy^2 is its square.",
        [("np.hypot(dx, dy), np.arctan2", "dx**2 + dy**2, np.arctan2")],
    ),
    Mistake(
        "h-city-block",
        "The range is the length of the straight line, sqrt(dx^2 + dy^2), not |dx| + |dy|.",
        [("np.hypot(dx, dy), np.arctan2", "abs(dx) + abs(dy), np.arctan2")],
    ),
    Mistake(
        "degrees",
        "The bearing is in degrees: it must be in radians, like the measurements.",
        [("np.arctan2(dy, dx)", "np.degrees(np.arctan2(dy, dx))")],
    ),
    Mistake(
        "bearing-first",
        "The order is (bearing, range): a measurement is (range, bearing).",
        [("np.hypot(dx, dy), np.arctan2(dy, dx)", "np.arctan2(dy, dx), np.hypot(dx, dy)")],
    ),
    Mistake(
        "bearing-negative",
        "The bearing has the other sign: angles count counter-clockwise, from the x axis to the y axis.",
        [("np.arctan2(dy, dx)", "-np.arctan2(dy, dx)")],
    ),
]

ROWS = "[[-dx / r, -dy / r], [dy / r**2, -dx / r**2]]"

JACOBIAN_MISTAKES = [
    Mistake(
        "jacobian-from-cartesian",
        "-I is lab 1's H: here the measurement is (range, bearing), and its derivative "
        "depends on where the landmark is.",
        [(f"np.array({ROWS})", "-np.eye(2)")],
    ),
    Mistake(
        "jacobian-sign",
        "All entries of the Jacobian have the wrong sign: it is the derivative by the robot's "
        "position, and the landmark's distance shrinks when the robot moves toward it.",
        [(ROWS, "[[dx / r, dy / r], [-dy / r**2, dx / r**2]]")],
    ),
    Mistake(
        "range-row-sign",
        "The range row of the Jacobian has the wrong sign: the range shrinks when the robot moves toward the landmark.",
        [("-dx / r, -dy / r", "dx / r, dy / r")],
    ),
    Mistake(
        "bearing-row-sign",
        "The bearing row of the Jacobian has the wrong sign: think of a landmark straight "
        "ahead (dx > 0, dy = 0) and a robot that moves up a little.",
        [("[dy / r**2, -dx / r**2]", "[-dy / r**2, dx / r**2]")],
    ),
    Mistake(
        "bearing-row-one-sign",
        "One entry of the bearing row has the wrong sign: check each with a small step of the robot.",
        [("-dx / r**2", "dx / r**2")],
        [("[dy / r**2", "[-dy / r**2")],
    ),
    Mistake(
        "bearing-row-r",
        "The bearing row of the Jacobian is divided by r: it must be divided by r squared.",
        [("dy / r**2, -dx / r**2", "dy / r, -dx / r")],
    ),
    Mistake(
        "range-row-undivided", "The range row of the Jacobian is not divided by r.", [("-dx / r, -dy / r", "-dx, -dy")]
    ),
    Mistake(
        "range-row-r2",
        "The range row of the Jacobian is divided by r squared: once is enough.",
        [("-dx / r, -dy / r", "-dx / r**2, -dy / r**2")],
    ),
    Mistake(
        "rows-swapped",
        "The rows of the Jacobian are swapped: first the range, then the bearing.",
        [(ROWS, "[[dy / r**2, -dx / r**2], [-dx / r, -dy / r]]")],
    ),
    Mistake(
        "columns-swapped",
        "The columns of the Jacobian are swapped: first the derivative by x, then by y.",
        [(ROWS, "[[-dy / r, -dx / r], [-dx / r**2, dy / r**2]]")],
    ),
    Mistake(
        "bearing-columns",
        "The two entries of the bearing row have changed places: the bearing's derivative "
        "by x holds dy, that by y holds dx.",
        [("dy / r**2, -dx / r**2", "-dx / r**2, dy / r**2")],
        [("dy / r**2, -dx / r**2", "dx / r**2, dy / r**2")],
    ),
    Mistake(
        "range-columns",
        "The two entries of the range row have changed places: the range's derivative by x holds "
        "dx, that by y holds dy.",
        [("-dx / r, -dy / r", "-dy / r, -dx / r")],
    ),
    Mistake(
        "jacobian-degrees",
        "The bearing row of the Jacobian is in degrees: it must be in radians, like the bearing.",
        [("[dy / r**2, -dx / r**2]", "np.degrees([dy / r**2, -dx / r**2])")],
    ),
    Mistake(
        "jacobian-transposed",
        "The Jacobian is transposed: a row for each of (range, bearing), a column for each of x and y.",
        [(f"np.array({ROWS})", f"np.array({ROWS}).T")],
    ),
    Mistake(
        "jacobian-at-landmark",
        "The Jacobian uses the landmark's place in the map: dx and dy are landmark minus robot.",
        [(J_LINES, "dx, dy = landmark.p\n    r =")],
    ),
    Mistake(
        "jacobian-at-robot",
        "The Jacobian uses the robot's position: dx and dy are landmark minus robot.",
        [(J_LINES, "dx, dy = x\n    r =")],
    ),
    Mistake(
        "jacobian-r-squared",
        "r in the Jacobian is dx^2 + dy^2: the square root is missing.",
        [("r = np.hypot(dx, dy)", "r = dx**2 + dy**2")],
    ),
]

PLACES = [
    ("ahead", "a landmark ahead and above", 0),
    ("left", "a landmark behind, to the left", 1),
    ("behind", "a landmark behind and below", 3),
    ("far", "a landmark far away", 4),
    ("up", "a landmark straight up", 5),
    ("other", "another robot, a landmark to the right", 3, [-1.6, -0.9]),
    ("elsewhere", "a robot elsewhere, a landmark to the left", 0, [2.3, 1.2]),
]


def places(name):
    def call(i, x=X0):
        return [name, x, {"landmark": MAP[i]}]

    return [{"id": id, "title": title, "look": [""], "calls": [call(*where)]} for id, title, *where in PLACES]


CHECKS = [
    Check(
        "range-bearing-h",
        LAB,
        "h",
        "function",
        places("h"),
        [
            Right("math", MATH),
            Right("complex", COMPLEX),
            Right("positive bearings", [("np.arctan2(dy, dx)", "np.arctan2(dy, dx) % (2 * np.pi)")], other=True),
        ],
        H_MISTAKES,
        parts={"": [RB]},
    ),
    Check(
        "range-bearing-jacobian",
        LAB,
        "jacobian",
        "function",
        places("jacobian"),
        [
            Right("central", CENTRAL),
            Right("forward", FORWARD),
            Right("float32", [("np.hypot(dx, dy)\n", "np.float32(np.hypot(dx, dy))\n")]),
        ],
        JACOBIAN_MISTAKES,
        parts={"": [RB, XY]},
    ),
]
