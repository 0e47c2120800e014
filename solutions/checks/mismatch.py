"""Lab 2: how honest is the filter?"""

from labkit.instructor.authoring.spec import Check, Mistake, Right

LAB = "02_noise_mismatch"
SOLVE = "e @ np.linalg.solve(P, e)"
BY_HAND = """def nees(t, x, P):
    (a, b), (c, d) = P
    e, f = t - x
    return (d * e * e - (b + c) * e * f + a * f * f) / (a * d - b * c)
"""


def nees_case(id, title, *args):
    return {"id": id, "title": title, "look": [""], "calls": [["nees", *args]]}


NEES = [
    nees_case("diagonal", "a covariance without correlation", [1.0, 2.0], [0.8, 2.6], [[0.09, 0.0], [0.0, 0.25]]),
    nees_case("full", "a correlated covariance", [1.0, 2.0], [0.4, 2.7], [[0.5, 0.2], [0.2, 0.3]]),
    nees_case("small", "a filter that is very sure", [-2.0, 0.5], [-1.9, 0.53], [[0.004, -0.001], [-0.001, 0.002]]),
    nees_case("exact", "an estimate without error", [1.0, 2.0], [1.0, 2.0], [[0.5, 0.2], [0.2, 0.3]]),
]

NEES_MISTAKES = [
    Mistake(
        "p-not-inverted",
        "P is not inverted: e' P^-1 e measures the error in units of the filter's own uncertainty.",
        [(SOLVE, "e @ P @ e")],
    ),
    Mistake("root", "The square root is too much: the NEES is the squared value.", [(SOLVE, f"np.sqrt({SOLVE})")]),
    Mistake(
        "p-squared",
        "P is used twice: it is e' P^-1 e, with the inverse once.",
        [(SOLVE, "e @ np.linalg.solve(P @ P, e)")],
    ),
    Mistake(
        "entries-inverted",
        "1 / P takes the reciprocal of each entry: the inverse of the matrix is needed.",
        [(SOLVE, "e @ (1 / P) @ e")],
        [(SOLVE, "e @ np.array([[1 / P[0, 0], 1 / P[0, 1]], [1 / P[1, 0], 1 / P[1, 1]]]) @ e")],
    ),
    Mistake(
        "diagonal-only",
        "Only the variances are used: the correlation in P counts too.",
        [(SOLVE, "np.sum(e**2 / np.diag(P))")],
    ),
    Mistake(
        "elementwise",
        "The result is an array: e stands on both sides of P^-1, and each product is `@` (`*` goes entry by entry).",
        [(SOLVE, "e * np.linalg.inv(P) * e")],
        [(SOLVE, "e * np.linalg.solve(P, e)")],
        [(SOLVE, "np.linalg.inv(P) @ e")],
        [(SOLVE, "np.outer(e, e) @ np.linalg.inv(P)")],
    ),
    Mistake("distance", "This is the squared distance: P is missing.", [(SOLVE, "e @ e")]),
    Mistake(
        "trace",
        "The error is divided by the trace of P, one number for all directions: it is e' P^-1 e.",
        [(SOLVE, "e @ e / np.trace(P)")],
    ),
    Mistake(
        "mean",
        "The result is halved: the NEES is the whole sum (its mean for an honest filter is 2).",
        [(SOLVE, f"{SOLVE} / 2")],
    ),
    Mistake(
        "x-only", "The error is missing: use truth - x.", [("e = truth - x", "e = x")], [("e = truth - x", "e = truth")]
    ),
    Mistake("sum", "The error is truth minus x: here the two are added.", [("truth - x", "truth + x")]),
]


NIS_MAP = {"map": [[3, 2.0, 1.0], [0, -1.0, 2.5], [1, 0.5, -2.0]]}
NIS_ARGS = [[0.3, -0.4], [[0.5, 0.2], [0.2, 0.3]], [[0.09, 0.02], [0.02, 0.25]]]


def nis_case(id, title, *seen, R=NIS_ARGS[2]):
    call = ["nis", *NIS_ARGS[:2], R, {"landmarks": list(seen)}, NIS_MAP]
    return {"id": id, "title": title, "look": [""], "calls": [call]}


