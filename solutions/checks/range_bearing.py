"""Lab 3: the extended Kalman filter with ranges and bearings."""

from itertools import permutations

from labkit.instructor.authoring.spec import Check, Mistake, Parts, Right

from .in_predict import CONSTRUCTOR, PREDICT
from .in_update import FORMS, JOSEPH, SHORT, K, P, update_mistakes
from .inputs import FLOAT32, IN_PLACE, drive, first_scenarios, gated, update_scenarios, with_update
from .probes import RB_MAP, WEIGHTS, drawn, probing
from .range_bearing_parts import CENTRAL, FORWARD, H_LINES, H_MISTAKES, J_LINES, JACOBIAN_MISTAKES, LAB, MAP, MATH, ROWS

R = [[0.04, 0.006], [0.006, 0.0076]]
SEEN = {
    0: [2.75, 1.05],
    1: [3.2, 2.5],
    2: [2.6, -3.08],
    3: [1.8, -2.15],
    4: [8.1, 0.6],
    5: [2.15, 1.69],
    6: [2.9, 0.0],
    7: [2.75, -1.0],
}
NAMES = [[12, 1.5, 2.0], [3, -2.2, 0.9], [7, -2.4, -0.6], [25, -0.5, -2.5]]  # ids are no places in this list


scenario = update_scenarios(R, SEEN, MAP)
SCENARIOS = [
    *first_scenarios(R, MAP),
    scenario("one", "update with one landmark", [0]),
    scenario("behind", "update with a landmark behind the robot (third quadrant)", [3]),
    scenario("axis", "update with a landmark straight above the robot", [5]),
    scenario("back", "a bearing that crosses from pi to -pi", [2]),
    scenario("turned", "a bearing that is more than a quarter turn off", [(0, 7)], R=[[0.04, 0.006], [0.006, 0.3]]),
    scenario("east", "a landmark due east", [6], map=[*MAP, [6, 2.4, -0.7]]),
    scenario("far", "a landmark much farther away than expected", [4], R=[[0.7, 0.006], [0.006, 0.0076]]),
    scenario("two", "update with two landmarks", [1, 0]),
    scenario("west", "two landmarks, the first of them across pi", [2, 0]),
    scenario("three", "update with three landmarks, in another order than in the map", [3, 0, 2]),
    scenario("twice", "two updates, one after the other, dt = 0.5 s", [0], [3, 1], dt=0.5),
    scenario("names", "landmarks whose ids are not their places in the map", [(12, 0), (25, 3), (3, 1)], map=NAMES),
    drive(R, "rb", seed=88, most=1),  # of several, the order would count
    gated(R, MAP, (0, [30.0, 1.2])),
]

# A sequential update, one landmark after the other.
ONE = "for lm in y:\n    k = self.map[self.map.index(lm)]\n"
IN_ORDER = "[*(y[i] for i in {} if i < len(y)), *y[3:]]"
MAP_ORDER = "for lm, k in [(y[y.index(k)], k) for k in self.map if k in y]:\n"
STEP = """    H = jacobian(self.xk_k, k)
    S = H @ self.Pk_k @ H.T + self.R
    K = self.Pk_k @ H.T @ np.linalg.inv(S)
    nu = lm.p - h(self.xk_k, k)
    nu[1] = wrap(nu[1])
    self.xk_k = self.xk_k + K @ nu
    self.Pk_k = (np.eye(2) - K @ H) @ self.Pk_k
"""
WRAP = "innovation[1::2] = wrap(innovation[1::2])"
FIND = "self.map[self.map.index(lm)]"
BLOCKS = "np.kron(np.eye(p), self.R)"
H = "np.vstack([jacobian(self.xk_k, k) for k in known])"
HX, SEEN_HX = "h(self.xk_k, k) for lm, k in zip(y, known)", "h(self.xk_k, lm) for lm in y"
SEEN_H = "np.vstack([jacobian(self.xk_k, lm) for lm in y])"
INFORMATION = """
A, b = np.linalg.inv(self.Pk_k), np.zeros(2)
for lm in y:
    k = next(k for k in self.map if k == lm)
    H, nu = jacobian(self.xk_k, k), lm.p - h(self.xk_k, k)
    nu[1] = np.arctan2(np.sin(nu[1]), np.cos(nu[1]))
    A = A + H.T @ np.linalg.inv(self.R) @ H
    b = b + H.T @ np.linalg.inv(self.R) @ nu
self.Pk_k = np.linalg.inv(A)
self.xk_k = self.xk_k + self.Pk_k @ b
"""
LOOPS = """
n = 2 * len(y)
nu, H, B = np.zeros(n), np.zeros((n, 2)), np.zeros((n, n))
for j, lm in enumerate(y):
    for k in self.map:
        if k.id == lm.id:
            d = k.p - self.xk_k
            q = d[0] ** 2 + d[1] ** 2
            nu[2 * j] = lm.p[0] - q**0.5
            nu[2 * j + 1] = lm.p[1] - np.arctan2(d[1], d[0])
            while nu[2 * j + 1] > np.pi:
                nu[2 * j + 1] -= 2 * np.pi
            while nu[2 * j + 1] < -np.pi:
                nu[2 * j + 1] += 2 * np.pi
            H[2 * j] = -d / q**0.5
            H[2 * j + 1] = d[1] / q, -d[0] / q
    B[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] = self.R
K = self.Pk_k @ H.T @ np.linalg.inv(H @ self.Pk_k @ H.T + B)
self.xk_k += K @ nu
self.Pk_k -= K @ H @ self.Pk_k
"""
CARTESIAN = """def wrap(a):
    return a

def h(x, k):
    return k - x

def jacobian(x, k):
    return -np.eye(2)

"""
XY = "Landmark(lm.p[0] * np.array([np.cos(lm.p[1]), np.sin(lm.p[1])]), lm.id)"
NO_WRAP = STEP.replace("nu[1] = wrap(nu[1])", "pass")
OLD_P = "P = self.Pk_k\n" + ONE + STEP.replace("H @ self.Pk_k", "H @ P").replace("= self.Pk_k", "= P")

