"""Labs 7 and 8: a formation, several guesses, and converted measurements."""

from labkit.instructor.authoring.spec import Check, Mistake, Right

from .team_parts import case

FORMATION, FURTHER = "07_formation", "08_further"
XY = ["x", "y"]

CONVERTED = [
    case("coarse", "a coarse sensor", [""], "converted", 4.0, 0.7, 0.4),
    case("behind", "a bearing to the back", [""], "converted", 2.5, -2.4, 0.6),
]
POINT = "d * np.array([np.cos(alpha), np.sin(alpha)]) / np.exp(-(sigma**2) / 2)"
CONVERTED_MISTAKES = [
    Mistake(
        "raw",
        "No bias is taken out, or hardly any: divide by exp(-sigma^2 / 2), with sigma in radians, as it comes.",
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
    case("near", "one robot near", [""], "force", ME, SLOT, V, [[0.5, 0.1], [2.0, 1.0]]),
    case("alone", "nobody near", [""], "force", ME, SLOT, V, [[2.0, 1.0], [-1.5, 1.0]]),
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
        "turned-round",
        "Robots beyond rho_0 act, and near ones do not: it is the other way round.",
        [("if rho < rho_0:", "if rho > rho_0:")],
    ),
    Mistake(
        "from-slot",
        "How near another robot is counts from me, not from the slot: rho = |me - other|.",
        [("rho = np.linalg.norm(me - other)", "rho = np.linalg.norm(slot - other)")],
    ),
    Mistake(
        "no-direction",
        "The push has no direction: it is a number times e, the unit vector from the other robot to me.",
        [(PUSH, PUSH.removesuffix(" * (me - other) / rho"))],
    ),
    Mistake(
        "brackets",
        "All of (1/rho - 1/rho_0) is divided by rho squared: a pair of brackets is missing.",
        [(PUSH, PUSH.replace("(1 / rho - 1 / rho_0) / rho**2", "(1 / rho - 1 / rho_0 / rho**2)"))],
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
    case("both", "the leader drives and turns", [""], "slot_velocity", [0.3, -1.2], [0.2, 0.1], -0.6),
    case("turn", "the leader stands and turns", [""], "slot_velocity", [-1.1, 0.9], [0.0, 0.0], 0.4),
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
    case("slow", "slow, but faster than 0.01 m/s", [""], "steer", [0.5, -1.0, 0.5], [0.03, -0.02]),
    case("stand", "hardly any velocity", [""], "steer", [0.5, -1.0, 0.5], [0.004, -0.006]),
]
OFF, GO = "off = wrap(np.arctan2(velocity[1], velocity[0]) - pose[2])", "min(speed, 0.5) * max(np.cos(off), 0.0)"
STEER_MISTAKES = [
    Mistake(
        "not-wrapped",
        "The difference of the two angles is not wrapped: it turns the long way round.",
        [(OFF, OFF.replace("wrap", ""))],
    ),
    Mistake(
        "to-velocity",
        "The velocity is taken for a place: its own direction counts, arctan2 of its two numbers.",
        [(OFF, "off = wrap(np.arctan2(velocity[1] - pose[1], velocity[0] - pose[0]) - pose[2])")],
    ),
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
    Mistake(
        "clipped-first",
        "The limit of 1.2 rad/s is that of the rate: double the angle before you clip.",
        [("np.clip(2 * off, -1.2, 1.2)", "2 * np.clip(off, -1.2, 1.2)")],
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
    case("apart", "a guess that fits far worse than the other", [""], "weigh", [0.5, 0.5], [0.0, 5000.0]),
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
    Mistake(
        "sum",
        "The weights do not sum up to 1: divide by their sum.",
        [("return w / np.sum(w)", "return w")],
        [("return w / np.sum(w)", "return w / np.sum(np.exp(-(np.asarray(misfits) - np.min(misfits)) / 2))")],
    ),
    Mistake(
        "overflow",
        "Where misfits are far apart, exp becomes too large for a computer: subtract the *smallest* misfit.",
        [(WEIGHED, WEIGHED.replace("np.min(", "np.max("))],
        [(WEIGHED, WEIGHED.replace("np.min(", "np.mean("))],
    ),
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

CHECKS = [
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
        parts={"": [["forward", "rate"]]},
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
]
