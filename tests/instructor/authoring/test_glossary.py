"""The page of symbols: what the labs' tables say, and no symbol with two meanings in one lab."""

import pytest

from labkit.instructor.authoring import glossary
from labkit.instructor.authoring.percent import cells
from labkit.instructor.records import CommandError

from helpers.reference import LABS, ROOT

HEAD = "# %% [markdown]\n# | symbol | in the code | shape | unit | what it is |\n# |---|---|---|---|---|\n"


def test_the_page_is_that_of_the_labs_tables():
    assert not glossary.stale(ROOT)


@pytest.mark.parametrize("lab", LABS)
def test_in_a_lab_each_symbol_has_one_meaning(lab):
    rows = glossary.symbols(ROOT / "solutions" / f"{lab}.py")
    explained = [name for row in rows for name in glossary.names(row)]
    assert rows and sorted(explained) == sorted(set(explained))


def test_a_page_joins_what_is_alike_and_sets_side_by_side_what_differs(tmp_path):
    for number, meaning, more in (
        (1, "gain", ""),
        (2, "gain", "# | $x$, $(y, z)$ | `a` | | m | pose |\n"),
        (3, "other", ""),
    ):
        row = f"# | $K$ | `K` | (2,) | – | {meaning} |\n"
        (tmp_path / f"0{number}_a.py").write_text(HEAD + more + row + "#\n# | $no$ | | | | table |\n", "utf-8")
    text = glossary.page(tmp_path.glob("*.py"))
    lines = [line for line in text.splitlines() if line.startswith("| $")]
    assert [line.split(" | ")[-2:] for line in lines] == [["gain", "1, 2 |"], ["other", "3 |"], ["pose", "2 |"]]
    (pose,) = (row for row in glossary.symbols(tmp_path / "02_a.py") if row.meaning == "pose")
    assert glossary.names(pose) == ["x", "y", "z", "`a`"]


def test_a_row_that_is_short_is_told(tmp_path):
    (tmp_path / "01_a.py").write_text(HEAD + "# | $K$ | gain |\n", "utf-8")
    with pytest.raises(CommandError, match="has 2 columns"):
        glossary.symbols(tmp_path / "01_a.py")


@pytest.mark.parametrize("lab", LABS)
def test_each_labs_table_leads_to_the_page(lab):
    (table,) = (cell for cell in cells(ROOT / "solutions" / f"{lab}.py") if "## Symbols" in cell.source)
    assert "](../notebooks/glossary.md)" in table.source