NIS = [
    nis_case("one", "one landmark in view", [3, 2.1, 0.9]),
    nis_case("two", "two landmarks in view", [1, 0.6, -1.2], [3, 1.2, 1.9]),
    nis_case("all", "three landmarks in view", [0, -1.9, 2.6], [1, 0.1, -2.4], [3, 2.3, 1.1]),
    nis_case("plain", "a sensor that is as good in all directions", [0, -0.9, 3.3], R=[[0.16, 0.0], [0.0, 0.16]]),
    nis_case("none", "nothing in view"),
]
NU = "nu = np.concatenate([lm.p - (m[m.index(lm)] - x) for lm in y])"
S = "S = H @ P @ H.T + np.kron(np.eye(p), R)"
NIS_SOLVE = "nu @ np.linalg.solve(S, nu)"

NIS_MISTAKES = [
    Mistake(
        "r-missing",
        "S is H P H' alone: the noise of the measurements, R for each landmark, is missing in it.",
        [(S, "S = H @ P @ H.T + 1e-9 * np.eye(2 * p)")],
    ),
    Mistake(
        "r-spread",
        "The entries of R are spread over all landmarks: the order of the two matrices matters in kron.",
        [("np.kron(np.eye(p), R)", "np.kron(R, np.eye(p))")],
    ),
    Mistake(
        "p-missing",
        "S is the measurements' noise alone: H P H', what the filter is unsure of, is missing in it.",
        [(S, "S = np.kron(np.eye(p), R)")],
    ),
    Mistake(
        "r-dt-again",
        "R comes out four times too large or too small, as if it were scaled with dt = 0.25 s once more: what `nis` is "
        "given is that of one step already.",
        [(S, S.replace("p), R", "p), R / 0.25"))],
        [(S, S.replace("p), R", "p), R * 0.25"))],
    ),
    Mistake(
        "s-not-inverted",
        "S is not inverted: nu' S^-1 nu measures the innovation in units of what is expected.",
        [(NIS_SOLVE, "nu @ S @ nu")],
    ),
    Mistake(
        "root", "The square root is too much: the NIS is the squared value.", [(NIS_SOLVE, f"np.sqrt({NIS_SOLVE})")]
    ),
    Mistake(
        "per-number",
        "The result is divided by the count of numbers: the NIS is the whole sum. The picture divides it later.",
        [(NIS_SOLVE, f"{NIS_SOLVE} / (2 * p)")],
        [(NIS_SOLVE, f"{NIS_SOLVE} / 2")],
    ),
    Mistake(
        "diagonal-only",
        "Only the variances in S are used: what its numbers have in common counts too.",
        [(NIS_SOLVE, "np.sum(nu**2 / np.diag(S))")],
    ),
    Mistake(
        "seen-only",
        "The innovation is what was seen less what is expected: the expected part is missing.",
        [(NU, "nu = np.concatenate([lm.p for lm in y])")],
    ),
    Mistake(
        "x-missing",
        "A landmark is expected at its place on the map less x: x is missing.",
        [(NU, "nu = np.concatenate([lm.p - m[m.index(lm)] for lm in y])")],
    ),
    Mistake(
        "x-added",
        "A landmark is expected at its place on the map less x: here x is added.",
        [(NU, NU.replace("- x)", "+ x)"))],
    ),
    Mistake(
        "j-th",
        "The j-th landmark in view is not the j-th of the map: look it up with m.index(lm).",
        [(NU, "nu = np.concatenate([lm.p - (m[j] - x) for j, lm in enumerate(y)])")],
    ),
    Mistake(
        "zero",
        "With nothing in view there is no NIS: return not-a-number, nan, instead of 0.",
        [("return np.nan", "return 0.0")],
    ),
]


def verdict_case(id, title, *pairs):
    return {"id": id, "title": title, "look": [""], "calls": [["verdict", mean, runs] for mean, runs in pairs]}


