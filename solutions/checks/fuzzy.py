"""Lab 5: the fuzzy grid, and when to switch."""

from labkit.instructor.authoring.spec import Check, Mistake, Right

from .legged_parts import case

LAB = "05_fuzzy_hybrid"

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
        "clipped-late",
        "The ramp is scaled before it is clipped: clip it to [0, 1] first, then scale it by h - b.",
        [(BODY, "return np.clip(b + (h - b) * (s - away) / (s - c), 0, 1)")],
        [(BODY, "return b + np.clip((h - b) * (s - away) / (s - c), 0, 1)")],
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
    Mistake("fixed-cell", "The cells are taken to be 0.1 m wide: use `cell`.", [(S, S.replace("0.3 * cell", "0.03"))]),
    Mistake("no-factor", "The factor 0.9 is missing.", [(S, S.replace("0.9 * ", ""))]),
    Mistake("one-sigma", "The flank is 2 sigma wide.", [(S, S.replace("(2 * sigma)", "sigma"))]),
    Mistake(
        "no-bias",
        "S falls below b: a sighting may be false, so it may never rule a cell out.",
        [(S, S.replace("b, 1)", "0, 1)"))],
        [(S, S.replace("b, 1)", "floor, 1)"))],
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

CELLS = [[0.74, 0.78, 0.6, 0.02], [0.5, 0.93, 0.32, 0.76], [0.17, 0.15, 1.0, 0.63]]
X_OF = [[-2.0, -1.0, 0.2, 1.5], [-1.8, -0.9, 0.4, 1.7], [-1.6, -0.7, 0.6, 1.9]]
Y_OF = [[0.9, 0.9, 0.9, 0.9], [1.3, 1.3, 1.3, 1.3], [1.7, 1.7, 1.7, 1.7]]
EAST = [[0.9, -1.1, 2.0, -2.0], [1.0, 0.2, -1.2, -0.6], [2.5, -2.5, 1.4, 1.9]]
WEST = [[2.0, 2.2, 2.0, -2.0], [1.0, -2.6, -1.2, 2.3], [0.5, -0.5, -1.9, 1.9]]
ESTIMATE = [
    case("east", "headings around 0", [""], "estimate", CELLS, X_OF, Y_OF, EAST),
    case("west", "headings around 180 degrees", [""], "estimate", CELLS, X_OF, Y_OF, WEST),
    case(
        "low",
        "a grid whose best cell is at 0.4",
        [""],
        "estimate",
        [[0.4 * v for v in r] for r in CELLS],
        X_OF,
        Y_OF,
        WEST,
    ),
    case("part", "another part: 0.25", [""], "estimate", CELLS, X_OF, Y_OF, EAST, 0.25),
    case(
        "one",
        "one cell, far better than all others",
        [""],
        "estimate",
        [[0.1, 1.0]],
        [[0.3, 0.4]],
        [[1.0, 2.0]],
        [[1.0, -2.0]],
    ),
]
BEST, WEIGHTS = "best = possible >= part * possible.max()", "w = possible[best] / possible[best].sum()"
MEAN = "heading = np.arctan2(w @ np.sin(theta[best]), w @ np.cos(theta[best]))"
ESTIMATE_MISTAKES = [
    Mistake(
        "mean-of-angles",
        "The headings are averaged as numbers: the mean of 179 and -179 degrees comes out as 0. Take the mean of the arrows, "
        "arctan2 of the mean sine and the mean cosine.",
        [(MEAN, "heading = w @ theta[best]")],
    ),
    Mistake(
        "all-cells",
        "All cells count: take only those that are at least `part` times as possible as the best.",
        [(BEST, "best = possible >= 0")],
    ),
    Mistake(
        "best-only",
        "Only the best cell counts here: take all that are at least `part` times as possible.",
        [(BEST, "best = possible >= possible.max()")],
    ),
    Mistake(
        "fixed-bound",
        "The bound is `part` itself: it is `part` times the largest value, whatever that is.",
        [(BEST, "best = possible >= part")],
    ),
    Mistake("fixed-part", "`part` is not used: 0.7 is only its default.", [(BEST, BEST.replace("part *", "0.7 *"))]),
    Mistake(
        "not-weighted",
        "The cells are not weighted: each counts by how possible it is.",
        [(WEIGHTS, "w = np.full(best.sum(), 1 / best.sum())")],
    ),
    Mistake(
        "weights-of-all",
        "The weights are divided by the sum over all cells: the sum over those that were picked makes them add up to 1.",
        [(WEIGHTS, "w = possible[best] / possible.sum()")],
    ),
    Mistake(
        "not-divided", "The weights do not add up to 1: divide them by their sum.", [(WEIGHTS, "w = possible[best]")]
    ),
    Mistake(
        "swapped",
        "Sine and cosine have changed places: it is arctan2(sine, cosine).",
        [(MEAN, "heading = np.arctan2(w @ np.cos(theta[best]), w @ np.sin(theta[best]))")],
    ),
    Mistake(
        "arctan",
        "`arctan` of a quotient cannot tell a direction from the opposite one: `arctan2(sine, cosine)` can.",
        [(MEAN, "heading = np.arctan((w @ np.sin(theta[best])) / (w @ np.cos(theta[best])))")],
    ),
    Mistake(
        "heading-of-best",
        "The heading is that of the best cell only: take the mean over the same cells as for x and y.",
        [(MEAN, "heading = theta.flat[possible.argmax()]")],
    ),
    Mistake(
        "arrows-not-weighted",
        "The arrows are not weighted: each heading counts by how possible its cell is.",
        [(MEAN, "heading = np.arctan2(np.sin(theta[best]).sum(), np.cos(theta[best]).sum())")],
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
    spread_case("strict", "stricter limits, a position that is too wide", diagonal(0.045, 0.045, 0.01), 0.2, 0.3),
    spread_case(
        "strict-heading", "stricter limits, a heading that is too wide", diagonal(0.001, 0.001, 0.1225), 0.2, 0.3
    ),
    spread_case("tiny", "a covariance that is very narrow", diagonal(0.01, 0.01, 1e-4)),
    spread_case("huge", "a heading that is far too wide", diagonal(0.01, 0.01, 9.0)),
    spread_case("together", "both not yet too wide, with other limits", diagonal(0.1, 0.1, 0.2), 0.5, 0.9),
    spread_case("inside", "other limits, a narrow covariance", diagonal(1.5, 1.5, 3.0), 2.0, 2.0),
]
RULE = "return bool(np.sqrt(P[0, 0] + P[1, 1]) > position or np.sqrt(P[2, 2]) > heading)"
SPREAD_MISTAKES = [
    Mistake(
        "no-root",
        "The variances are compared with standard deviations: take the square root.",
        [(RULE, "return bool(P[0, 0] + P[1, 1] > position or P[2, 2] > heading)")],
    ),
    Mistake(
        "no-root-heading",
        "The heading's variance is compared with a standard deviation: take its square root.",
        [(RULE, RULE.replace("np.sqrt(P[2, 2])", "P[2, 2]"))],
    ),
    Mistake(
        "no-root-position",
        "The position's variance is compared with a standard deviation: take its square root.",
        [(RULE, RULE.replace("np.sqrt(P[0, 0] + P[1, 1])", "P[0, 0] + P[1, 1]"))],
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
        "The variance of y does not count: that of the position is P[0, 0] + P[1, 1].",
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
        "A covariance that is too wide does not count here: `lost_by_spread(P)`, with its own limits, tells.",
        [(EITHER, "return bool(surprised)")],
        [("lost_by_spread(P)", "lost_by_spread(P, bound, share)")],
    ),
    Mistake(
        "nis-forgotten",
        "Surprises never count: five among eight should be enough. Is it `len(d2) >= 8`, is d2 itself "
        "compared with bound, and is the result used?",
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
        "last-only",
        "Only the last of d2 counts here: ask for the share, the number of surprises over that of all sightings.",
        [("np.mean(np.asarray(d2) > bound) >= share", "d2[-1] > bound")],
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
        parts={"": "each"},
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
        parts={"": "each"},
    ),
    Check(
        "legged-estimate",
        LAB,
        "estimate",
        "function",
        ESTIMATE,
        [
            Right("average", [(WEIGHTS, "w = possible[best] / np.sum(possible[best])")]),
            Right("complex", [(MEAN, "heading = np.angle(w @ np.exp(1j * theta[best]))")]),
            Right(
                "zeros",
                [
                    (BEST, "best = possible > -1"),
                    (WEIGHTS, "w = np.where(possible >= part * possible.max(), possible, 0)[best]; w = w / w.sum()"),
                ],
            ),
        ],
        ESTIMATE_MISTAKES,
        parts={"": [["x", "y", "heading"]]},
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