RIGHT = [
    Right("inverse", [(K, "K = self.Pk_k @ H.T @ np.linalg.inv(S)"), (P, SHORT)]),
    Right("pinv", [(K, "K = np.dot(np.dot(self.Pk_k, H.T), np.linalg.pinv(S))")]),
    Right("joseph", [(P, JOSEPH.format(BLOCKS))]),
    Right("both signs", [("lm.p - h(self.xk_k, k)", "h(self.xk_k, k) - lm.p"), (H, "-" + H)]),
    Right("sequential", with_update(ONE + STEP), other=True),
    Right("map order", with_update(MAP_ORDER + STEP), other=True),
    Right("information form", with_update(INFORMATION)),
    Right("float32", FLOAT32),
    Right("in place", IN_PLACE),
    Right("central differences", CENTRAL),
    Right("forward differences", FORWARD),
    Right("math", MATH),
    Right("positive bearings", [("np.arctan2(dy, dx)", "np.arctan2(dy, dx) % (2 * np.pi)")]),
    Right("loops", with_update(LOOPS)),
    *(Right(id, form) for id, form in FORMS.items()),
    Right("last first", with_update((ONE + STEP).replace("in y:", "in y[::-1]:")), other=True),
    *(
        Right(id, with_update((ONE + STEP).replace("in y:", f"in sorted(y, key=lambda lm: {key}):")), other=True)
        for id, key in {"nearest first": "lm.p[0]", "farthest first": "-lm.p[0]", "by id": "lm.id"}.items()
    ),
    *(  # all orders of up to three, and some of more
        Right(f"order {order}", with_update((ONE + STEP).replace("in y:", f"in {IN_ORDER.format(order)}:")), other=True)
        for order in [*permutations(range(3))][1:]
    ),
    Right(
        "dictionary",
        [
            (FIND, "{k.id: k for k in self.map}[lm.id]"),
            (WRAP, "innovation[1::2] = (innovation[1::2] + np.pi) % (2 * np.pi) - np.pi"),
        ],
    ),
]

