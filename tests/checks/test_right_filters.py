"""Right filters of other kinds pass, with a note where a student should know what the filter does."""

import pytest
from checks.test_checks import subject

from labkit.checks import check

from helpers.right_forms import GATED, GATED_XY, IN_ORDER

ORDERS = [
    "sorted(y, key=lambda lm: lm.p[1])",
    "sorted(y, key=lambda lm: np.hypot(*(self.map[self.map.index(lm)] - self.xk_k)))",
]
GATES = [
    "nu @ np.linalg.inv(S) @ nu > 25",
    "nu @ np.linalg.inv(S) @ nu > 9",
    "(abs(nu) > 3 * np.sqrt(np.diag(S))).any()",
]


@pytest.mark.parametrize("order", ORDERS)
def test_landmarks_one_after_the_other_in_any_order(order, capsys):
    check("range-bearing-kf", subject("range-bearing-kf", IN_ORDER.format(order)))
    assert "Note" not in capsys.readouterr().out


@pytest.mark.parametrize("gate", GATES)
@pytest.mark.parametrize("name, form", [("cartesian-kf", GATED_XY), ("range-bearing-kf", GATED)])
def test_a_gate_of_ones_own_passes_with_a_note(name, form, gate, capsys):
    check(name, subject(name, form.format(gate)))
    assert "Note: Your filter leaves out a measurement that is very far" in capsys.readouterr().out
