"""What is graded of a notebook: its code in its order, and written answers wherever they stand."""

import copy
import json

import pytest

from labkit.instructor.authoring.spec import defined
from labkit.instructor.intake.handin import read_cells
from labkit.instructor.intake.submission import assemble
from labkit.instructor.intake.written import written
from labkit.instructor.records import HandInError
from labkit.notebook.read import cells_of

from helpers.classroom import LAB, blank, code, filled
from helpers.reference import LABS

STUB = "*Write your answer here (double-click to edit).*"
DOT = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="


def markdown(source, id="4a3f", **more):
    return {"cell_type": "markdown", "id": id, "metadata": {}, "source": source, **more}


def at(cells, id):
    return next(i for i, cell in enumerate(cells) if cell["id"] == id)


def below(id, *cells):
    return lambda all: all.__setitem__(slice(at(all, id) + 1, at(all, id) + 1), cells)


def turned(id, **fields):
    return lambda cells: cells[at(cells, id)].update(fields)


def in_the_question(cells):
    cells[at(cells, "answer-q1") - 1]["source"] += "\n\nBecause it drifts.\n\nAnd more."


def merged_with_the_question(cells):
    here = at(cells, "answer-q1")
    cells[here - 1]["source"] += "\n\n" + "Because it drifts.\n\nAnd more."
    del cells[here]


def merged_with_what_follows(cells):
    here = at(cells, "answer-q1")
    following = cells[here + 1]["source"]
    cells[here]["source"] = "Because it drifts.\n\nAnd more.\n\n" + following
    del cells[here + 1]


def moved_to_the_end(cells):
    cell = cells.pop(at(cells, "answer-q1"))
    cells.append({**cell, "id": "88aa", "source": "Because it drifts.\n\nAnd more."})


def in_two_cells(cells):
    turned("answer-q1", source="Because it drifts.")(cells)
    below("answer-q1", markdown("And more."))(cells)


def without_ids(cells):
    turned("answer-q1", source="Because it drifts.\n\nAnd more.")(cells)
    for cell in cells:
        del cell["id"]


TEXT = "Because it drifts.\n\nAnd more."
PLACES = {  # what a student did to the notebook; each time the answer is TEXT
    "in its cell": turned("answer-q1", source=TEXT),
    "below the stub": turned("answer-q1", source=f"{STUB}\n\n{TEXT}"),
    "around the stub": turned("answer-q1", source=f"Because it drifts.\n\n{STUB}\n\nAnd more."),
    "in a new cell": below("answer-q1", markdown(TEXT)),
    "in a new cell above": lambda cells: cells.insert(at(cells, "answer-q1"), markdown(TEXT)),
    "in two cells": in_two_cells,
    "in a raw cell": below("answer-q1", {**markdown(TEXT), "cell_type": "raw"}),
    "as comments": below("answer-q1", code("# Because it drifts.\n#\n# And more.", "5f")),
    "as a text in quotes": below("answer-q1", code('"""Because it drifts.\n\nAnd more."""', "5f")),
    "as code that is none": turned("answer-q1", source=TEXT, cell_type="code"),
    "in the question's cell": in_the_question,
    "merged with the question": merged_with_the_question,
    "merged with what follows": merged_with_what_follows,
    "moved, with a new id": moved_to_the_end,
    "without ids": without_ids,
}


@pytest.fixture(scope="module")
def released():
    return cells_of(blank())


@pytest.mark.parametrize("place", PLACES)
def test_a_written_answer_is_found(released, place):
    book = filled(answer_q1=None, answer_landmarks="Something else.")
    PLACES[place](book["cells"])
    answers, notes = written(released, cells_of(book))
    assert answers["answer-landmarks"] == "Something else." and notes == []
    assert answers["answer-q1"].replace("\n\n\n", "\n\n") == TEXT


def test_code_counts_as_an_answer_where_there_are_no_words(released):
    book = filled(answer_q1=None, answer_landmarks=None)
    below("answer-q1", code("print(2 * 2)", "5f"))(book["cells"])
    answers, _ = written(released, cells_of(book))
    assert answers == {"answer-q1": "```python\nprint(2 * 2)\n```", "answer-landmarks": ""}
    turned("answer-q1", source="Four.")(book["cells"])
    assert written(released, cells_of(book))[0]["answer-q1"] == "Four."


def test_text_under_no_question_is_told_if_an_answer_is_missing(released):
    book = filled(answer_q1=None, answer_landmarks="Something else.")
    book["cells"].insert(5, markdown("It drifts."))
    answers, notes = written(released, cells_of(book))
    assert answers["answer-q1"] == "" and len(notes) == 1 and "cell 6 (It drifts.)" in notes[0]
    turned("answer-q1", source="Here.")(book["cells"])
    assert written(released, cells_of(book))[1] == []


def test_pictures_come_along(released):
    text = "See ![plot](attachment:plot.png), ![no](attachment:no.png) and ![page](attachment:page.html)"
    attached = {"plot.png": {"image/png": [DOT[:20], DOT[20:]]}, "page.html": {"text/html": "PGI+"}, "odd": 3}
    book = filled()
    turned("answer-q1", source=text, attachments=attached)(book["cells"])
    answer = written(released, cells_of(book))[0]["answer-q1"]
    assert f"![plot](data:image/png;base64,{DOT})" in answer
    assert "(attachment:no.png)" in answer and "(attachment:page.html)" in answer
    turned("answer-q1", attachments={"plot.png": {"image/png": '"><script>'}})(book["cells"])
    assert written(released, cells_of(book))[0]["answer-q1"] == text


