"""Labs 6 to 8: observers, a common frame, a formation, and converted measurements."""

import numpy as np

from labkit.instructor.authoring.spec import Check, Mistake, Parts, Right

from .probes import GATED, drawn_poses, pose_probing, seen_from

LAB, FORMATION, FURTHER = "06_observers", "07_formation", "08_further"
XY, POSE, RB = ["x", "y"], ["x", "y", "heading"], ["range", "bearing"]


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
    import numpy as np

    d = np.array(p) - o[:2]
    bearing = np.arctan2(d[1], d[0]) - o[2]
    return [float(np.hypot(*d)), float(np.pi - (np.pi - bearing) % (2 * np.pi))]


def circles(id, title, o, P1=P1, P2=P2, change=(0.0, 0.0), sigma=0.01):
    z1, z2 = seen(o, P1), seen(o, P2)
    z2 = [z2[0] + change[0], z2[1] + change[1]]
    return case(id, title, [""], "two_circles", P1, z1, P2, z2, sigma)


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
    Mistake(
        "a-sign",
        "The foot point is on the wrong side: a = (d1^2 - d2^2 + b^2) / (2 b).",
        [("z1[0] ** 2 - z2[0] ** 2 + b**2", "z2[0] ** 2 - z1[0] ** 2 + b**2")],
    ),
    Mistake(
        "a-halved",
        "UNKNOWN came back for a good pair: which of your four tests fired, and why? (a is divided by all of 2 b.)",
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

CONVERTED = [
    case("coarse", "a coarse sensor", [""], "converted", 4.0, 0.7, 0.4),
    case("behind", "a bearing to the back", [""], "converted", 2.5, -2.4, 0.6),
]
POINT = "d * np.array([np.cos(alpha), np.sin(alpha)]) / np.exp(-(sigma**2) / 2)"
CONVERTED_MISTAKES = [
    Mistake(
        "raw",
        "Nothing is debiased: divide by exp(-sigma^2 / 2).",
        [(POINT, "d * np.array([np.cos(alpha), np.sin(alpha)])")],
    ),
    Mistake(
        "additive",
        "This is the additive way, which is nearly right: divide by exp(-sigma^2 / 2).",
        [
            (
                POINT,
                "(d + d * (np.exp(-(sigma**2) / 2) - np.exp(-(sigma**2)))) * np.array([np.cos(alpha), np.sin(alpha)])",
            )
        ],
    ),
    Mistake(
        "multiplied",
        "Multiplied instead of divided: the mean of the points is too near, so each must move outward.",
        [(POINT, POINT.replace("/ np.exp", "* np.exp"))],
    ),
    Mistake("no-half", "The exponent is sigma^2 / 2.", [(POINT, POINT.replace("(sigma**2) / 2", "(sigma**2)"))]),
    Mistake(
        "sigma-not-squared",
        "The exponent is sigma *squared* / 2.",
        [(POINT, POINT.replace("(sigma**2) / 2", "sigma / 2"))],
    ),
    Mistake(
        "swapped",
        "cos and sin have changed places: x is ahead.",
        [(POINT, POINT.replace("[np.cos(alpha), np.sin(alpha)]", "[np.sin(alpha), np.cos(alpha)]"))],
    ),
]

ME, SLOT, V = [0.2, -0.4], [1.0, 0.3], [0.2, 0.05]
FORCE = [
    case("alone", "nobody near", [""], "force", ME, SLOT, V, [[2.0, 1.0], [-1.5, 1.0]]),
    case("near", "one robot near", [""], "force", ME, SLOT, V, [[0.5, 0.1], [2.0, 1.0]]),
    case("two", "two robots near", [""], "force", ME, SLOT, V, [[0.5, 0.1], [-0.3, -0.6]]),
    case("told", "other constants", [""], "force", ME, SLOT, V, [[0.5, 0.1], [-0.3, -0.6]], 1.5, 0.2, 1.0),
    case("edge", "a robot just outside rho_0", [""], "force", ME, SLOT, V, [[1.95, -0.4]]),
]
PUSH = "F = F + k_r * (1 / rho - 1 / rho_0) / rho**2 * (me - other) / rho"
FORCE_MISTAKES = [
    Mistake(
        "attracts",
        "The others attract: e points from the other robot to me, me - other.",
        [("* (me - other) / rho", "* (other - me) / rho")],
    ),
    Mistake("away-from-slot", "The slot repels: slot - me.", [("k_a * (slot - me)", "k_a * (me - slot)")]),
    Mistake(
        "no-velocity",
        "The slot's velocity is missing: without it the follower lags behind.",
        [("F = velocity + k_a", "F = k_a")],
    ),
    Mistake(
        "no-limit",
        "Robots beyond rho_0 act too, and attract: only those nearer than rho_0 count.",
        [("if rho < rho_0:", "if True:")],
    ),
    Mistake(
        "n-not-unit",
        "A power of rho is missing: e is a unit vector, (me - other) / rho, and the push is divided by rho squared besides.",
        [(PUSH, PUSH.removesuffix(" / rho"))],
    ),
    Mistake(
        "no-square",
        "The push is divided by rho squared, apart from the rho of n.",
        [(PUSH, PUSH.replace(" / rho**2", ""))],
    ),
    Mistake("no-push", "The others do not push at all: add the sum over those nearer than rho_0.", [(PUSH, "pass")]),
    Mistake(
        "each-its-own",
        "The slot's pull is added once for each of the others: only the pushes are summed up.",
        [(PUSH, PUSH + " + k_a * (slot - me)")],
    ),
    Mistake(
        "no-difference",
        "The push is (1/rho - 1/rho_0), so that it begins at rho_0 without a jump.",
        [(PUSH, PUSH.replace("(1 / rho - 1 / rho_0)", "1 / rho"))],
    ),
    Mistake(
        "last-only",
        "Only one of the others pushes: add up their forces.",
        [(PUSH, PUSH.replace("F = F +", "F = velocity + k_a * (slot - me) +"))],
    ),
    Mistake(
        "fixed",
        "The constants are written into the formula: use k_a, k_r and rho_0, which may be given.",
        [("k_a * (slot - me)", "0.9 * (slot - me)")],
        [("F = F + k_r *", "F = F + 0.5 *")],
        [("if rho < rho_0:", "if rho < 1.4:"), ("(1 / rho - 1 / rho_0)", "(1 / rho - 1 / 1.4)")],
        [("k_a * (slot - me)", "0.9 * (slot - me)"), ("F = F + k_r *", "F = F + 0.5 *")],
        [
            ("k_a * (slot - me)", "0.9 * (slot - me)"),
            ("F = F + k_r *", "F = F + 0.5 *"),
            ("if rho < rho_0:", "if rho < 1.4:"),
            ("(1 / rho - 1 / rho_0)", "(1 / rho - 1 / 1.4)"),
        ],
    ),
    Mistake(
        "constants",
        "The constants are used wrongly: k_a belongs to the slot, k_r to the others.",
        [("F = velocity + k_a", "F = velocity + k_r"), ("F = F + k_r", "F = F + k_a")],
    ),
]

VELOCITY = [
    case("turn", "the leader stands and turns", [""], "slot_velocity", [-1.1, 0.9], [0.0, 0.0], 0.4),
    case("both", "the leader drives and turns", [""], "slot_velocity", [0.3, -1.2], [0.2, 0.1], -0.6),
    case("ahead", "the leader drives straight ahead", [""], "slot_velocity", [-1.1, 0.9], [0.2, 0.1], 0.0),
]
SWING = "rate * np.array([-arm[1], arm[0]])"
VELOCITY_MISTAKES = [
    Mistake(
        "no-swing", "The slot also swings around a leader that turns: add rate times (-r_y, r_x).", [(SWING, "0 * arm")]
    ),
    Mistake("no-leader", "The leader's own velocity is missing.", [("return velocity + rate", "return rate")]),
    Mistake(
        "swing-sign",
        "The slot swings the wrong way: with a rate above 0 everything turns to the left, so (-r_y, r_x).",
        [(SWING, "rate * np.array([arm[1], -arm[0]])")],
    ),
    Mistake(
        "along-the-arm",
        "The slot is pulled along its arm: what turns moves at right angles to it, (-r_y, r_x).",
        [(SWING, "rate * arm")],
    ),
    Mistake(
        "swapped",
        "Exchanged are the two numbers of the arm, but none has changed its sign: (-r_y, r_x).",
        [(SWING, "rate * np.array([arm[1], arm[0]])")],
    ),
]
STEER = [
    case("ahead", "nearly straight ahead", [""], "steer", [0.5, -1.0, 0.0], [0.2, 0.1]),
    case("left", "to the left", [""], "steer", [0.5, -1.0, -0.5], [0.1, 0.25]),
    case("right", "to the right", [""], "steer", [0.5, -1.0, 1.0], [0.1, -0.3]),
    case("behind", "to where it does not look", [""], "steer", [0.5, -1.0, 0.2], [-0.3, 0.02]),
    case("west", "across 180 degrees", [""], "steer", [0.5, -1.0, 3.0], [-0.3, -0.04]),
    case("fast", "faster than it can", [""], "steer", [0.5, -1.0, 0.2], [0.7, 0.5]),
    case("stand", "hardly any velocity", [""], "steer", [0.5, -1.0, 0.5], [0.004, -0.006]),
]
OFF, GO = "off = wrap(np.arctan2(velocity[1], velocity[0]) - pose[2])", "min(speed, 0.5) * max(np.cos(off), 0.0)"
STEER_MISTAKES = [
    Mistake("not-wrapped", "The angle is not wrapped: it turns the long way round.", [(OFF, OFF.replace("wrap", ""))]),
    Mistake(
        "no-heading",
        "The heading is not subtracted: how much it has to turn depends on where it looks.",
        [(OFF, "off = np.arctan2(velocity[1], velocity[0])")],
    ),
    Mistake(
        "turns-away",
        "It turns away from where it should go: direction of the velocity less heading.",
        [(OFF, "off = wrap(pose[2] - np.arctan2(velocity[1], velocity[0]))")],
    ),
    Mistake(
        "swapped",
        "arctan2 takes y first, then x.",
        [(OFF, OFF.replace("velocity[1], velocity[0]", "velocity[0], velocity[1]"))],
    ),
    Mistake(
        "backwards",
        "It drives backwards: where the cosine is below 0, it only turns.",
        [(GO, "min(speed, 0.5) * np.cos(off)")],
    ),
    Mistake(
        "drives-first",
        "It drives at full speed wherever it looks: times the cosine of the angle.",
        [(GO, "min(speed, 0.5)")],
    ),
    Mistake("too-fast", "It drives faster than 0.5 m/s.", [(GO, "speed * max(np.cos(off), 0.0)")]),
    Mistake(
        "turns-too-fast", "It turns faster than 1.2 rad/s: clip the rate.", [("np.clip(2 * off, -1.2, 1.2)", "2 * off")]
    ),
    Mistake("half-rate", "The turn rate is twice the angle.", [("np.clip(2 * off", "np.clip(off")]),
    Mistake("never-stands", "Below 0.01 m/s it stands: both numbers are 0.", [("if speed < 0.01:", "if False:")]),
    Mistake(
        "order",
        "The order is (forward velocity, turn rate).",
        [(f"np.array([{GO}, np.clip(2 * off, -1.2, 1.2)])", f"np.array([np.clip(2 * off, -1.2, 1.2), {GO}])")],
    ),
]
WEIGH = [
    case("two", "two guesses", [""], "weigh", [0.5, 0.5], [0.3, 2.1]),
    case("prior", "guesses that were not alike before", [""], "weigh", [0.7, 0.2, 0.1], [4.0, 1.0, 2.5]),
    case("bad", "readings that fit none of them", [""], "weigh", [0.4, 0.6], [5001.0, 5000.0]),
]
WEIGHED = "np.asarray(w) * np.exp(-(np.asarray(misfits) - np.min(misfits)) / 2)"
WEIGH_MISTAKES = [
    Mistake("no-half", "The factor is exp(-m / 2), with the half.", [(WEIGHED, WEIGHED.replace(" / 2", ""))]),
    Mistake(
        "sign",
        "What fits badly becomes more probable: exp(-m / 2), with the minus.",
        [(WEIGHED, WEIGHED.replace("exp(-(", "exp((").replace("np.min", "np.max"))],
    ),
    Mistake(
        "forgets",
        "What was known before is forgotten: the old weights are a factor.",
        [(WEIGHED, WEIGHED.removeprefix("np.asarray(w) * "))],
    ),
    Mistake("sum", "The weights do not sum up to 1: divide by their sum.", [("return w / np.sum(w)", "return w")]),
    Mistake(
        "underflow",
        "Where all misfits are large, exp(-m / 2) is 0 for a computer: subtract the smallest misfit first.",
        [(WEIGHED, "np.asarray(w) * np.exp(-np.asarray(misfits) / 2)")],
    ),
    Mistake(
        "largest",
        "Divided by the largest one: their sum is to be 1.",
        [("return w / np.sum(w)", "return w / np.max(w)")],
    ),
]

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
        [Right("list", [(PAIR_END, PAIR_END.replace("np.array([o[0], o[1], heading])", "[*o, heading]"))])],
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
    Check(
        "team-converted",
        FURTHER,
        "converted",
        "function",
        CONVERTED,
        [Right("times", [(POINT, POINT.replace("/ np.exp(-(sigma**2) / 2)", "* np.exp(sigma**2 / 2)"))])],
        CONVERTED_MISTAKES,
        parts={"": [XY]},
    ),
    Check(
        "team-velocity",
        FORMATION,
        "slot_velocity",
        "function",
        VELOCITY,
        [Right("turned", [(SWING, "rate * (np.array([[0, -1], [1, 0]]) @ arm)")])],
        VELOCITY_MISTAKES,
        parts={"": [XY]},
    ),
    Check(
        "team-steer",
        FORMATION,
        "steer",
        "function",
        STEER,
        [Right("norm", [("speed = np.hypot(*velocity)", "speed = np.linalg.norm(velocity)")])],
        STEER_MISTAKES,
        parts={"": [["speed", "rate"]]},
    ),
    Check(
        "team-weigh",
        FORMATION,
        "weigh",
        "function",
        WEIGH,
        [Right("logs", [(WEIGHED, "np.exp(np.log(w) - np.asarray(misfits) / 2 + np.min(misfits) / 2)")])],
        WEIGH_MISTAKES,
        parts={"": "each"},
    ),
    Check(
        "team-force",
        FORMATION,
        "force",
        "function",
        FORCE,
        [Right("norm", [("np.linalg.norm(me - other)", "np.hypot(*(me - other))")])],
        FORCE_MISTAKES,
        parts={"": [XY]},
    ),
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
