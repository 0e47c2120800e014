"""Hidden checks let right filters of other kinds pass: with a gate of their own, with landmarks in any order."""

import numpy as np
import pytest

from labkit.checks import CheckError
from labkit.instructor.authoring.spec import build
from labkit.instructor.exam import bite
from labkit.instructor.exam.runs import believable_log

from helpers.right_forms import GATED, IN_ORDER

LAB3 = "03_range_bearing_ekf"
OLD = IN_ORDER.format("y").replace("for lm", "x = self.xk_k\n        for lm", 1).replace("h(self.xk_k, k)", "h(x, k)")


@pytest.fixture(scope="module")
def passes():
    """A function: whether a form of lab 3's filter passes the hidden check with this id, on one draw."""
    names = bite.room(LAB3)
    exam = names["exam"]
    cells = {cell.id: cell for cell in bite._hidden(LAB3)}

    def look(form, id, place=0):
        exam.current, exam.place = id, place
        try:
            exec(cells[id].source, {**names, "KF": build(exam._source, form, "KF")})
        except CheckError:
            return False
        return True

    return look


@pytest.mark.parametrize("place", [1, 3])
def test_any_order_of_landmarks_is_right(passes, place):
    assert passes(IN_ORDER.format("sorted(y, key=lambda lm: lm.p[1])"), "grade-west", place)


def test_one_after_the_other_from_the_estimate_before_them_all_is_not(passes):
    assert not passes(OLD, "grade-west")


@pytest.mark.parametrize("beyond", [9, 25])
def test_a_gate_of_ones_own_is_right(passes, beyond):
    assert passes(GATED.format(f"nu @ np.linalg.inv(S) @ nu > {beyond}"), "grade-other-map", 3)


def test_what_lies_far_off_is_measured_without_noise(passes):
    names = bite.room(LAB3)
    log = names["drive"](np.random.default_rng(5), 20)
    seen = believable_log(names["exam"].right("KF")[0], log, {})
    changed = (seen.seen != log.seen).any(axis=1)
    assert len(seen.seen) == len(log.seen) and 0 < changed.sum() < 0.1 * len(changed)