VERDICT = [
    verdict_case("over", "a mean that is far too large", (19.0, 1), (8.5, 50)),
    verdict_case("under", "a mean that is far too small", (0.02, 1), (0.22, 50)),
    verdict_case("honest", "a mean of about 2", (2.0, 50), (2.1, 10), (1.8, 50)),
    verdict_case("one", "one run says little", (6.5, 1), (4.5, 1), (0.2, 1)),
    verdict_case("many", "many runs say more", (2.7, 50), (1.4, 50), (2.4, 200), (1.6, 200)),
]
LOW_HIGH = "low, high = chi2_bounds(dof=2, level=0.95, runs=runs)"
DARK_LOOP = "current = current + 1 if n == 0 else 0"

VERDICT_MISTAKES = [
    Mistake(
        "swapped",
        "The two words are swapped: a NEES that is too large means errors larger than the filter "
        "believes, overconfident.",
        [
            ('return "overconfident"', 'return "under"'),
            ('return "underconfident"', 'return "overconfident"'),
            ('return "under"', 'return "underconfident"'),
        ],
    ),
    Mistake(
        "one-run",
        "The number of runs is not used: the mean of many runs must be closer to 2 than a single value.",
        [(LOW_HIGH, "low, high = chi2_bounds(dof=2, level=0.95)")],
        [(LOW_HIGH, LOW_HIGH.replace("runs=runs", "runs=1"))],
    ),
    Mistake(
        "exactly-two",
        "The mean is compared with 2 itself: even an honest filter is a little above or below. Use the bounds.",
        [(LOW_HIGH, "low = high = 2")],
    ),
    Mistake(
        "bounds-of-sum",
        "The bounds are too large by the number of runs: they must be those of the mean, and "
        "dof that of one run (2), since chi2_bounds knows about the runs.",
        [(LOW_HIGH, LOW_HIGH + "\n    low, high = low * runs, high * runs")],
        [(LOW_HIGH, LOW_HIGH.replace("dof=2", "dof=2 * runs"))],
    ),
    Mistake(
        "sum-not-mean",
        "The mean is multiplied by the number of runs, but the bounds are those of a mean.",
        [("mean_nees > high", "mean_nees * runs > high"), ("mean_nees < low", "mean_nees * runs < low")],
    ),
    Mistake(
        "dof-one",
        "The bounds are those for one component (dof=1): the position has two.",
        [(LOW_HIGH, LOW_HIGH.replace("dof=2", "dof=1"))],
    ),
    Mistake(
        "never-under",
        "A mean below the lower bound is not noticed: such a filter is too cautious, underconfident.",
        [("mean_nees < low", "False")],
    ),
    Mistake(
        "never-over",
        "A mean above the upper bound is not noticed: such a filter is overconfident.",
        [("mean_nees > high", "False")],
    ),
    Mistake(
        "no-return",
        "For a mean between the bounds nothing is returned: 'consistent' is missing.",
        [('return "consistent"', "pass")],
    ),
]


def dark_case(id, title, *rows):
    return {"id": id, "title": title, "look": [""], "calls": [["longest_dark", {"ints": row}] for row in rows]}


DARK = [
    dark_case("middle", "a dark row in the middle", [1, 2, 0, 0, 0, 1, 0, 2]),
    dark_case("end", "a dark row that reaches the end", [2, 0, 1, 1, 0, 0, 0, 0]),
    dark_case("start", "a dark row at the start", [0, 0, 0, 1, 0, 0, 1, 3]),
    dark_case("never", "a robot that always sees something", [1, 3, 2, 2, 1]),
    dark_case("always", "a robot that never sees anything", [0, 0, 0, 0, 0]),
]
BODY = """def longest_dark(count):
    longest = current = 0
    for n in count:
        {0}
    return {1}
"""

