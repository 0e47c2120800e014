"""What there is to read, as it is now: whoever else writes into the gradebook."""

import re
from contextlib import closing
from types import SimpleNamespace

import pytest

from labkit.instructor.marking.desk import Desk
from labkit.instructor.marking.pages import Pages
from labkit.instructor.records import BLANK, BY_HAND, OPEN, Check
from labkit.instructor.report.gradebook import Gradebook

CHECKS = [
    Check("kf", "The filter", 2),
    Check("q1", "Why?", 3, True, question="Why?", rubric="- 1 point: so", model="So."),
]


def hand_in(book, name, answer, digest="", checks=CHECKS):
    book.set_paper("lab", f"paper{digest}", checks)
    id = book.add("lab", name, "", f"{name}.ipynb", answer + digest, f"paper{digest}", None, False, [], {"q1": answer})
    book.choose(id, [], False)
    book.finish(id)
    return id


@pytest.fixture
def book(tmp_path):
    with closing(Gradebook(tmp_path / "gradebook.db", seed=7)) as book:
        for name, answer in [("Ada", "so"), ("Bo", " so\n"), ("Cem", "or so"), ("Dee", " ")]:
            hand_in(book, name, answer)
        yield book


@pytest.fixture
def other(book):
    with closing(Gradebook(book.path)) as other:
        yield other


def only(desk):
    (question,) = desk.questions.values()
    return question


def states(desk):
    return {a.label: desk.status(only(desk), a) for a in only(desk).answers}


def give(desk, *names, reader="Emmy", points=2, act=""):
    """A mark as its giver sees it now."""
    seen = {a.id: desk.given(only(desk), a).number for a in only(desk).answers if a.label in names}
    moved = desk.book.hands.give(act or f"{reader}{names}", reader, desk.slots(only(desk), seen), points, "")
    desk.refresh(anew=True)
    return moved


def test_the_same_answers_wait_together_and_nobody_is_asked_to_read_nothing(book):
    desk = Desk(book)
    assert states(desk) == {"Ada": OPEN, "Bo": OPEN, "Cem": OPEN, "Dee": BLANK}
    first, second = (desk.next(reader, only(desk)) for reader in ("Emmy", "Noor"))
    assert [a.label for a in first.answers] == ["Ada", "Bo"] and [a.label for a in second.answers] == ["Cem"]
    assert desk.next("Lise", only(desk)) is None
    every = Pages(desk, "/token/").every("/token/Lise/", "Lise", only(desk))
    assert re.search("being read by\\s*<bdi>\\s*Emmy\\s*</bdi>, *<bdi>\\s*Noor", every)
    assert give(desk, "Ada") == [] and states(desk)["Bo"] == OPEN
    assert desk.next("Emmy", only(desk), after=first.id) is first  # its other half, once the rest is somebody's
    assert give(desk, "Bo", "Cem") == [] and desk.next("Emmy", only(desk)) is None
    assert only(desk).check.model == "So."
    page = " ".join(Pages(desk, "/token/").overview("/token/Emmy/", "Emmy").split())
    assert "3 of 3 read" in page and re.search("Emmy ?</bdi> ?: 3[.]", page) and "Emmy" in Pages(desk, "/token/").ask()


def test_where_numbers_are_the_students_own_each_answer_is_read_alone(book, monkeypatch):
    book.path.with_name("course.toml").write_text('[variants]\ncourse = "A"\nroster = "r.csv"\n')
    paper = SimpleNamespace(
        setup="", cells=[], released=[SimpleNamespace(code=True, source="r = variant.rng().normal()")]
    )
    monkeypatch.setattr("labkit.instructor.marking.desk.read_paper", lambda lab: paper)
    desk = Desk(book)
    assert [[a.label for a in group.answers] for group in only(desk).groups] == [["Ada"], ["Bo"], ["Cem"], ["Dee"]]
    pages = Pages(desk, "/token/")
    told = pages.mark("/token/E/", "E", only(desk), only(desk).groups[0]), pages.every("/token/E/", "E", only(desk))
    assert all("numbers of their own" in page for page in told)
    paper.released.clear()
    assert [len(group.answers) for group in only(Desk(book)).groups] == [2, 1, 1]


def test_what_another_server_gives_is_seen_and_not_overwritten(book, other):
    here, there = Desk(book), Desk(other)
    give(there, "Ada", points=1, reader="Noor")
    assert [slot.result.student for slot in give(here, "Ada", "Bo")] == ["Ada"]
    here.refresh()
    assert states(here)["Ada"] == BY_HAND and states(here)["Bo"] == OPEN
    assert (
        give(here, "Ada", "Bo", act="again") == []
        and Desk(other).given(only(there), only(there).answers[0]).points == 2
    )


def test_what_is_handed_in_anew_is_to_be_read_anew(book, other):
    desk = Desk(book)
    give(desk, "Ada", "Cem")
    id = hand_in(other, "Ada", "something else", digest="2")
    hand_in(other, "Cem", "or so", digest="2")
    before = only(desk)
    desk.refresh()
    assert states(desk)["Ada"] == OPEN and states(desk)["Cem"] == BY_HAND
    assert only(desk).group(id).answers[0].text == "something else"
    assert desk.slots(only(desk), {before.answers[0].id: 0}) is None


def test_a_question_whose_points_have_changed_is_two(book):
    hand_in(book, "Ada", "so", "new", [CHECKS[0], Check("q1", "Why, then?", 4, True)])
    desk = Desk(book)
    assert {(q.check.points, q.check.title, len(q.answers)) for q in desk.questions.values()} == {
        (4, "Why, then?", 1),
        (3, "Why?", 3),
    }
