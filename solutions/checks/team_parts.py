"""Lab 6's functions: a mean of angles, two circles, what is expected of a pair of robots, and its derivatives."""

import numpy as np

from labkit.instructor.authoring.spec import Check, Mistake, Right

LAB = "06_observers"
POSE, RB = ["x", "y", "heading"], ["range", "bearing"]


def case(id, title, look, name, *args):
    return {"id": id, "title": title, "look": look, "calls": [[name, *args]]}


MEAN = [
    case("plain", "angles on one side", [""], "circular_mean", [0.1, 0.5, 2.6]),
    case("west", "angles on both sides of 180 degrees", [""], "circular_mean", [3.0, -3.1, 2.8, -2.9]),
    case("wide", "angles that are far apart", [""], "circular_mean", [0.2, 1.9, -1.1, 0.4]),
]
SUM = "np.arctan2(np.sum(np.sin(angles)), np.sum(np.cos(angles)))"
MEAN_MISTAKES = [
    Mistake(
        "arithmetic",
        "This is the arithmetic mean: between 179 and -179 degrees it gives 0. Add the vectors (cos, sin) and take "
        "the angle of the sum.",
        [(SUM, "np.mean(angles)")],
    ),
    Mistake(
        "wrapped-mean",
        "The arithmetic mean is wrapped, which does not help: add the vectors (cos, sin) first.",
        [(SUM, "wrap(np.sum(angles))")],
        [(SUM, "np.mean(angles % (2 * np.pi))")],
    ),
    Mistake(
        "swapped",
        "arctan2 takes the sine (y) first, then the cosine (x).",
        [(SUM, "np.arctan2(np.sum(np.cos(angles)), np.sum(np.sin(angles)))")],
    ),
    Mistake(
        "arctan",
        "arctan of the quotient cannot tell ahead from behind: use arctan2.",
        [(SUM, "np.arctan(np.sum(np.sin(angles)) / np.sum(np.cos(angles)))")],
    ),
    Mistake("degrees", "The result is in degrees: it must be in radians.", [(SUM, f"np.rad2deg({SUM})")]),
]

P1, P2 = [0.4, -0.3], [2.1, 0.5]


def seen(o, p):

    d = np.array(p) - o[:2]
    bearing = np.arctan2(d[1], d[0]) - o[2]
    return [float(np.hypot(*d)), float(np.pi - (np.pi - bearing) % (2 * np.pi))]


def circles(id, title, o, P1=P1, P2=P2, change=(0.0, 0.0), sigma=0.01):
    z1, z2 = seen(o, P1), seen(o, P2)
    z2 = [z2[0] + change[0], z2[1] + change[1]]
    return case(id, title, [""], "two_circles", P1, z1, P2, z2, sigma) | {"turns": [2]}


