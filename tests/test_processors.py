"""The figures that the labs print do not depend on what the processor can do."""

import pytest

from helpers.printed import printed, stored, units
from helpers.reference import LABS, ROOT, ci_only

pytestmark = pytest.mark.slow


def differences(lab, without):
    notebook = ROOT / "solutions" / f"{lab}.ipynb"
    now, then = printed(notebook, without), stored(notebook)
    assert now.keys() == then.keys()
    return {id: (text, now[id]) for id, text in then.items() if text != now[id]}


@ci_only
@pytest.mark.skipif(not units(), reason="numpy uses nothing of this processor that another could lack")
@pytest.mark.parametrize("lab", LABS[::-1])  # the longest first
def test_a_solution_prints_what_it_printed_also_on_a_processor_without_vector_units(lab):
    assert differences(lab, without=units()) == {}


OTHERS = [lab for lab in LABS if lab not in (LABS[0], LABS[2])]  # these two run in Jupyter's kernel, in test_labs


@pytest.mark.parametrize("lab", OTHERS)
def test_a_solution_prints_what_it_printed(lab):
    assert differences(lab, without=()) == {}
