"""Mistakes that nobody listed, in the filters with poses (labs 4 and 6): the quantity that is wrong is told."""

import pytest
from checks.test_checks import failure

LEGGED, PAPER, GROUP = "legged-ekf", "team-reading", "team-ekf"
D2 = "self.d2.append(nu[block] @ np.linalg.solve(S[block, block], nu[block]))"
KEEP = "keep = np.repeat(np.array(self.d2) < self.gate, 2)"
D2_TEAM = "self.d2.append(nu @ np.linalg.solve(S, nu))"

# What is changed in the solution, and what must be said of it.
UNLISTED = [
    (LEGGED, [(D2, D2.replace("S[block, block]", "(S - R)[block, block]"))], "R is missing in the S that it takes"),
    (LEGGED, [(D2, "self.d2.append(nu[i] ** 2 / S[i, i])")], "only the range counts"),
    (LEGGED, [(KEEP, KEEP.replace("self.gate", "5.99"))], "whatever the gate is: compare with `self.gate`"),
    (LEGGED, [("R = stack(y, self.map,", "R = stack(y[:1], self.map,")], "two in view `self.d2` holds one number"),
    (
        LEGGED,
        [("else noise.bearing_partial)", "else 2 * noise.bearing)")],
        "R, as it stands in S, for what is cut off, acts",
    ),
    (LEGGED, [(KEEP, "keep = nu**2 / np.diag(S) < self.gate")], "is let pass, but not both of its numbers"),
    (LEGGED, [("K @ R @ K.T", "K @ S @ K.T")], "comes out as P - K R K', as if R and S had changed places"),
    (
        LEGGED,
        [("I_KH @ self.Pk_k @ I_KH.T", "I_KH @ self.Pk_k")],
        "comes out as (I - K H) P + K R K', or P - K H P H' K'",
    ),
    (LEGGED, [(KEEP, KEEP.replace("repeat", "tile"))], "when something beyond the gate is in view"),
    (LEGGED, [("noise.of_range(lm) * expected[0]", "noise.of_range(lm) * lm.p[0]")], "R belongs to the expected one"),
    (
        LEGGED,
        [("H.append(jacobian(x, known))", "H.append(jacobian(x, known) * [1, 1, 0])")],
        "that of the bearing acts as",
    ),
    (
        PAPER,
        [("noise.of_bearing(expected[0])])\n            S", "noise.bearing])\n            S")],
        "R, as it stands in S, acts as",
    ),
    (PAPER, [("of_bearing(expected[0])])", "of_bearing(z[0])])")], "R belongs to the expected one"),
    ("team-predict", [("turn @ u[0, :2]", "turn.T @ u[0, :2]")], "is turned the wrong way"),
    (PAPER, [(D2_TEAM, "self.d2.append(nu @ np.linalg.solve(np.diag(sigma**2), nu))")], "R in the place of S"),
    (PAPER, [(D2_TEAM, "self.d2.append(nu[1] ** 2 / S[1, 1])")], "only the bearing counts"),
    (PAPER, [("self.d2[-1] < self.gate", "self.d2[-1] > self.gate")], "it is the wrong way round"),
]


@pytest.mark.parametrize("name, form, says", UNLISTED)
def test_what_nobody_listed_is_found(name, form, says):
    text = " ".join(str(failure(name, form)).split())
    assert says in text
    assert "Perhaps" not in text and "times the expected value" not in text


def test_d2_that_is_that_of_a_wrong_S_is_no_second_mistake():
    text = str(failure(LEGGED, [("np.diag(np.square(sigmas))", "7 * np.diag(np.square(sigmas))")]))
    assert "R, as it stands in S, acts as" in text and "`self.d2`" not in text and "gate" not in text


def test_the_numbers_shown_are_those_that_the_text_asks_for():
    block = ("np.linalg.solve(S[block, block], nu[block])", "np.linalg.inv(S)[block, block] @ nu[block]")
    text = str(failure(LEGGED, [block]))
    assert "xk_k" not in text.split("  expected")[1] and "times the expected" not in text


def test_a_landmark_that_is_taken_for_another_leaves_h_untold():
    text = str(failure(LEGGED, [("known = m[m.index(lm)]", "known = m[len(nu)]")]))
    assert "that of landmark" in text and "H are right" not in text


def test_a_gate_and_what_comes_after_it_are_told_both():
    form = [(KEEP, KEEP.replace("self.gate", "5.99")), ("self.xk_k[2] = wrap(self.xk_k[2])", "pass")]
    text = " ".join(str(failure(LEGGED, form)).split())
    assert text.index("compare with `self.gate`") < text.index("Also: After the update the heading is outside")


def test_a_heading_that_is_not_wrapped_is_told_beside_another_mistake():
    wrap = "                self.x[:, 2] = wrap(self.x[:, 2])\n"
    text = " ".join(str(failure(PAPER, [(wrap, ""), ("+ np.diag(sigma**2)", "+ 3 * np.diag(sigma**2)")])).split())
    assert "R, as it stands in S, acts as" in text and "Also: A heading is outside (-pi, pi] after update" in text


def test_what_follows_from_the_first_reading_is_no_second_mistake():
    text = " ".join(str(failure("team-reading", [("K @ S @ K.T", "K @ K.T")])).split())
    assert "it is P - K S K'" in text and "Also" not in text and "stacked" not in text


def test_a_part_that_two_known_mistakes_share_is_told_as_neither_where_the_rest_is_hidden():
    mixed = ("for i, j, z in seen:", "for j, i, z in seen:")
    unknown, known = "(K @ nu)[::-1].reshape(-1, 3)", "(K @ nu).reshape(3, -1).T"
    text = " ".join(str(failure(PAPER, [mixed, ("(K @ nu).reshape(-1, 3)", unknown)])).split())
    assert "the expected bearing of the reading (1, 0)" in text and "changed places in h" not in text
    text = " ".join(str(failure(PAPER, [mixed, ("(K @ nu).reshape(-1, 3)", known)])).split())  # what comes of both
    assert "Observer and target are mixed up" in text and "Also: K nu is cut up the wrong way" in text
