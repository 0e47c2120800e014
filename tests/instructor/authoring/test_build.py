"""`labkit build`: what is stored, and what counts as drift."""

import nbformat
import pytest

from labkit.instructor.authoring import build, executed

LAB = '# %% id="show"\nprint(1)\nprint(2)\n'


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """A built lab of one cell; no kernel runs: what it prints comes in two messages, as under load."""
    monkeypatch.setattr(build, "ROOT", tmp_path)

    def run(client, **_):
        prints(client.nb.cells[0], "1\n", "2\n")

    monkeypatch.setattr(executed.NotebookClient, "execute", run)
    script = tmp_path / "solutions" / "09_short.py"
    script.parent.mkdir()
    script.write_text(LAB, "utf-8")
    build.write(script)
    return script


def prints(cell, *texts):
    cell.outputs = [nbformat.v4.new_output("stream", name="stdout", text=text) for text in texts]


def test_what_was_printed_is_stored_in_one_piece(lab):
    (cell,) = nbformat.read(lab.with_suffix(".ipynb"), as_version=4).cells
    assert [(out.name, out.text) for out in cell.outputs] == [("stdout", "1\n2\n")]


def test_it_is_no_drift_that_a_print_comes_in_two_messages(lab):
    stored = nbformat.read(lab.with_suffix(".ipynb"), as_version=4)
    for texts in [("1\n2\n",), ("1\n", "2\n"), ("1\n2", "\n")]:
        prints(stored.cells[0], *texts)
        nbformat.write(stored, lab.with_suffix(".ipynb"))
        assert build.compare(lab) == []
    prints(stored.cells[0], "1\n3\n")
    nbformat.write(stored, lab.with_suffix(".ipynb"))
    assert build.compare(lab) == ["solutions/09_short.ipynb: cell 'show' prints something else when it is run"]
