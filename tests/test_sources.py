"""The page that says where everything of the sources stands: no cell of it is gone, and it is up to date."""

import sys

import pytest

from helpers.reference import ROOT

sys.path.insert(0, str(ROOT / "docs"))

import sources


def test_every_item_has_its_cell_and_the_page_is_up_to_date():
    assert list(sources.problems(sources.load())) == []
    assert sources.PAGE.read_text("utf-8") == sources.page(sources.load()), "python docs/sources.py writes it anew"


def test_a_cell_that_is_gone_is_told():
    item = {"item": "Q9", "what": "more", "lab": "01_cartesian_ekf", "phrase": "### Question Q9"}
    gone = {"handout": {"title": "A handout", "items": [item]}}
    assert list(sources.problems(gone)) == ["handout, Q9: '### Question Q9' stands in 0 cells of 01_cartesian_ekf"]
    with pytest.raises(ValueError, match="Q9"):
        sources.page(gone)
    gone["handout"]["items"] = [{"item": "Q9", "what": "more", "why": "it is another course's"}]
    assert sources.page(gone).endswith("| Q9 | more | in no lab: it is another course's |\n")
