"""Lab 1: the Kalman filter with Cartesian measurements."""

from labkit.instructor.authoring.spec import Check, Mistake, Parts, Right

from .cartesian_parts import BY_PLACE, EXPECTED_MISTAKES, FIND, LAB, MAP, NAMES, PLACE_IN_MAP, SEEN
from .in_predict import CONSTRUCTOR, PREDICT
from .in_update import FORMS, JOSEPH, SHORT, K, P, update_mistakes
from .inputs import FLOAT32, IN_PLACE, drive, first_scenarios, gated, update_scenarios, with_update
from .probes import WEIGHTS, XY_MAP, drawn, probing

R = [[0.04, 0.02], [0.02, 0.09]]
BLOCKS, H = "repeat_R(self.R, p)", "np.tile(-np.eye(2), (p, 1))"


scenario = update_scenarios(R, SEEN, MAP)
SCENARIOS = [
    *first_scenarios(R, MAP),
    scenario("one", "update with one landmark", [2]),
    scenario("two", "update with two landmarks", [3, 1]),
    scenario("four", "update with four landmarks, in another order than in the map", [4, 0, 3, 2]),
    scenario("twice", "two updates, one after the other, dt = 0.5 s", [4], [1, 0], dt=0.5),
    drive(R, "xy", seed=16),
    scenario("names", "landmarks with other names", [(12, 0), (7, 2), (3, 1)], map=NAMES, advice=BY_PLACE),
    gated(R, MAP, (MAP[0][0], [30.0, -20.0])),
]

# A sequential update, one landmark after the other.
ONE = "H = -np.eye(2)\nfor lm in y:\n    k = self.map[self.map.index(lm)].p\n"
STEP = """    S = H @ self.Pk_k @ H.T + self.R
    K = self.Pk_k @ H.T @ np.linalg.inv(S)
    self.xk_k = self.xk_k + K @ (lm.p - (k - self.xk_k))
    self.Pk_k = (np.eye(2) - K @ H) @ self.Pk_k
"""
MAP_ORDER = "H = -np.eye(2)\nfor lm, k in [(y[y.index(k)], k.p) for k in self.map if k in y]:\n"
INFORMATION = """
I = np.linalg.inv(self.R)
places = [next(k for k in self.map if k == lm).p - lm.p for lm in y]
A = np.linalg.inv(self.Pk_k) + len(y) * I
b = np.linalg.inv(self.Pk_k) @ self.xk_k + I @ sum(places)
self.Pk_k = np.linalg.inv(A)
self.xk_k = self.Pk_k @ b
"""
MEAN = """
nu = sum(lm.p - (self.map[self.map.index(lm)] - self.xk_k) for lm in y) / len(y)
S = self.Pk_k + self.R / len(y)
K = -self.Pk_k @ np.linalg.inv(S)
self.xk_k = self.xk_k + K @ nu
self.Pk_k = self.Pk_k - K @ S @ K.T
"""
LOOPS = """
S = np.zeros((2 * len(y), 2 * len(y)))
H = np.zeros((2 * len(y), 2))
nu = np.zeros((2 * len(y), 1))
for j, lm in enumerate(y):
    for k in self.map:
        if k.id == lm.id:
            nu[2 * j] = lm.p[0] - (k.p[0] - self.xk_k[0])
            nu[2 * j + 1] = lm.p[1] - (k.p[1] - self.xk_k[1])
    H[2 * j, 0] = H[2 * j + 1, 1] = -1
    S[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] = self.R
S += H.dot(self.Pk_k).dot(H.T)
K = self.Pk_k.dot(H.T).dot(np.linalg.inv(S))
self.xk_k = self.xk_k + (K.dot(nu)).flatten()
self.Pk_k = self.Pk_k - K.dot(H).dot(self.Pk_k)
"""
OLD_P = "P = self.Pk_k\n" + ONE + STEP.replace("H @ self.Pk_k", "H @ P").replace("= self.Pk_k", "= P")

RIGHT = [
    Right("inverse", [(K, "K = self.Pk_k @ H.T @ np.linalg.inv(S)"), (P, SHORT)]),
    Right("pinv", [(K, "K = np.dot(np.dot(self.Pk_k, H.T), np.linalg.pinv(S))")]),
    Right("joseph", [(P, JOSEPH.format(BLOCKS))]),
    Right("both signs", [("seen - expected", "expected - seen"), ("-np.eye(2)", "np.eye(2)")]),
    Right("information form", with_update(INFORMATION)),
    Right("sequential", with_update(ONE + STEP)),
    Right("map order", with_update(MAP_ORDER + STEP)),
    Right("mean of the innovations", with_update(MEAN)),
    Right("float32", FLOAT32),
    Right("in place", IN_PLACE),
    Right("loops and columns", with_update(LOOPS)),
    Right("place in the map", PLACE_IN_MAP),
    *(Right(id, form) for id, form in FORMS.items()),
    Right("last first", with_update((ONE + STEP).replace("in y:", "in y[::-1]:")), other=True),
]

MISTAKES = [
    Mistake(
        "sign",
        "The correction points the wrong way: the innovation is what was seen minus what was expected, "
        "and H is the derivative of landmark minus robot, so -I for each landmark. One of the two has the "
        "other sign.",
        [("seen - expected", "expected - seen")],
        [(H, H.replace("-np", "np"))],
    ),
    Mistake(
        "reversed-twice",
        "Expected measurement and H are both those of robot minus landmark; the robot measures landmark minus robot.",
        [(FIND, "x - m[m.index(lm)] for lm in y"), (H, H.replace("-np", "np"))],
    ),
    Mistake(
        "seen-only",
        "The innovation is what was seen: subtract what the map predicts from the estimated position.",
        [("seen - expected", "seen")],
    ),
    Mistake(
        "map-forgotten",
        "The innovation compares what was seen with the robot's position: the place of the "
        "landmark in the map is missing.",
        [("seen - expected", "seen - np.tile(self.xk_k, p)")],
    ),
    Mistake(
        "mean-innovation",
        "All landmarks together count as much as one. Where innovations are averaged, R of their mean is R / p; "
        "where they are stacked, R stands on the diagonal only.",
        with_update(MEAN.replace("self.R / len(y)", "self.R")),
    ),
    Mistake(
        "sum-innovation",
        "The innovations of all landmarks are added up as if they were one measurement.",
        with_update(MEAN.replace(" / len(y)", "")),
    ),
    Mistake(
        "old-innovation",
        "The landmarks are used one after the other, but all innovations come from the "
        "estimate before the first: compute each from the newest estimate.",
        with_update("x = self.xk_k\n" + ONE + STEP.replace("k - self.xk_k", "k - x")),
    ),
    Mistake(
        "old-covariance",
        "The landmarks are used one after the other, but all with the covariance from before "
        "the first: update Pk_k with each landmark.",
        with_update(ONE + STEP.replace("    self.Pk_k =", "self.Pk_k =")),
        with_update(OLD_P),
    ),
]

CHECKS = [
    Check(
        "cartesian-kf",
        LAB,
        "KF",
        "filter",
        SCENARIOS,
        RIGHT,
        CONSTRUCTOR
        + PREDICT
        + EXPECTED_MISTAKES
        + MISTAKES
        + update_mistakes(BLOCKS, H, "-np.eye(2)", "np.tile(-np.eye(2), (1, p))"),
        probing("xy", R, XY_MAP),
        divided=Parts(WEIGHTS, drawn("xy", R, XY_MAP)),
    )
]