CIRCLES = [
    circles("left", "an observer to the left of the way", [0.2, 3.1, -2.3]),
    circles("right", "an observer to the right of the way", [2.9, -2.2, 2.4]),
    circles("behind", "headings on both sides of 180 degrees", [1.2, 3.0, -3.12], change=(0.0, 0.12), sigma=0.05),
    circles("bearings", "bearings on both sides of 180 degrees", [0.2, 3.1, 1.75]),
    circles("west", "directions on both sides of 180 degrees", [3.4, 0.2, 2.0], P1=[0.4, 1.2], P2=[0.6, -0.9]),
    circles("slight", "bearings that differ by 3.6 sigma", [0.2, 3.1, -2.3], sigma=0.16),
    circles("doubtful", "a bearing that is 3.6 sigma off", [0.2, 3.1, -2.3], change=(0.0, 0.18), sigma=0.05),
    circles("enough", "bearings that differ by 4.6 sigma", [0.2, 3.1, -2.3], sigma=0.124),
    circles("beyond", "a bearing that is 4.7 sigma off", [0.2, 3.1, -2.3], change=(0.0, 0.235), sigma=0.05),
    circles("noisy", "readings with a little noise", [0.2, 3.1, -2.3], change=(0.05, 0.1), sigma=0.05),
    circles("short", "a way of less than a metre", [0.2, 3.1, -2.3], P2=[1.0, 0.1]),
    circles("apart", "circles that do not meet", [0.2, 3.1, -2.3], change=(3.0, 0.0)),
    circles("straight", "bearings that hardly differ", [0.2, 3.1, -2.3], sigma=0.2),
    case(
        "between",
        "circles that nearly meet",
        [""],
        "two_circles",
        [0.0, 0.0],
        [0.97, 1.5],
        [2.0, 0.0],
        [0.98, -1.5],
        0.05,
    ),
    case(
        "alike",
        "bearings that hardly differ, on both sides of 180 degrees",
        [""],
        "two_circles",
        [0.0, 0.0],
        [6.0, 3.13],
        [1.2, 0.0],
        [7.19, -3.13],
        0.02,
    ),
    circles("false", "a bearing that does not fit", [0.2, 3.1, -2.3], change=(0.0, 0.2)),
]
TOO_NEAR = "if c2 <= 0 or abs(measured) <= 3 * np.sqrt(2) * sigma:"
GAP, HEADING = "abs(wrap(wrap(to[1] - to[0]) - measured))", "circular_mean(to - np.array([z1[1], z2[1]]))"
PAIR_END = "return np.array([o[0], o[1], heading]) if off <= 3 * np.sqrt(2) * sigma else UNKNOWN"
CIRCLES_MISTAKES = [
    Mistake(
        "no-baseline", "Two points less than 1 m apart tell too little: return UNKNOWN.", [("if b < 1:", "if False:")]
    ),
    Mistake(
        "no-left-right",
        "Bearings that differ by less than 3 sqrt(2) sigma cannot tell left from right: return UNKNOWN.",
        [
            ("if c2 <= 0 or abs(measured) <= 3 * np.sqrt(2) * sigma:", "if c2 <= 0:"),
            (
                PAIR_END,
                "return np.array([o[0], o[1], heading]) if off <= max(3 * np.sqrt(2) * sigma, 0.05) else UNKNOWN",
            ),
        ],
    ),
    Mistake(
        "no-last-gate",
        "Readings that contradict each other are believed: if the predicted difference is more than 3 sqrt(2) sigma off, "
        "return UNKNOWN.",
        [(PAIR_END, "return np.array([o[0], o[1], heading])")],
    ),
    Mistake(
        "other-side",
        "The wrong one of the two points is taken: the one whose predicted difference of bearings is closest to the "
        "measured one.",
        [
            (
                "off, o, heading = min(found, key=lambda one: one[0])",
                "off, o, heading = max(found, key=lambda one: one[0])\n    off = 0",
            )
        ],
    ),
    Mistake(
        "always-left",
        "Always the point to the left of the way is taken: the difference of the bearings tells which one it is.",
        [("off, o, heading = min(found, key=lambda one: one[0])", "off, o, heading = found[0]\n    off = 0")],
    ),
    Mistake(
        "always-right",
        "Always the point to the right of the way is taken: the difference of the bearings tells which one it is.",
        [("off, o, heading = min(found, key=lambda one: one[0])", "off, o, heading = found[1]\n    off = 0")],
    ),
    Mistake("c-squared", "c is the root of c^2.", [("np.sqrt(c2) * across", "c2 * across")]),
    Mistake(
        "a-sign",
        "The foot point is on the wrong side: a = (d1^2 - d2^2 + b^2) / (2 b).",
        [("z1[0] ** 2 - z2[0] ** 2 + b**2", "z2[0] ** 2 - z1[0] ** 2 + b**2")],
    ),
    Mistake(
        "a-halved",
        "UNKNOWN came back for a good pair: which of your four tests fired, and why?",
        [("/ (2 * b)", "/ 2 * b")],
    ),
    Mistake(
        "three-sigma",
        "The limit is 3 sqrt(2) sigma: a difference of two bearings has sqrt(2) times the noise of one.",
        [(TOO_NEAR, TOO_NEAR.replace("3 * np.sqrt(2)", "3"))],
        [(PAIR_END, PAIR_END.replace("3 * np.sqrt(2)", "3"))],
        [(TOO_NEAR, TOO_NEAR.replace("3 * np.sqrt(2)", "3")), (PAIR_END, PAIR_END.replace("3 * np.sqrt(2)", "3"))],
    ),
    Mistake(
        "predicted-not-wrapped",
        "The predicted difference is not wrapped: arctan2 jumps where the robot is due west of the observer.",
        [(GAP, "abs(to[1] - to[0] - measured)")],
    ),
    Mistake(
        "nothing-wrapped",
        "Differences of bearings are not wrapped, neither the measured one nor the predicted ones.",
        [("measured = wrap(z2[1] - z1[1])", "measured = z2[1] - z1[1]"), (GAP, "abs(to[1] - to[0] - measured)")],
    ),
    Mistake(
        "measured-not-wrapped",
        "The measured difference of the bearings is not wrapped: 3.13 and -3.13 hardly differ, and tell nothing.",
        [("measured = wrap(z2[1] - z1[1])", "measured = z2[1] - z1[1]")],
    ),
    Mistake(
        "clipped",
        "A pose comes back although the circles do not meet: where c^2 is not above 0, return UNKNOWN.",
        [(TOO_NEAR, TOO_NEAR.replace("c2 <= 0 or ", "")), ("np.sqrt(c2)", "np.sqrt(max(c2, 0))")],
    ),
    Mistake(
        "first-heading",
        "The heading comes from one of the two sightings only: average both with circular_mean.",
        [(HEADING, "wrap(to[0] - z1[1])")],
        [(HEADING, "wrap(to[1] - z2[1])")],
    ),
    Mistake(
        "arctan2-swapped",
        "arctan2 takes y first, then x.",
        [("[::-1]), np.arctan2(*(p2 - o)[::-1])", "), np.arctan2(*(p2 - o))")],
    ),
    Mistake(
        "heading-not-subtracted",
        "The heading is the direction to the robot *less* the bearing at which it is seen.",
        [("circular_mean(to - np.array([z1[1], z2[1]]))", "circular_mean(to)")],
    ),
    Mistake(
        "heading-added",
        "The bearing is added: the heading is the direction to the robot less the bearing at which it is seen.",
        [("circular_mean(to - np.array([z1[1], z2[1]]))", "circular_mean(to + np.array([z1[1], z2[1]]))")],
    ),
    Mistake(
        "heading-arithmetic",
        "The two headings are averaged arithmetically: use circular_mean.",
        [(HEADING, "np.mean(to - np.array([z1[1], z2[1]]))")],
        [(HEADING, "wrap(np.mean(wrap(to - np.array([z1[1], z2[1]]))))")],
        [(HEADING, "wrap(np.mean(to - np.array([z1[1], z2[1]])))")],
    ),
    Mistake(
        "from-robot",
        "The directions point from the robot to the observer: it is the observer that looks, so p - o.",
        [
            (
                "np.arctan2(*(p1 - o)[::-1]), np.arctan2(*(p2 - o)[::-1])",
                "np.arctan2(*(o - p1)[::-1]), np.arctan2(*(o - p2)[::-1])",
            )
        ],
    ),
]

