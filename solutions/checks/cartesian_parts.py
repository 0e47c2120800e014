"""Lab 1: the two functions that come before the filter."""

from labkit.instructor.authoring.spec import Check, Mistake, Right

from .inputs import X0

LAB = "01_cartesian_ekf"
XY = ["x", "y"]
MAP = [[0, 1.5, 2.0], [1, -2.0, 0.5], [2, 3.0, -1.5], [3, -0.5, -2.5], [4, 2.2, 1.1]]
SEEN = {0: [0.9, 2.95], 1: [-2.2, 1.05], 2: [2.95, -0.95], 3: [-0.6, -1.95], 4: [2.1, 2.1]}  # from about (0.3, -0.5)
NAMES = [[12, 1.5, 2.0], [3, -2.0, 0.5], [7, 3.0, -1.5], [25, -0.5, -2.5]]  # ids are no places in this list
BY_PLACE = (
    "It works here because the ids happen to be the places in the map. In lab 3 a real robot's landmarks have other "
    "names: find the landmark with `==` or with `m.index(...)`, and your code will run there too."
)

EXPECTED = "expected = np.concatenate([m[m.index(lm)] - x for lm in y])"
FIND = "m[m.index(lm)] - x for lm in y"
RETURN = "return seen, expected"
KRON = "np.kron(np.eye(p), R)"

PLACE_IN_MAP = "def stack(y, m, x):\n    return np.ravel([lm.p for lm in y]), np.ravel([m[lm.id] - x for lm in y])"

EXPECTED_MISTAKES = [
    Mistake(
        "expected-reversed",
        "The expected measurement is reversed: the robot sees a landmark at landmark "
        "minus robot, not at robot minus landmark.",
        [(FIND, "x - m[m.index(lm)] for lm in y")],
    ),
    Mistake(
        "robot-not-subtracted",
        "The expected measurement is the landmark's place in the map: subtract the "
        "robot's position, since the robot measures relative to itself.",
        [(FIND, "m[m.index(lm)].p for lm in y")],
    ),
    Mistake(
        "robot-added",
        "The expected measurement is landmark plus robot: it must be landmark minus robot.",
        [(FIND, "m[m.index(lm)] + x for lm in y")],
    ),
    Mistake(
        "expected-from-seen",
        "What is expected comes from the map, not from the measurement: find the landmark "
        "of the map that `lm` is, and take its place minus x.",
        [(FIND, "lm - x for lm in y")],
    ),
    Mistake(
        "by-place-in-y",
        "The j-th landmark in y is taken for the j-th of the map. y holds only what is in "
        "view, in any order: find each landmark of the map by its name (`==` or `m.index`).",
        [(FIND, "m[j] - x for j in range(len(y))")],
    ),
    Mistake(
        "x-then-y",
        "The expected values are stacked with all x first, then all y; what was seen has x and y "
        "of one landmark side by side.",
        [(EXPECTED, EXPECTED + "\n    expected = expected.reshape(-1, 2).T.ravel()")],
    ),
]

STACK_MISTAKES = [
    Mistake(
        "map-order",
        "What was seen is stacked in the order of y, what is expected in the order of the map: both need the same.",
        [(FIND, "k - x for k in m if k in y")],
    ),
    Mistake(
        "expected-is-seen",
        "What is expected is a copy of what was seen: it comes from the map. Find the landmark "
        "of the map that `lm` is, and take its place minus x.",
        [(FIND, "lm.p for lm in y")],
    ),
    Mistake(
        "swapped",
        "The two results are swapped: first what was seen, then what is expected.",
        [(RETURN, "return expected, seen")],
    ),
    Mistake(
        "not-flat",
        "The results are tables (p, 2), one row a landmark: stack them into one long vector (2p,).",
        [(RETURN, "return seen.reshape(-1, 2), expected.reshape(-1, 2)")],
        [(RETURN, "return [lm.p for lm in y], [m[m.index(lm)] - x for lm in y]")],
    ),
    Mistake(
        "columns",
        "The results are columns (2p, 1): keep vectors one-dimensional, (2p,).",
        [(RETURN, "return seen.reshape(-1, 1), expected.reshape(-1, 1)")],
    ),
    Mistake(
        "innovation",
        "The first result is the difference already: return what was seen and what is expected, one by one.",
        [(RETURN, "return seen - expected, expected")],
    ),
    Mistake(
        "all-x-then-y",
        "Both results hold all x first, then all y: keep x and y of one landmark side by side.",
        [(RETURN, "return seen.reshape(-1, 2).T.ravel(), expected.reshape(-1, 2).T.ravel()")],
    ),
    Mistake(
        "both-in-map-order",
        "Both results stand in the order of the map: keep the order of y.",
        [("seen = np", "y = [lm for k in m for lm in y if lm == k]\n    seen = np")],
    ),
    Mistake(
        "first-left-out",
        "The first landmark of y is left out: positions count from 0.",
        [("seen = np", "y = y[1:]\n    seen = np")],
    ),
    Mistake(
        "one-only",
        "Only one landmark of y comes back: does the `return` stand inside the loop, or is "
        "something overwritten there?",
        [(RETURN, "return seen[:2], expected[:2]")],
        [(RETURN, "return seen[-2:], expected[-2:]")],
    ),
    Mistake(
        "whole-map", "All landmarks of the map are expected: only those in y are in view.", [(FIND, "k - x for k in m")]
    ),
    Mistake(
        "seen-plus-robot",
        "What was seen is moved to world coordinates: keep it as it was measured, relative to the robot.",
        [("[lm.p for lm in y]", "[lm.p + x for lm in y]")],
    ),
]

