"""A mistake that nobody listed is found by probing: the quantity that is wrong, and nothing that is not so."""

import pytest
from checks.test_checks import failure

LAB1, LAB3 = "cartesian-kf", "range-bearing-kf"
S1, S3 = "S = H @ self.Pk_k @ H.T + repeat_R(self.R, p)", "S = H @ self.Pk_k @ H.T + np.kron(np.eye(p), self.R)"
GAIN, X, P = (
    "K = np.linalg.solve(S, H @ self.Pk_k).T",
    "self.xk_k + K @ innovation",
    "self.Pk_k = self.Pk_k - K @ S @ K.T",
)
ROWS = "[[-dx / r, -dy / r], [dy / r**2, -dx / r**2]]"

# What is changed in the solution, and what must be said of it.
UNLISTED = [
    (
        LAB1,
        [("self.dt * u", "1.5 * self.dt * u")],
        "moves xk_k by [0.225, -0.3375], right is [0.15, -0.225] (1.5 times",
    ),
    (LAB1, [("+ self.Q", "+ 3 * self.Q")], "What `predict` adds to Pk_k acts as [[0.06, 0.0225]"),
    (LAB1, [("repeat_R(self.R, p)", "np.diag([0.16, 0.36] * p)")], "`self.R` has no effect: in its place stands"),
    (LAB1, [("repeat_R(self.R, p)", "repeat_R(2 * self.R, p)")], "R, as it stands in S, acts as [[0.32, 0.16]"),
    (LAB1, [(X, X.replace("K", "1.1 * K"))], "Pk_k comes out right, so H and R are; the correction is not what"),
    (LAB3, [(ROWS, "[[-2 * dx / r, -2 * dy / r], [dy / r**2, -dx / r**2]]")], "that of the range acts as"),
    (LAB3, [(ROWS, "[[-dx / r, -dy / r], [dy / r**2, dx / r**2]]")], "One entry of the bearing row has the wrong sign"),
    (LAB3, [(ROWS, "[[-dx / r, -dy / r], [-1 / r**2, 1 / r**2]]")], "that of the bearing acts as"),
    (
        LAB3,
        [("innovation[1::2] = wrap(innovation[1::2])", "innovation[1::2] = np.arctan(np.tan(innovation[1::2]))")],
        "half a turn is lost, as with arctan",
    ),
    (
        LAB3,
        [
            ("lm.p - h(self.xk_k, k)", "(lm.p - h(self.xk_k, k)) % [99, 2 * np.pi]"),
            ("= wrap(innovation[1::2])", "= innovation[1::2]"),
        ],
        "The bearing innovation is wrapped into [0, 2 pi)",
    ),
    (
        LAB3,
        [("[self.map[self.map.index(lm)] for lm in y]", "[self.map[0] for lm in y]")],
        "what is expected of landmark 3 is that of landmark 7",
    ),
    (LAB3, [("h(self.xk_k, k) for", "h(self.xk_k, k) + [0.1, 0] for")], "(the bearing is right)"),
    ("legged-ekf", [("A @ P @ A.T + W", "2 * A @ P @ A.T + W")], "of that, what is kept acts as"),
    ("legged-ekf", [("np.diag(np.square(sigmas))", "7 * np.diag(np.square(sigmas))")], "R, as it stands in S, acts as"),
    (
        "team-reading",
        [("[-dx / rho, -dy / rho, 0]", "[-dx / rho, dy / rho, 0]")],
        "the row of the bearing is right; that of the range",
    ),
    (
        "team-reading",
        [("S = H @ self.P @ H.T + np.diag(sigma**2)", "S = H @ self.P @ H.T + np.diag(3 * sigma**2)")],
        "R, as it",
    ),
    ("team-ekf", [("self.inflate * sigma**2", "sigma**2")], "inflate"),
    (LAB1, [(P, "self.Pk_k = self.Pk_k - K @ S @ K.T - np.eye(2)")], "negative variances"),
]


@pytest.mark.parametrize("name, form, says", UNLISTED)
def test_what_nobody_listed_is_found(name, form, says):
    text = " ".join(str(failure(name, form)).split())
    assert says in text
    assert "Perhaps" not in text and "times the expected value" not in text