POSES = [
    ("ahead", "a target ahead", [0.4, -0.7, 0.3], [2.1, 0.4, 1.0]),
    ("behind", "a target behind", [1.2, 0.5, -0.4], [-0.9, -1.1, 2.0]),
    ("left", "a target to the left", [-0.5, 0.2, 2.5], [-0.8, 2.9, -1.0]),
]
WEST = ("west", "a bearing across 180 degrees", [1.2, 0.5, 1.0], [-2.9, -0.9, 0.3])
H = [case(id, title, [""], "h", o, p) for id, title, o, p in [*POSES, WEST]]
SEEN_AT = "np.array([np.hypot(dx, dy), wrap(np.arctan2(dy, dx) - o[2])])"
H_MISTAKES = [
    Mistake(
        "no-heading",
        "The observer's heading is not subtracted: a bearing counts from where the observer looks.",
        [(SEEN_AT, "np.array([np.hypot(dx, dy), np.arctan2(dy, dx)])")],
    ),
    Mistake(
        "target-heading",
        "The target's heading is subtracted: a bearing counts from where the *observer* looks.",
        [(SEEN_AT, SEEN_AT.replace("o[2]", "p[2]"))],
    ),
    Mistake(
        "heading-added",
        "The observer's heading is added: turned left, it sees everything farther right.",
        [(SEEN_AT, SEEN_AT.replace("- o[2]", "+ o[2]"))],
    ),
    Mistake(
        "from-target",
        "The direction points from the target to the observer: it is the observer that looks, p - o.",
        [("dx, dy = p[:2] - o[:2]", "dx, dy = o[:2] - p[:2]")],
    ),
    Mistake(
        "roles",
        "Observer and target have changed places: o looks, and p is seen.",
        [("dx, dy = p[:2] - o[:2]", "o, p = p, o\n    dx, dy = p[:2] - o[:2]")],
    ),
    Mistake(
        "arctan",
        "arctan of the quotient cannot tell ahead from behind: use arctan2 (eq. 5 of the paper has it wrong).",
        [(SEEN_AT, SEEN_AT.replace("np.arctan2(dy, dx)", "np.arctan(dy / dx)"))],
    ),
    Mistake(
        "swapped",
        "arctan2 takes dy first, then dx.",
        [(SEEN_AT, SEEN_AT.replace("arctan2(dy, dx)", "arctan2(dx, dy)"))],
    ),
    Mistake("order", "The order is (range, bearing).", [(SEEN_AT, SEEN_AT + "[::-1]")]),
    Mistake(
        "not-wrapped",
        "The bearing is outside (-pi, pi]: wrap it.",
        [(SEEN_AT, "np.array([np.hypot(dx, dy), np.arctan2(dy, dx) - o[2]])")],
    ),
    Mistake(
        "squared",
        "The range is not the root of the sum of squares.",
        [(SEEN_AT, SEEN_AT.replace("np.hypot(dx, dy)", "dx**2 + dy**2"))],
    ),
]
JACOBIANS = [case(id, title, ["H_o", "H_p"], "jacobians", o, p) for id, title, o, p in POSES]
H_P, H_O = (
    "[[dx / rho, dy / rho, 0], [-dy / rho2, dx / rho2, 0]]",
    "[[-dx / rho, -dy / rho, 0], [dy / rho2, -dx / rho2, -1]]",
)
JACOBIANS_MISTAKES = [
    Mistake(
        "swapped",
        "The two results are swapped: first the observer's, then the target's.",
        [("return H_o, H_p", "return H_p, H_o")],
    ),
    Mistake(
        "same-sign",
        "H_o has the sign of H_p: when the observer comes nearer, the range shrinks.",
        [(H_O, "[[dx / rho, dy / rho, 0], [-dy / rho2, dx / rho2, -1]]")],
    ),
    Mistake(
        "no-heading",
        "The observer's heading is missing: when it turns left by an angle, the bearing falls by as much, so the last "
        "entry is -1.",
        [(H_O, H_O.replace("-1]", "0]"))],
    ),
    Mistake(
        "heading-sign",
        "The entry of the observer's heading is -1: turned left, it sees everything farther right.",
        [(H_O, H_O.replace("-1]", "1]"))],
    ),
    Mistake(
        "target-heading",
        "The target's heading is irrelevant: its column is 0.",
        [(H_P, H_P.replace("dx / rho2, 0]", "dx / rho2, -1]"))],
        [(H_P, H_P.replace("dx / rho2, 0]", "dx / rho2, 1]"))],
    ),
    Mistake(
        "one-array",
        "One array came back: return two, `return H_o, H_p`.",
        [("return H_o, H_p", "return np.hstack([H_o, H_p])")],
    ),
    Mistake(
        "r-for-q",
        "The bearing row is divided by the square of the range.",
        [("rho2 = dx**2 + dy**2\n    rho = np.sqrt(rho2)", "rho2 = np.hypot(dx, dy)\n    rho = rho2")],
    ),
    Mistake(
        "q-for-r",
        "The range row is divided by the range itself, not its square.",
        [("rho = np.sqrt(rho2)", "rho = rho2")],
    ),
    Mistake(
        "row-of-lab-3",
        "The signs are those of lab 3, where the robot moved: here H_p is of the target.",
        [(H_P, "[[-dx / rho, -dy / rho, 0], [dy / rho2, -dx / rho2, 0]]")],
        [
            (H_P, "[[-dx / rho, -dy / rho, 0], [dy / rho2, -dx / rho2, 0]]"),
            (H_O, "[[dx / rho, dy / rho, 0], [-dy / rho2, dx / rho2, -1]]"),
        ],
    ),
    Mistake(
        "bearing-sign",
        "The bearing row has the wrong sign: the derivative of atan2(dy, dx) by dx is -dy / rho2, by dy it is dx / rho2.",
        [
            (H_P, "[[dx / rho, dy / rho, 0], [dy / rho2, -dx / rho2, 0]]"),
            (H_O, "[[-dx / rho, -dy / rho, 0], [-dy / rho2, dx / rho2, -1]]"),
        ],
        [(H_P, "[[dx / rho, dy / rho, 0], [dy / rho2, -dx / rho2, 0]]")],
    ),
    Mistake(
        "bearing-columns",
        "The two entries of the bearing row have changed places: by x it holds dy, by y dx.",
        [(H_P, "[[dx / rho, dy / rho, 0], [dx / rho2, -dy / rho2, 0]]")],
        [(H_P, "[[dx / rho, dy / rho, 0], [dx / rho2, dy / rho2, 0]]")],
    ),
    Mistake(
        "transposed",
        "The Jacobians are transposed: (2, 3), a row for each of (range, bearing).",
        [("return H_o, H_p", "return H_o.T, H_p.T")],
    ),
]