REPEAT_MISTAKES = [
    Mistake(
        "not-repeated",
        "R is not repeated: with p landmarks the result is (2p, 2p), with one block R for each.",
        [(KRON, "R")],
    ),
    Mistake(
        "kron-order",
        "The entries of R are spread over all landmarks: the order of the two matrices matters in kron.",
        [(KRON, "np.kron(R, np.eye(p))")],
    ),
    Mistake(
        "too-large",
        "The result is (4p, 4p). That is the handout's slip: its identity must be of size p, not 2p.",
        [(KRON, "np.kron(np.eye(2 * p), R)")],
    ),
    Mistake(
        "tiled",
        "R stands in every block: that says that all landmarks are measured with the same error. "
        "Independent errors have zeros off the diagonal.",
        [(KRON, "np.tile(R, (p, p))")],
        [(KRON, "np.kron(np.ones((p, p)), R)")],
    ),
    Mistake(
        "stacked",
        "The blocks stand below or beside each other: they belong on the diagonal of a (2p, 2p) matrix.",
        [(KRON, "np.tile(R, (p, 1))")],
        [(KRON, "np.tile(R, (1, p))")],
    ),
    Mistake(
        "list",
        "The result is a stack of p matrices (p, 2, 2): it must be one matrix (2p, 2p) with the blocks "
        "on its diagonal.",
        [(KRON, "[R for _ in range(p)]")],
    ),
    Mistake(
        "multiplied",
        "R is multiplied by p: each landmark has its own block R, with the numbers of one landmark.",
        [(KRON, "p * R")],
        [(KRON, "np.kron(np.eye(p), R) * p")],
    ),
    Mistake(
        "diagonal-only",
        "Only the diagonal of R is repeated: its off-diagonal entries belong into each block too.",
        [(KRON, "np.diag(np.tile(np.diag(R), p))")],
    ),
    Mistake(
        "one-number",
        "One number of R is used for all: the two components of a measurement have different variances.",
        [(KRON, "R[0, 0] * np.eye(2 * p)")],
    ),
]


def stack_scenario(id, title, map, *seen, x=X0, **more):
    landmarks = [[name, *SEEN[i]] for name, i in seen]
    call = ["stack", {"landmarks": landmarks}, {"map": map}, x]
    return {"id": id, "title": title, "look": ["seen", "expected"], "calls": [call], **more}


STACK = [
    stack_scenario("one", "one landmark", MAP, (2, 2)),
    stack_scenario("many", "three landmarks, in another order than in the map", MAP, (4, 4), (0, 0), (3, 3)),
    stack_scenario("elsewhere", "two landmarks, a robot elsewhere", MAP, (3, 3), (1, 1), x=[-1.3, 0.2]),
    stack_scenario("third", "two landmarks, another robot", MAP, (2, 2), (4, 4), x=[2.1, -0.4]),
    stack_scenario("names", "landmarks with other names", NAMES, (7, 2), (12, 0), advice=BY_PLACE),
]
REPEAT = [
    {
        "id": f"p{p}",
        "title": f"{p} landmark{'s' * (p > 1)}",
        "look": [""],
        "calls": [["repeat_R", [[0.16, 0.06], [0.06, 0.36]], p]],
    }
    for p in (1, 2, 3)
]

BY_LOOP = """def repeat_R(R, p):
    B = np.zeros((2 * p, 2 * p))
    for j in range(p):
        B[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] = R
    return B
"""

CHECKS = [
    Check(
        "cartesian-stack",
        LAB,
        "stack",
        "function",
        STACK,
        [Right("place in the map", PLACE_IN_MAP), Right("lists", [(RETURN, "return list(seen), list(expected)")])],
        EXPECTED_MISTAKES + STACK_MISTAKES,
        parts={"seen": [XY], "expected": [XY]},
    ),
    Check(
        "cartesian-repeat",
        LAB,
        "repeat_R",
        "function",
        REPEAT,
        [
            Right("loop", BY_LOOP),
            Right("block_diag", [(KRON, "__import__('scipy.linalg').linalg.block_diag(*[R] * p)")]),
        ],
        REPEAT_MISTAKES,
        parts={"": [XY, XY]},
    ),
]
