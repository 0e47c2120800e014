"""What a function gives wrong is told by the number, row or input that is off, whatever the mistake."""

import pytest
from checks.test_checks import failure, subject

from labkit import check

SUM = "np.hypot(dx, dy), np.arctan2(dy, dx)"
S = "S = H @ P @ H.T + np.kron(np.eye(p), R)"
RANGE_BEARING = "[[-dx / r, -dy / r], [dy / r**2, -dx / r**2]]"

CASES = [
    # lab 1
    ("cartesian-stack", "m[m.index(lm)] - x for", "m[m.index(lm)] - 2 * x for", "(too small by `x[0]`)"),
    ("cartesian-repeat", "np.kron(np.eye(p), R)", "np.kron(np.eye(p), R.diagonal() * np.eye(2) * 3)", "on the diagonal"),
    # lab 2
    ("mismatch-nees", "e @ np.linalg.solve(P, e)", "e @ np.linalg.inv(P)", "e stands on both sides"),
    ("mismatch-nees", "e @ np.linalg.solve(P, e)", "3 * e @ np.linalg.solve(P, e)", "(3 times as much)"),
    ("mismatch-verdict", "dof=2, level=0.95, runs=runs", "2, runs", "level must be a probability"),
    ("mismatch-nis", S, S.replace("R)", "R**2)"), 'at "one landmark in view"'),
    # lab 3
    ("range-bearing-h", "np.arctan2(dy, dx)", "np.arccos(dx / np.hypot(dx, dy))", "Entry 2 (bearing)"),
    ("range-bearing-h", "dx, dy = landmark - x\n    return np", "dx, dy = landmark.p + x\n    return np", "right is"),
    ("range-bearing-jacobian", "[[-dx / r, -dy / r]", "[[-dx / r / 2, -dy / r / 2]", "Row 1 (range) of the result"),
    ("range-bearing-jacobian", "[[-dx / r, -dy / r]", "[[-2 * dx / r, -2 * dy / r]", "(2 times as much)"),
    ("range-bearing-jacobian", "[[-dx / r, -dy / r]", "[[dx / r, -dy / r]", "Row 1 (range), column 1 (x)"),
    ("range-bearing-jacobian", "[[-dx / r, -dy / r]", "[[dx / r, -dy / r]", "(the other sign)"),
    ("range-bearing-jacobian", f"np.array({RANGE_BEARING})", f"-np.array({RANGE_BEARING})", "All entries"),
    # lab 4
    ("legged-motion", "wrap(x[2] + u[2])", "x[2] - u[2]", "Entry 3 (heading)"),
    ("legged-motion", "wrap(x[2] + u[2])", "x[2] + u[2]", "not wrapped"),
    ("legged-motion", "s * u[0] + c * u[1]\n    return", "s * u[0]\n    return", "Entry 2 (y) of the result"),
    ("legged-motion-jacobians", "[[1, 0, -s", "[[0, 0, -s", "Row 1 (x), column 1 (x) of `A`"),
    ("legged-motion-jacobians", "[0, 1, c * u[0] - s * u[1]]", "[0, 1, c * u[0]]", "Row 2 (y), column 3 (heading) of `A`"),
    ("legged-motion-jacobians", "[s, c, 0], [0, 0, 1]])\n    return", "[s, c, 0], [0, 0, 2]])\n    return", "column 3 (turn)"),
    ("legged-stack", "noise.of_range(lm) * expected[0]", "noise.of_range(lm) * expected[0]**2", "Row 1 (range), column 1"),
    ("legged-stack", "noise.bearing if lm", "noise.bearing**2 if lm", "Row 2 (bearing), column 2 (bearing)"),
    ("legged-membership", "np.clip((s - away) / (s - c), 0, 1)", "np.clip(h * (s - away) / (s - c), 0, 1)", "phi = "),
    ("legged-membership", "b + (h - b) * np.clip((s - away) / (s - c), 0, 1)", "np.clip(b + (h - b) * (s - away) / (s - c), 0, 1)", "clip it to [0, 1] first"),
    ("legged-spread", "np.sqrt(P[2, 2]) >", "2 * np.sqrt(P[2, 2]) >", '"other limits, a narrow covariance"'),
    ("legged-lost", "np.asarray(d2) > bound", "np.asarray(d2[-1:]) > bound", "Only the last of d2 counts"),
    ("legged-fusion", "e - (sigma", "e - (2 * sigma", "distance = "),
    # the labs of observers
    ("team-mean", "np.arctan2(np.sum(np.sin(angles))", "np.arctan2(-np.sum(np.sin(angles))", "(the other sign)"),
    ("team-circles", "min(found, key=lambda one: one[0])", "found[0]", 'at "an observer to the right of the way"'),
    ("team-circles", "off, o, heading = min(found, key=lambda one: one[0])", "off, o, heading = found[1]; off = 0", "to the right"),
    ("team-h", "dx, dy = p[:2] - o[:2]", "o, p = p, o; dx, dy = p[:2] - o[:2]", "Observer and target have changed places"),
    ("team-jacobians", "[-dy / rho2, dx / rho2, 0]", "[-dy / rho2, 2 * dx / rho2, 0]", "Row 2 (bearing), column 2 (y) of `H_p`"),
    ("team-converted", "[np.cos(alpha), np.sin(alpha)]", "[np.cos(np.deg2rad(alpha)), np.sin(np.deg2rad(alpha))]", "acts as"),
    ("team-circles", "return np.array([o[0], o[1], heading])", "UNKNOWN[:] = *o, heading; return UNKNOWN", "stands outside"),
    ("team-steer", "speed < 0.01", "speed < 0.1", 'at "slow, but faster than 0.01 m/s"; it is right elsewhere'),
    ("team-weigh", "return w / np.sum(w)", "return w / np.sum(np.exp(np.min(misfits) / 2 - misfits / 2))", "sum up to 1"),
    ("team-weigh", "np.min(misfits)", "np.mean(misfits)", "subtract the *smallest* misfit"),
    ("team-force", "(1 / rho - 1 / rho_0) / rho**2 * (me", "(1 / rho - 1 / rho_0) * (me", "divided by rho squared"),
]  # fmt: skip


