"""The figures that the labs print do not depend on what the processor can do."""

import pytest

from helpers.printed import printed, stored, units
from helpers.reference import LABS, ROOT


@pytest.mark.slow
@pytest.mark.skipif(not units(), reason="numpy uses nothing of this processor that another could lack")
@pytest.mark.parametrize("lab", LABS)
def test_a_solution_prints_what_it_printed_also_on_a_processor_without_vector_units(lab):
    notebook = ROOT / "solutions" / f"{lab}.ipynb"
    now, then = printed(notebook, without=units()), stored(notebook)
    assert now.keys() == then.keys()
    assert {id: (text, now[id]) for id, text in then.items() if text != now[id]} == {}