MISTAKES = [
    Mistake(
        "not-wrapped",
        "Your bearing innovation is not wrapped: the difference of two bearings can be nearly a "
        "whole turn where the robot is off by a degree. Bring it into (-pi, pi].",
        [(WRAP, "pass")],
        [(WRAP, "y = [wrap(lm.p[1]) for lm in y]")],
        with_update(ONE + NO_WRAP),
        with_update(MAP_ORDER + NO_WRAP),
    ),
    Mistake(
        "second-half-wrapped",
        "The second half of the innovation is wrapped, but bearings and ranges take turns in it: bearings stand at 1, 3, "
        "5 and so on, innovation[1::2].",
        [(WRAP, "innovation[p:] = wrap(innovation[p:])")],
    ),
    Mistake(
        "wrapped-positive",
        "The bearing innovation is wrapped into [0, 2 pi): a small negative one becomes "
        "nearly a whole turn. Bring it into (-pi, pi].",
        [(WRAP, "innovation[1::2] = innovation[1::2] % (2 * np.pi)")],
    ),
    Mistake(
        "all-wrapped",
        "The whole innovation is wrapped, ranges included: only differences of angles are.",
        [(WRAP, "innovation = wrap(innovation)")],
    ),
    Mistake(
        "range-wrapped",
        "The ranges are wrapped instead of the bearings: each landmark has its range first, then its bearing.",
        [(WRAP, "innovation[0::2] = wrap(innovation[0::2])")],
    ),
    Mistake(
        "first-wrapped",
        "Only the first landmark's bearing innovation is wrapped: do it for each landmark.",
        [(WRAP, "innovation[1] = wrap(innovation[1])")],
    ),
    Mistake(
        "absolute",
        "The bearing innovation has lost its sign: it may be negative.",
        [(WRAP, "innovation[1::2] = abs(wrap(innovation[1::2]))")],
    ),
    Mistake(
        "sign",
        "The correction points the wrong way: the innovation is what was seen minus h, and H is the "
        "derivative of h. One of the two has the other sign.",
        [("lm.p - h(self.xk_k, k)", "h(self.xk_k, k) - lm.p")],
        [(ROWS, "[[dx / r, dy / r], [-dy / r**2, dx / r**2]]")],
    ),
    Mistake(
        "reversed-twice",
        "dx and dy point from the landmark to the robot, in h and in its Jacobian: they are landmark minus robot.",
        [(H_LINES, H_LINES.replace("landmark - x", "x - landmark")), (J_LINES, "dx, dy = x - landmark\n    r =")],
    ),
    Mistake(
        "seen-only",
        "The innovation is what was seen; subtract what h predicts from the estimated position.",
        [("lm.p - h(self.xk_k, k)", "lm.p + 0 * self.xk_k")],
    ),
    Mistake(
        "expected-from-seen",
        "What is expected comes from the map, not from the measurement: h and jacobian want "
        "the landmark of the map, not `lm` from `y`.",
        [(HX, SEEN_HX)],
        [(H, SEEN_H)],
        [(HX, SEEN_HX), (H, SEEN_H)],
    ),
    Mistake(
        "r-order",
        "The variances of R are taken in the order (bearing, range): a measurement is (range, bearing).",
        [(BLOCKS, "np.kron(np.eye(p), self.R[::-1, ::-1])")],
    ),
    Mistake(
        "by-place-in-y",
        "The j-th landmark in y is taken for the j-th of the map. y holds only what is in "
        "view, in any order: find each landmark of the map by its name (`==` or `map.index`).",
        [(f"{FIND} for lm in y", "self.map[j] for j in range(p)")],
    ),
    Mistake(
        "map-order",
        "What was seen is in the order of y, what is expected in the order of the map: both need the same order.",
        [(f"{FIND} for lm in y", "k for k in self.map if k in y")],
    ),
    Mistake(
        "id-as-place",
        "A landmark's id is used as its place in the map: ids are names. Find the landmark with `==` or `map.index`.",
        [(FIND, "self.map[lm.id]")],
    ),
    Mistake(
        "h-from-cartesian",
        "H is that of the Cartesian filter, -I for each landmark: this sensor has the Jacobian of range and bearing.",
        [(H, "np.tile(-np.eye(2), (p, 1))")],
    ),
    Mistake(
        "cartesian-filter",
        "This is the Cartesian filter: these measurements are range and bearing, not dx and dy.",
        CARTESIAN,
    ),
    Mistake(
        "to-cartesian",
        "The measurements are turned into dx and dy, but R is still that of range and bearing: "
        "keep range and bearing, and use h and its Jacobian.",
        CARTESIAN + f"class KF(KF):\n    def update(self, y):\n        super().update([{XY} for lm in y])\n",
    ),
    Mistake(
        "same-jacobian",
        "All landmarks get the Jacobian of the first: each has its own two rows in H.",
        [("jacobian(self.xk_k, k) for k in known", "jacobian(self.xk_k, known[0]) for k in known")],
    ),
    Mistake(
        "jacobian-at-seen",
        "The Jacobian is computed from the measurement: it belongs at the estimate, where h is linearised.",
        [(H, f"np.vstack([jacobian(np.zeros(2), {XY}) for lm in y])")],
    ),
    Mistake(
        "old-innovation",
        "The landmarks are used one after the other, but all innovations come from the "
        "estimate before the first: compute each from the newest estimate.",
        with_update("x = self.xk_k\n" + ONE + STEP.replace("h(self.xk_k, k)", "h(x, k)")),
        with_update("x = self.xk_k\n" + ONE + STEP.replace("(self.xk_k, k)", "(x, k)")),
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
        "range-bearing-kf",
        LAB,
        "KF",
        "filter",
        SCENARIOS,
        RIGHT,
        CONSTRUCTOR
        + PREDICT
        + H_MISTAKES
        + JACOBIAN_MISTAKES[2:]  # h-from-cartesian and sign stand for the first
        + MISTAKES
        + update_mistakes(BLOCKS, H, "jacobian(self.xk_k, known[0])", H.replace("vstack", "hstack")),
        probing("rb", R, RB_MAP),
        divided=Parts(WEIGHTS, drawn("rb", R, RB_MAP)),
    )
]