def test_what_is_right_comes_first():
    text = failure(LAB3, [(S3, S3.replace("self.R", "3 * self.R"))]).summary
    assert text.startswith("`predict`, what is expected and H are right; R, as it stands in S, acts as")


def test_the_second_mistake_is_told_and_what_only_follows_is_not():
    error = failure(LAB1, [("+ self.Q", "+ 3 * self.Q"), (S1, S1.replace("self.R", "2 * self.R"))])
    assert error.summary.startswith("What `predict` adds to Pk_k acts as")
    assert sum(line.startswith("Also:") for line in error.details) == 1
    assert "Also: R, as it stands in S, acts as" in " ".join(error.details)


def test_a_wrong_constructor_hides_nothing_of_what_comes_after():
    text = " ".join(str(failure(LAB1, [("np.array(P0, dtype=float)", "np.eye(2)"), ("+ self.Q", "- self.Q")])).split())
    assert "does not start with P0" in text and "`predict` subtracts Q" in text


def test_a_filter_whose_function_is_wrong_sends_there_first():
    error = failure(LAB3, [(ROWS, "[[-2 * dx / r, -2 * dy / r], [dy / r**2, -dx / r**2]]")])
    assert error.details[0].startswith("First mend `jacobian`:")
    text = " ".join(str(error).split())
    assert text.index("acts as") < text.index("First mend") < text.index(" expected xk_k")
    assert "First mend" not in str(failure(LAB3, [(X, X.replace("K", "1.1 * K"))]))


@pytest.mark.parametrize(
    "old, new", [("K = np.linalg.solve", "K = 0.5 * np.linalg.solve"), (S1, f"{S1}\n        S = 2 * S")]
)
def test_a_scaled_gain_is_told_as_that_and_nothing_else(old, new):
    error = failure(LAB1, [(old, new)])
    assert "the gain acts as 0.5 times what it should be (or S as 2 times)" in error.summary
    assert not any(line.startswith("Also:") for line in error.details)


WRAP, ROW = "innovation[1::2] = wrap(innovation[1::2])", "[-dx / r, -dy / r]"
SEEN_BY_OTHERS = [  # slips of public filters and of students
    (LAB1, [(GAIN, "K = self.Pk_k @ H.T / S")], "divided by S entry by entry"),
    (LAB1, [("repeat_R(self.R, p)", "np.diag([0.16, 0.36] * p)")], "`self.R` has no effect"),
    (LAB3, [(WRAP, "innovation[1::2] = innovation[1::2] % (2 * np.pi)")], "wrapped into [0, 2 pi)"),
    (
        LAB3,
        [(WRAP, "n = innovation[1::2]\n        innovation[1::2] = np.arctan(np.sin(n) / np.cos(n))")],
        "half a turn",
    ),
    (LAB3, [(ROW, "[-dx / (2 * r), -dy / (2 * r)]")], "that of the range acts as"),
    (LAB3, [(ROW, "[-dx / r, dy / r]")], "that of the range acts as"),
    (LAB1, [("m[m.index(lm)] - x for lm in y", "m[m.index(lm)].p + x for lm in y")], "landmark plus robot"),
]


@pytest.mark.parametrize("name, form, says", SEEN_BY_OTHERS)
def test_what_public_filters_do_wrong_is_told(name, form, says):
    assert says in " ".join(str(failure(name, form)).split())


PAIRS = [
    (LAB1, [(S1, S1.replace("self.R", "2 * self.R")), (GAIN, "K = self.Pk_k @ H.T @ S")], "S is not inverted"),
    (LAB1, [(S1, S1.replace("self.R", "2 * self.R")), (X, X.replace("@", "*"))], "`*` multiplies"),
    (LAB3, [(ROWS, ROWS.replace("r**2", "r")), (X, X.replace("K", "2 * K"))], "divided by r: it must be"),
]


@pytest.mark.parametrize("name, form, says", PAIRS)
def test_two_mistakes_in_one_update_are_told_apart(name, form, says):
    assert says in " ".join(str(failure(name, form)).split())
