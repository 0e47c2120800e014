"""What the rules decide before anything is graded: who is known, and which hand-ins come too late to count."""

from argparse import Namespace
from contextlib import closing
from datetime import datetime

import pytest

from labkit.instructor import policy
from labkit.instructor.policy import intake, memory
from labkit.instructor.policy.people import known
from labkit.instructor.records import CommandError
from labkit.instructor.report.gradebook import Gradebook

LAB = "01_cartesian_ekf"
RULES = f"""
[late]
ignore = true
grace_minutes = 15
[labs.{LAB}]
due = 2026-11-20T12:00
[[extensions]]
student = "Bo"
lab = "{LAB}"
due = 2026-11-22
[[groups]]
members = ["Ada", "Bo"]
"""
NOTHING = {"due": None, "late": None, "attempts": None, "moodle": None, "canvas": None}


@pytest.fixture
def book(tmp_path):
    with closing(Gradebook(tmp_path / "gradebook.db", seed=1)) as book:
        yield book


def entry(student, day=20, hour=11, minute=0, number="", late=False):
    when = datetime(2026, 11, day, hour, minute) if day else None
    return Namespace(student=student, identifier=number, when=when, late=late)


def rules(book, text, found, **options):
    path = book.path.with_name("course.toml")
    path.write_text(text, encoding="utf-8")
    return intake.rules(book, LAB, policy.read(path), Namespace(**{**NOTHING, **options}), found)


def test_what_is_late_for_all_whom_it_would_count_for_is_left_out(book):
    in_time = [entry("Ada", 22), entry("Bo", 22), entry("Cy"), entry("Cy", hour=12, minute=15)]
    too_late = [entry("Ada", 23), entry("Cy", hour=12, minute=16), entry("Cy", day=0, late=True)]
    found, due, _ = rules(book, RULES, [*in_time, *too_late])
    assert [found.too_late(one) for one in (*in_time, *too_late)] == [False] * 4 + [True] * 3
    assert found.attempts == "newest" and due.day == 20
    found, _, notes = rules(book, RULES, too_late, late="count")
    assert not any(map(found.too_late, too_late)) and notes[0].startswith("--late count goes before")
    found, _, _ = rules(book, RULES.replace("ignore = true", "points_a_day = 1"), too_late)
    assert not any(map(found.too_late, too_late))


def test_options_alone_are_a_course_too(book):
    found, due, notes = rules(book, "", [entry("Ada")], due=datetime(2026, 11, 20, 10), late="ignore", attempts="best")
    assert found.too_late(entry("Ada")) and found.attempts == "best" and not notes
    assert due == datetime(2026, 11, 20, 10).astimezone()


def test_a_name_that_is_wrong_stops_the_run_before_anything_is_kept(book):
    with pytest.raises(CommandError, match="did you mean 'Beatrix'") as error, book:
        rules(
            book,
            RULES.replace('student = "Bo"', 'student = "Beatrice"'),
            [entry("Ada"), entry("Beatrix")],
            late="count",
        )
    assert str(book.path.with_name("course.toml")) in str(error.value)
    assert not [key for (key,) in book.db.execute("SELECT key FROM meta") if key.startswith("course")]


def test_the_class_is_known_from_moodles_worksheet_and_canvas_gradebook(book, tmp_path):
    (tmp_path / "w.csv").write_text(
        "Identifier,Full name,Grade,Maximum Grade\nParticipant 101,Ada,,5\nParticipant 102,Bo,,5\n"
    )
    (tmp_path / "c.csv").write_text('Student,ID,Lab 1 (7)\n    Points Possible,,5\n"Noether, Emmy",103,\n')
    rules(book, RULES, [entry("Ada", number="101")], moodle=tmp_path / "w.csv", canvas=tmp_path / "c.csv")
    (of,) = memory.people_of(book, {LAB: [("Ada", "101")]}).values()
    assert of.complete and [*of.called] == [("Ada", "101"), ("Bo", "102"), ("Emmy Noether", "103")]
    with pytest.raises(CommandError, match="the LMS has Ada, Bo, Emmy Noether"):
        rules(book, RULES.replace('"Bo"]', '"Zoe"]'), [entry("Ada", number="101")])


@pytest.mark.parametrize(
    "handed_in, roster, people",
    [
        (("Ada", "101"), ("Ada", "101"), 1),
        (("Ada", ""), ("Ada", "101"), 1),
        (("Ada Lovelace", "101"), ("Lovelace, Ada", "101"), 1),
        (("Emil F", "203"), ("Emil_F", "203"), 1),  # Moodle makes spaces of underscores
        (("Participant 101", "101"), ("Ada", "101"), 1),
        (("Group B", "203"), ("Emil", "203"), 2),  # numbers of groups are others'
        (("Ada", "101"), ("Ada", "102"), 2),
        (("Participant 101", "101"), ("Ada", "102"), 2),
    ],
)
def test_who_is_one_in_hand_ins_and_the_list(handed_in, roster, people):
    assert len(known([handed_in], [roster]).called) == people