@pytest.mark.parametrize("name, old, new, says", CASES)
def test_what_is_off_is_told(name, old, new, says):
    error = failure(name, [(old, new)])
    text = " ".join(str(error).split())
    assert says in text
    assert "Perhaps" not in text and "times the expected" not in text


TWO = [
    (
        "legged-motion",
        [("c * u[0] - s * u[1], s", "c * u[0] - 3 * s * u[1], s"), ("wrap(x[2] + u[2])", "x[2] + u[2]")],
        "Entry 1 (x) of the result acts as",
        "not wrapped",
    ),
    (
        "range-bearing-jacobian",
        [("[[-dx / r, -dy / r]", "[[-2 * dx / r, -2 * dy / r]"), ("[dy / r**2, -dx / r**2]", "[dy / r**2, dx / r**2]")],
        "(2 times as much)",
        "One entry of the bearing row has the wrong sign",
    ),
]


@pytest.mark.parametrize("name, form, first, second", TWO)
def test_a_second_number_that_is_off_has_a_line_of_its_own(name, form, first, second):
    error = failure(name, form)
    told = [error.summary, *" ".join(error.details).split("Also: ")[1:]]
    assert any(first in one for one in told) and any(second in one for one in told) and len(told) == 2


def test_what_holds_at_all_inputs_is_told_and_what_does_not_is_not():
    """A factor between two numbers of a single input says nothing."""
    text = str(failure("mismatch-nees", [("e @ np.linalg.solve(P, e)", "e @ e / np.linalg.det(P)")]))
    assert "as much" not in text and "too large" not in text
    text = " ".join(str(failure("legged-motion", [("x[0] + dx", "dx")])).split())
    assert "too small by `x[0]`" in text


def test_two_known_mistakes_that_meet_in_one_number_are_both_told():
    error = failure("mismatch-nees", [("truth - x", "truth + x"), ("e @ np", "2 * e @ np")])
    assert "added" in error.summary
    pair = [("truth - x", "truth + x"), ("e @ np.linalg.solve(P, e)", "np.sqrt(e @ np.linalg.solve(P, e))")]
    text = " ".join(str(failure("mismatch-nees", pair)).split())
    assert "here the two are added" in text and "The square root is too much" in text


def test_where_it_is_right_is_told_too():
    text = " ".join(str(failure("mismatch-verdict", [("mean_nees > high", "mean_nees > 9")])).split())
    assert "The result is 'consistent', right is 'overconfident' at `verdict(8.5, 50)`" in text


def test_an_angle_may_be_a_whole_turn_on(capsys):
    check("team-circles", subject("team-circles", [("heading])", "heading + 2 * np.pi])")]))
    assert "passed" in capsys.readouterr().out


def test_what_is_right_at_one_input_is_not_said_of_another():
    text = " ".join(str(failure("team-force", [("    return F\n", "        return F\n")])).split())
    assert 'right is [1.992, 0.1498] at "two robots near"; it is off at "other constants" too, right elsewhere' in text
