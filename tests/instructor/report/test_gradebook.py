"""The gradebook: what is committed stays, a person's marks count most, and one submission of each student counts."""

import sqlite3
from contextlib import closing

import numpy as np
import pytest

from labkit.instructor.policy import choose_best
from labkit.instructor.records import BLANK, BY_HAND, ERROR, FAILED, NOT_RUN, OPEN, PASSED, STUB, Check, CommandError
from labkit.instructor.report.gradebook import Gradebook

CHECKS = [Check("kf", "The filter", 2), Check("q1", "Why?", 3, hand=True)]


@pytest.fixture
def book(tmp_path):
    with closing(Gradebook(tmp_path / "book.db", seed=7)) as book:
        book.set_paper("lab", "paper", CHECKS)
        yield book


def add(book, student="Ada", digest="d", answer="so", level=3, **more):
    id = book.add("lab", student, "", "a.ipynb", digest, "paper", None, False, [], {"q1": answer}, **more)
    book.set_level([id], level)
    book.choose(id, [], False)
    return id


def only(book):
    (result,) = book.results("lab")
    return result


def test_the_first_mark_counts_and_what_has_none_is_not_run(book):
    id = add(book)
    assert [(mark.status, mark.points) for mark in only(book).marks] == [(NOT_RUN, None), (OPEN, None)]
    assert (only(book).open, only(book).ungraded) == (1, 1)
    book.mark(id, "kf", 2, PASSED)
    book.mark(id, "kf", 0, FAILED, "again")
    assert only(book).marks[0].points == 2 and book.marked(id) == {"kf"}
    assert book.unfinished("lab")
    book.finish(id, {"x": np.arange(3)})
    assert not book.unfinished("lab") and list(book.figure(id)["x"]) == [0, 1, 2]


def test_a_persons_mark_stays_and_tells_when_the_answer_has_changed(book):
    id = add(book)
    book.mark(id, "kf", 0, FAILED, "No.", ["a line"], "a mistake")
    assert only(book).marks[0].lines == ("a line",)
    for check in ("kf", "q1"):
        book.hand(only(book), check, 1.5, "Good.")
    assert [(m.points, m.status, m.reason) for m in only(book).marks] == [(1.5, BY_HAND, "Good.")] * 2
    add(book, digest="another", answer="or so")
    told = [mark.reason for mark in only(book).marks]
    assert told == ["Good.", "Good. (The answer has changed since it was marked.)"]


def test_the_last_choice_counts_or_the_best_that_could_be_graded(book):
    ids = [add(book, digest=str(n)) for n in range(2)]
    bad = add(book, digest="bad", problem="No notebook.")
    for id, points in zip(ids, (2, 1)):
        book.mark(id, "kf", points, PASSED)
    assert only(book).id == bad and only(book).marks == []
    choose_best(book, "lab")
    assert only(book).id == ids[0]
    assert book.find("lab", "Ada", "", "1")[0] == ids[1] and book.find("lab", "Ada", "", "9") is None


def test_checks_that_could_not_be_run_are_run_again_and_others_are_not(book):
    failed, done = add(book), add(book, "Bela")
    for id, status in ((failed, ERROR), (done, FAILED)):
        book.mark(id, "kf", 0, status)
        book.finish(id)
    book.retry("lab")
    assert book.marked(failed) == set() and book.marked(done) == {"kf"} and book.unfinished("lab")


def test_marks_without_a_sandbox_say_so(book):
    book.mark(add(book, level=0), "kf", 2, PASSED)
    assert only(book).marks[0].reason == "(Marked without a sandbox.)"


def test_all_of_a_block_is_kept_or_nothing(book):
    def stopped():
        with book:
            add(book)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    assert book.labs() == []


def test_tables_are_remembered_until_one_of_them_was_written(book):
    for n in range(3):
        book.mark(add(book, f"Student {n}"), "kf", n, PASSED)
        for _ in range(2):
            book.wrote(book.results("lab"))
    assert [len(results) for results in book.written()] == [3, 2, 1]
    assert book.written()[0][2].marks[0].points == 2
    for n in range(20):
        book.add("lab", f"More {n}", "", "", str(n), "paper", None, False, [], {})
        book.choose(n + 4, [], False)
        book.wrote(book.results("lab"))
    assert [len(results) for results in book.written()][-1] == 1 and len(book.written()) == 9
    book.settled()
    assert [len(results) for results in book.written()] == [23]


def test_a_file_that_is_no_gradebook_of_this_run_is_told(book, tmp_path):
    with pytest.raises(CommandError, match="was begun with --seed 7"):
        Gradebook(book.path, seed=8)
    assert Gradebook(book.path).seed == 7
    (tmp_path / "text.db").write_text("no database" * 100, encoding="utf-8")
    with pytest.raises(CommandError, match="cannot be used as a gradebook"):
        Gradebook(tmp_path / "text.db")
    with closing(sqlite3.connect(book.path)) as other, other:
        other.execute("UPDATE meta SET value = '0' WHERE key = 'version'")
    with pytest.raises(CommandError, match="another version"):
        Gradebook(book.path)


@pytest.mark.parametrize("answer", ["", " \n\t\u00a0", STUB, f"\n{STUB}\n\n{STUB} \u200b"])
def test_a_blank_answer_gives_0_points_waits_for_nobody_and_may_be_overruled(book, answer):
    add(book, answer=answer)
    mark = only(book).marks[1]
    assert (mark.points, mark.status) == (0, BLANK) and (only(book).open, only(book).blank) == (0, 1)
    book.hand(only(book), "q1", 2, "It was said aloud.")
    assert (only(book).points, only(book).blank) == (2, 0)


def test_a_mark_for_an_answer_with_half_a_character_is_kept(book):
    add(book, answer="so \ud800")
    book.hand(only(book), "q1", 2, "Hm.")
    assert (only(book).marks[1].points, only(book).marks[1].reason) == (2, "Hm.")


def test_a_word_is_an_answer(book):
    add(book, answer=f"{STUB} no")
    assert (only(book).open, only(book).blank) == (1, 0)


def test_texts_of_any_length_are_cut_where_they_are_kept(book):
    long = "x" * 3_000_000
    id = add(book, problem="")
    book.mark(id, "kf", 0, FAILED, long, [long] * 1000, long)
    book.finish(id, {"x": np.zeros(1_000_000)})
    other = book.add("lab", "Bo", "", "b.ipynb", "e", "paper", None, False, [long], {}, long)
    book.choose(other, [], False)
    mark = book.result(id).marks[0]
    assert mark.reason == "x" * 2000 + "… (cut here: it has 3000000 characters)" and len(mark.mistake) < 2100
    assert len(mark.lines) == 61 and mark.lines[-1] == "… (cut here: 940 more lines)"
    assert all(len(line) < 500 for line in mark.lines) and book.figure(id) == {}
    assert len(book.result(other).problem) < 2100
    book.wrote(list(book.results("lab")))
    assert book.path.stat().st_size < 200_000


def test_a_check_that_could_not_be_run_has_no_points_and_leaves_the_best_open(book):
    first, second = add(book, digest="a"), add(book, digest="b")
    book.mark(first, "kf", 0, ERROR, "No sandbox.")
    book.mark(second, "kf", 1, PASSED)
    choose_best(book, "lab")
    (mark, _) = only(book).marks
    assert (mark.status, mark.points, only(book).ungraded) == (ERROR, None, 1)
    book.hand(only(book), "kf", 1.5, "I looked.")
    assert only(book).ungraded == 0 and only(book).points == 1.5
