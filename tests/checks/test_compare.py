"""Comparison of what came with what is right: nothing short, long or empty is the same."""

import numpy as np
import pytest

from labkit.checks.compare import gap
from labkit.checks.trace import OddResultError, Trace, as_value

RIGHT = [[[[1.0, 2.0], 3.0], [[1.0, 2.0], 4.0]], None]
WHOLE = [[np.array([1.0, 2.0]), np.array(3.0)], [np.array([1.0, 2.0]), np.array(4.0)]]


def test_the_same_is_the_same():
    assert gap(Trace(WHOLE), RIGHT) == 0


@pytest.mark.parametrize(
    "steps",
    [[], WHOLE[:1], [[], []], [step[:1] for step in WHOLE], [[*step, step[0]] for step in WHOLE], [*WHOLE, WHOLE[0]]],
)
def test_what_is_shorter_or_longer_is_not(steps):
    assert gap(Trace(steps), RIGHT) == np.inf


def test_a_result_whose_axes_grow_with_each_step_is_told_as_that():
    with pytest.raises(OddResultError, match="xk_k is an array with 9 axes"):
        as_value(np.zeros((1,) * 9), "xk_k")