def test_each_answer_has_the_picture_of_its_own_cell(released):
    """Jupyter calls the first picture that is pasted into a cell image.png, in every cell."""
    book, other = filled(), "R0lGODlhAQABAAAAACw="
    for id, kind, data in (("answer-q1", "png", DOT), ("answer-landmarks", "gif", other)):
        attached = {"image.png": {f"image/{kind}": data}}
        turned(id, source="![image.png](attachment:image.png)", attachments=attached)(book["cells"])
    answers, _ = written(released, cells_of(book))
    assert DOT in answers["answer-q1"] and other not in answers["answer-q1"]
    assert other in answers["answer-landmarks"] and DOT not in answers["answer-landmarks"]


@pytest.mark.parametrize("lab", LABS)
def test_the_solutions_answers_are_found_and_the_stubs_are_blank(lab):
    book, given = blank(lab), cells_of(blank(lab))
    assert not any(written(given, given)[0].values())
    for cell in book["cells"]:
        if cell["metadata"]["labkit"] == "answer" and cell["cell_type"] == "markdown":
            cell["source"] = f"Mine, of {cell['id']}."
    assert written(given, cells_of(book))[0] == {id: f"Mine, of {id}." for id in written(given, given)[0]}


def test_all_code_goes_along_in_its_order(released):
    book = filled(own=["x = 1", "  "])
    book["cells"].reverse()
    work = assemble(released, cells_of(book))
    sources = [cell["source"] for cell in book["cells"] if cell["cell_type"] == "code" and cell["source"].strip()]
    assert [cell["source"] for cell in work.cells] == sources and work.notes == []
    assert set(work.sources.values()) == set(sources) and "cell 'answer-kf'" in work.sources


def test_copies_have_labels_of_their_own(released):
    book = filled()
    book["cells"].append(copy.deepcopy(book["cells"][at(book["cells"], "answer-kf")]))
    book["cells"][-1]["source"] = "class KF: pass"
    work = assemble(released, cells_of(book))
    assert work.sources[f"cell {len(book['cells'])}"] == "class KF: pass" and "def" in work.sources["cell 'answer-kf'"]


def test_what_nothing_defines_is_noted(released):
    book = filled()
    book["cells"] = [cell for cell in book["cells"] if "def stack" not in cell["source"]]
    assert assemble(released, cells_of(book)).notes == ["Nothing in the notebook defines `stack`."]
    book["cells"].append(code("from helpers import *", "5f"))
    assert assemble(released, cells_of(book)).notes == []


OTHERS = {
    "another lab": (blank(LABS[2])["cells"], "the notebook of another lab"),
    "something else": ([code("print('hello')", "1")], "neither its text nor `stack`, `repeat_R`, `KF`: hand in"),
    "nothing": ([], "Nothing of this lab is in it"),
}


@pytest.mark.parametrize("what", OTHERS)
def test_what_has_nothing_of_the_lab_is_refused(released, what):
    cells, says = OTHERS[what]
    with pytest.raises(HandInError, match=says):
        assemble(released, cells_of({"nbformat": 4, "cells": cells}))


def test_the_names_that_a_lab_asks_for(released):
    assert defined(released) == ["stack", "repeat_R", "KF"] and LAB == LABS[0]


def test_a_picture_that_is_shown_very_often_does_not_grow():
    book = blank()
    attached = {"a.png": {"image/png": "A" * 1_500_000}}
    turned("answer-q1", source="![](attachment:a.png)\n" * 5000, attachments=attached)(book["cells"])
    answers, notes = written(cells_of(blank()), cells_of(book))
    assert len(answers["answer-q1"]) < 7_000_000
    assert "A picture in an answer is not shown: it is missing, of another kind, or too large." in notes


def test_a_notebook_of_very_much_code_is_refused_before_it_fills_the_memory():
    book = blank()
    book["cells"] += [code("#" + "x" * 150_000, f"own{n}") for n in range(7)]
    with pytest.raises(
        HandInError, match=r"a\.ipynb has more than 1000000 characters of code and text: delete what is"
    ):
        read_cells(json.dumps(book).encode(), "a.ipynb")


def test_a_picture_in_the_text_itself_is_a_picture(released):
    """As Colab keeps what is pasted: it counts neither as text nor is it cut."""
    book = filled()
    cell = next(c for c in book["cells"] if c["id"].startswith("answer") and c["cell_type"] == "markdown")
    cell["source"] = "As drawn:\n\n![image.png](data:image/png;base64," + "iVBO" * 400_000 + ")"
    assert assemble(released, read_cells(json.dumps(book).encode(), "a.ipynb")).answers[cell["id"]] == cell["source"]


def test_another_name_that_is_checked_is_not_missed(released):
    book = filled()
    for cell in book["cells"]:
        cell["source"] = "".join(cell["source"]).replace("def stack", "def pile").replace(", stack)", ", pile)")
    assert assemble(released, cells_of(book)).notes == []