DARK_MISTAKES = [
    Mistake(
        "all-dark",
        "All dark steps are counted: only the longest row of steps without a break is asked for.",
        [(DARK_LOOP, "current = current + (n == 0)")],
        "def longest_dark(count):\n    return int(np.sum(count == 0))",
    ),
    Mistake(
        "end-forgotten",
        "A row that reaches the last step is lost: compare with the longest also after the loop.",
        BODY.format(
            "if n == 0:\n            current += 1\n        else:\n"
            "            longest = max(longest, current)\n            current = 0",
            "longest",
        ),
    ),
    Mistake(
        "last-row",
        "The last row is returned, not the longest: remember the largest so far.",
        [("longest = max(longest, current)", "longest = current or longest")],
    ),
    Mistake(
        "last-count", "The counter at the end is returned, not the longest row.", [("return longest", "return current")]
    ),
    Mistake(
        "first-row",
        "Only the first dark row is looked at: the longest may come later.",
        BODY.format("if n == 0:\n            current += 1\n        elif current:\n            break", "current"),
    ),
    Mistake(
        "lit",
        "The steps with landmarks in view are counted: dark means that count is 0.",
        [("if n == 0 else 0", "if n > 0 else 0")],
    ),
    Mistake(
        "off-by-one",
        "The result is too small by one: a row of three dark steps has length 3.",
        [("return longest", "return max(longest - 1, 0)")],
    ),
    Mistake(
        "reset-to-one",
        "The counter starts again at 1 after a step with landmarks: it must start at 0.",
        [(DARK_LOOP, "current = current + 1 if n == 0 else 1")],
    ),
    Mistake(
        "number-of-rows",
        "The dark rows are counted: asked is the length of the longest.",
        BODY.format("longest += n == 0 and current == 0\n        current = n == 0", "int(longest)"),
    ),
    Mistake(
        "sum",
        "The landmarks are summed up: count the steps where there are none.",
        [("return longest", "return sum(count)")],
    ),
]

CHECKS = [
    Check(
        "mismatch-nees",
        LAB,
        "nees",
        "function",
        NEES,
        [
            Right("inverse", [(SOLVE, "e.T @ np.linalg.inv(P) @ e")]),
            Right("other sign", [("truth - x", "x - truth")]),
            Right("by hand", BY_HAND),
            Right("einsum", [(SOLVE, "np.einsum('i,ij,j', e, np.linalg.pinv(P), e)")]),
            Right("float32", [(SOLVE, f"np.float32({SOLVE})")]),
        ],
        NEES_MISTAKES,
    ),
    Check(
        "mismatch-nis",
        LAB,
        "nis",
        "function",
        NIS,
        [
            Right("inverse", [(NIS_SOLVE, "nu.T @ np.linalg.inv(S) @ nu")]),
            Right("other sign", [("-np.eye(2), (p, 1)", "np.eye(2), (p, 1)"), (NU, NU.replace("nu = ", "nu = -"))]),
            Right("block by block", [(S, "S = np.tile(P, (p, p)) + np.kron(np.eye(p), R)")]),
            Right("least squares", [(NIS_SOLVE, "nu @ np.linalg.pinv(S) @ nu")]),
            Right("float nan", [("return np.nan", 'return float("nan")')]),
        ],
        NIS_MISTAKES,
    ),
    Check(
        "mismatch-verdict",
        LAB,
        "verdict",
        "function",
        VERDICT,
        [
            Right(
                "scipy",
                [(LOW_HIGH, "from scipy.stats import chi2\n    low, high = chi2.ppf([0.025, 0.975], 2 * runs) / runs")],
            )
        ],
        VERDICT_MISTAKES,
    ),
    Check(
        "mismatch-dark",
        LAB,
        "longest_dark",
        "function",
        DARK,
        [
            Right(
                "numpy",
                "def longest_dark(count):\n    lit = np.flatnonzero(np.concatenate([[1], count, [1]]))\n"
                "    return np.diff(lit).max() - 1",
            ),
            Right(
                "text",
                "def longest_dark(count):\n    row = ''.join('0' if n == 0 else ' ' for n in count)\n"
                "    return max(map(len, row.split()), default=0)",
            ),
            Right(
                "groupby",
                "from itertools import groupby\ndef longest_dark(count):\n"
                "    return max([len(list(g)) for n, g in groupby(count) if n == 0], default=0)",
            ),
        ],
        DARK_MISTAKES,
    ),
]