CHECKS = [
    Check(
        "team-mean",
        LAB,
        "circular_mean",
        "function",
        MEAN,
        [
            Right("complex", [(SUM, "np.angle(np.sum(np.exp(1j * np.asarray(angles))))")]),
            Right("mean", [(SUM, SUM.replace("np.sum(", "np.mean("))]),
        ],
        MEAN_MISTAKES,
        parts={"": "angle"},
    ),
    Check(
        "team-circles",
        LAB,
        "two_circles",
        "function",
        CIRCLES,
        [
            Right("list", [(PAIR_END, PAIR_END.replace("np.array([o[0], o[1], heading])", "[*o, heading]"))]),
            Right("a turn on", [(PAIR_END, PAIR_END.replace("heading])", "heading + 2 * np.pi])"))]),
        ],
        CIRCLES_MISTAKES,
        parts={"": [POSE]},
    ),
    Check(
        "team-h",
        LAB,
        "h",
        "function",
        H,
        [Right("list", [(SEEN_AT, SEEN_AT.removeprefix("np.array(").removesuffix(")"))])],
        H_MISTAKES,
        parts={"": [RB]},
    ),
    Check(
        "team-jacobians",
        LAB,
        "jacobians",
        "function",
        JACOBIANS,
        [Right("lists", [("return H_o, H_p", "return H_o.tolist(), H_p.tolist()")])],
        JACOBIANS_MISTAKES,
        parts={"H_o": [RB, POSE], "H_p": [RB, POSE]},
    ),
]
