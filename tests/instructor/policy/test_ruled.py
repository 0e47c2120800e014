"""The rules applied to a gradebook: what each student's points become, and what they are told."""

from argparse import Namespace
from contextlib import closing
from datetime import datetime

import pytest

from labkit.instructor import policy
from labkit.instructor.policy import intake, memory
from labkit.instructor.records import BY_HAND, ERROR, FAILED, OPEN, PARTLY, PASSED, Check, CommandError
from labkit.instructor.report.gradebook import Gradebook
from labkit.instructor.report.output import _rules

LAB = "01_cartesian_ekf"
CHECKS = [Check("kf", "The filter", 12), Check("map", "On a map", 4), Check("q1", "Why?", 4, hand=True)]
DUE = f"[labs.{LAB}]\ndue = 2026-11-20T12:00\n[late]\npercent_a_day = 10\n"


@pytest.fixture
def book(tmp_path):
    with closing(Gradebook(tmp_path / "gradebook.db", seed=1)) as book:
        book.set_paper(LAB, "paper", CHECKS)
        yield book


def hand_in(book, name, number="", day=20, hour=11, points=12.0, status=PASSED, late=False, when=True, problem=""):
    at = datetime(2026, 11, day, hour) if when else None
    source = f"{name}-{day}-{hour}.ipynb"
    id = book.add(LAB, name, number, source, source, "paper", at, late, [], {"q1": "So."}, problem)
    if not problem:
        book.mark(id, "kf", points, status, parts=["H"] if status == PARTLY else ())
        book.mark(id, "map", 4, PASSED)
    book.finish(id)
    book.choose(id, [], late, at)
    return id


def rules(book, text):
    book.path.with_name("course.toml").write_text(text, encoding="utf-8")
    return {result.student: result for result in policy.ruled(book, LAB)}


def test_without_rules_nothing_changes(book):
    hand_in(book, "Ada", late=True)
    ada = rules(book, "")["Ada"]
    assert (ada.points, ada.raw, ada.late, ada.notes, ada.ruling.told) == (16, 16, True, ["Handed in late."], ())


def test_a_late_hand_in_costs_what_the_file_says_and_the_gradebook_keeps_the_raw_marks(book):
    id = hand_in(book, "Ada", day=22, hour=10)
    ada = rules(book, DUE)["Ada"]
    assert (ada.points, ada.raw, ada.late, ada.ruling.days, ada.ruling.less) == (12.8, 16, True, 2, 3.2)
    assert ada.ruling.told == (
        "2 days late (due 2026-11-20 12:00, handed in 2026-11-22 10:00; a day begun counts): 10 % a day, "
        "3.2 of 16 points less.",
    )
    assert book.result(id).points == 16 and not book.result(id).late
    book.hand(book.result(id), "q1", 4, "Good.")
    assert rules(book, DUE)["Ada"].points == 16 and rules(book, DUE.replace("20T", "23T"))["Ada"].points == 20
    points = "points_a_day = 1\ncap = 1"
    assert rules(book, DUE.replace("percent_a_day = 10", points))["Ada"].points == 19
    count = rules(book, DUE.split("[late]")[0])["Ada"]
    assert (count.points, count.late, count.notes, count.ruling.told) == (20, True, ["Handed in late."], ())
    ignored = rules(book, DUE.replace("percent_a_day = 10", "ignore = true"))["Ada"]
    assert ignored.problem == "It was handed in late, and late hand-ins do not count." and not ignored.marks
    assert "2 days late (due 2026-11-20 12:00, handed in 2026-11-22 10:00" in ignored.ruling.told[0]


def test_an_extension_is_the_students_own(book):
    for name in ("Ada", "Bo"):
        hand_in(book, name, day=22, hour=10)
    extension = f'[[extensions]]\nstudent = "Ada"\nlab = "{LAB}"\ndue = '
    found = rules(book, f"{DUE}{extension}2026-11-22")
    assert (found["Ada"].points, found["Ada"].late, found["Bo"].points) == (16, False, 12.8)
    assert found["Ada"].ruling.told == (
        "Handed in 2026-11-22 10:00: in time, by your extension until 2026-11-22 23:59.",
    )
    ada = rules(book, f"{DUE}{extension}2026-11-21T12:00")["Ada"]
    assert ada.points == 14.4 and ada.ruling.told[0].startswith("1 day late (due 2026-11-21 12:00 by your extension, h")


def test_grace_is_told_where_it_changed_something(book):
    hand_in(book, "Ada", hour=13)
    assert rules(book, DUE)["Ada"].points == 14.4
    ada = rules(book, f"{DUE}grace_minutes = 60")["Ada"]
    assert ada.points == 16 and not ada.late
    assert ada.ruling.told == ("Handed in 2026-11-20 13:00, due 2026-11-20 12:00: in time, with 60 minutes of grace.",)
    assert rules(book, f"{DUE}grace_minutes = 59")["Ada"].late


def test_what_only_the_lms_knows_to_be_late_costs_nothing_but_may_be_left_out(book):
    hand_in(book, "Ada", late=True, when=False)
    ada = rules(book, DUE)["Ada"]
    assert ada.points == 16 and ada.late
    assert ada.ruling.told == ("Handed in late; by how much is not known, so that it costs nothing.",)
    assert rules(book, DUE.replace("percent_a_day = 10", "ignore = true"))["Ada"].problem
    ada = rules(book, f'{DUE}[[extensions]]\nstudent = "Ada"\nlab = "{LAB}"\ndue = 2026-11-22')["Ada"]
    assert not ada.late and "counted as in time" in ada.ruling.told[0]


def test_without_partial_credit_a_check_counts_as_a_whole(book):
    hand_in(book, "Ada", points=6, status=PARTLY)
    assert rules(book, "partial_credit = true")["Ada"].points == 10
    ada = rules(book, "partial_credit = false")["Ada"]
    assert (ada.points, ada.raw, ada.marks[0].status, ada.marks[0].parts) == (4, 10, FAILED, ())
    assert ada.ruling.told == (
        "A check counts as a whole in this course: 6 of 10 points less, which were for parts of 1 check that you did "
        "not pass.",
    )
    book.hand(book.result(ada.id), "kf", 7, "I looked.")
    assert rules(book, "partial_credit = false")["Ada"].points == 11
    late = rules(book, DUE.replace("20T12", "20T10") + "grace_minutes = 0")["Ada"]
    assert late.marks[0].status == BY_HAND and late.marks[2].status == OPEN and late.points == 9.9


GROUP = '[[groups]]\nmembers = ["Ada", "Bo", "Cy"]\n'


def test_one_hand_in_counts_for_every_member_by_each_ones_own_due_date(book):
    id = hand_in(book, "Ada", "1", day=21, hour=10)
    hand_in(book, "Dan", "4")
    found = rules(book, f'{DUE}{GROUP}[[extensions]]\nstudent = "Cy"\nlab = "{LAB}"\ndue = 2026-11-22')
    assert {name: (r.points, r.id == id, r.ruling.by) for name, r in found.items()} == {
        "Ada": (14.4, True, ""),
        "Bo": (14.4, True, "Ada"),
        "Cy": (16, True, "Ada"),
        "Dan": (16, False, ""),
    }
    assert found["Bo"].ruling.told[0] == "Ada handed this in for your group (Ada, Bo, Cy)."
    assert "1 day late" in found["Bo"].ruling.told[1] and "your extension" in found["Cy"].ruling.told[1]
    assert rules(book, f'{GROUP}labs = ["03_range_bearing_ekf"]').keys() == {"Ada", "Dan"}


@pytest.mark.parametrize(
    "rule, who",  # Ada: 16 points on the 18th;  Bo: 10 on the 19th, 2 days late: 8
    [
        ("", {"Ada": "Bo", "Bo": "", "Cy": "Bo"}),
        ('counts = "newest"', {"Ada": "Bo", "Bo": "", "Cy": "Bo"}),
        ('counts = "first"', {"Ada": "", "Bo": "Ada", "Cy": "Ada"}),
        ('counts = "best"', {"Ada": "", "Bo": "Ada", "Cy": "Ada"}),
        ('counts = "own"', {"Ada": "", "Bo": "", "Cy": "Bo"}),
    ],
)
def test_of_a_groups_hand_ins_the_newest_counts_or_another_by_rule(book, rule, who):
    hand_in(book, "Bo", day=19, points=6)
    hand_in(book, "Ada", day=18)
    found = rules(book, f"{DUE.replace('20T', '17T')}{GROUP}{rule}")
    assert {name: result.ruling.by for name, result in found.items()} == who
    if who["Cy"] == "Bo":
        told = found["Cy"].ruling.told[0]
        assert told == "Bo handed this in for your group (Ada, Bo, Cy); of its 2 hand-ins the newest counts."


def test_where_no_times_are_known_members_keep_their_own_and_others_get_the_best(book):
    hand_in(book, "Ada", when=False)
    hand_in(book, "Bo", points=6, when=False)
    found = rules(book, GROUP)
    assert [found[name].ruling.by for name in ("Ada", "Bo", "Cy")] == ["", "", "Ada"]
    assert "it is not known which came first, counts" in found["Cy"].ruling.told[0]


def test_what_cannot_be_graded_never_takes_the_place_of_what_can(book):
    hand_in(book, "Ada", day=18)
    hand_in(book, "Bo", day=19, problem="No notebook.")
    hand_in(book, "Eve", day=19, problem="No notebook.")
    found = rules(book, f'{GROUP}[[groups]]\nmembers = ["Eve", "Flo"]')
    assert found["Bo"].ruling.by == "Ada" and not found["Bo"].problem
    assert found["Eve"].problem and "Flo" not in found


def test_the_best_attempt_is_the_one_with_most_points_after_the_rules(book):
    first = hand_in(book, "Ada", day=20, points=10)
    second = hand_in(book, "Ada", day=21, points=11)
    policy.choose_best(book, LAB)
    assert next(book.results(LAB)).id == second
    rules(book, DUE)
    policy.choose_best(book, LAB)
    assert next(book.results(LAB)).id == first
    broken = hand_in(book, "Ada", day=23, points=0, status=ERROR)
    policy.choose_best(book, LAB)
    assert next(book.results(LAB)).id == broken
    rules(book, DUE.replace("percent_a_day = 10", "ignore = true"))
    policy.choose_best(book, LAB)
    assert next(book.results(LAB)).id == first


def test_where_the_best_counts_a_newer_hand_in_with_less_is_told(book):
    hand_in(book, "Bo", day=19, points=8.4)
    hand_in(book, "Bo", day=20)
    for newer in (19, 20):  # the newest of one run is graded first
        hand_in(book, "Ada", day=39 - newer, points=8.4 if newer == 19 else 12.0)
    rules(book, 'attempts = "best"')
    policy.choose_best(book, LAB)
    told = {result.student: result.ruling.told for result in policy.ruled(book, LAB)}
    sentence = "The best of 2 graded hand-ins counts, with 16 points so far; the newest of them has 12.4."
    assert told == {"Ada": (sentence,), "Bo": ()}
    assert _rules(policy.ruled(book, LAB)) == ["The best hand-in counts, another has less: 1: Ada (16 points)."]
    assert rules(book, 'attempts = "newest"')["Ada"].ruling.told == ()
    group = rules(book, 'attempts = "best"\n[[groups]]\nmembers = ["Ada", "Cy"]')["Cy"]
    assert group.ruling.told[-1] == sentence.replace("of 2", "of Ada's 2")


EXTENSION = '[[extensions]]\nstudent = "{}"\nlab = "{}"\ndue = 2026-11-27\n'
NAMES = {  # what the file says: how it is refused
    EXTENSION.format("Ada Lovelac", LAB): "student: there is no student 'Ada Lovelac'; did you mean 'Ada Lovelace'?",
    EXTENSION.format("Ada", LAB): "student 'Ada' is known",
    EXTENSION.format("Zoe", LAB): "no student 'Zoe' is known. Write the name as in the LMS; of who has not handed in",
    EXTENSION.format("999", LAB): "no student '999' is known",
    EXTENSION.format(
        "Sam Lee", LAB
    ): f"'Sam Lee' may be 2 students of {LAB}; write which one, as Sam Lee (3) or Sam Lee (4)",
    EXTENSION.format("Ada Lovelace", LAB) + EXTENSION.format("1", LAB): "'1' is 'Ada Lovelace', who has an extension",
    EXTENSION.format("Zoe", "03_range_bearing_ekf"): "no student 'Zoe' is known",
    '[[groups]]\nmembers = ["Ada Lovelace", "1"]': "'Ada Lovelace' stands there twice, by name and number.",
    '[[groups]]\nmembers = ["Ada Lovelace", "Lukasz Zak"]': "did you mean 'Łukasz Żak'?",
    '[[groups]]\nmembers = ["Ada Lovelace", "Sam Lee"]': "[[groups]] 1, members: 'Sam Lee' may be 2 students",
    '[[groups]]\nmembers = ["Ada Lovelace", "2"]\n[[groups]]\nmembers = ["Łukasz Żak", "3"]': "is in [[groups]] 1 too",
}


@pytest.mark.parametrize("text, told", NAMES.items(), ids=range(len(NAMES)))
def test_names_that_are_nobodys_or_several_students_are_refused(book, text, told):
    for number, name in enumerate(("Ada Lovelace", "Łukasz Żak", "Sam Lee", "Sam Lee"), 1):
        hand_in(book, name, str(number))
    args = Namespace(due=None, late=None, attempts=None, moodle=None, canvas=None)
    course = policy.read(write(book, text))
    with pytest.raises(CommandError) as error:
        intake.rules(book, LAB, course, args, [])
    assert told in str(error.value) and "course.toml" in str(error.value)


def write(book, text):
    path = book.path.with_name("course.toml")
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("said", ["Ada Lovelace", "101", "Ada Lovelace (101)", "Ada  Lovelace"])
def test_a_student_may_be_named_in_any_of_these_ways(book, said):
    hand_in(book, "Ada Lovelace", "101", day=22)
    assert rules(book, DUE + EXTENSION.format(said, LAB))["Ada Lovelace"].points == 16


def test_who_has_not_handed_in_is_known_from_the_lms_another_lab_or_the_list(book):
    hand_in(book, "Ada", "101")
    for known in ('students = ["Zoe"]\n', ""):
        assert rules(book, known + DUE + EXTENSION.format("Zoe", LAB)).keys() == {"Ada"}
        memory.remember(book, LAB, {}, [("Ada", "101"), ("Zoe", "102")])
    memory.remember(book, LAB, {}, [])  # another run, without the LMS's file
    found = rules(book, '[[groups]]\nmembers = ["Ada", "Zoe"]')
    assert (found["Zoe"].identifier, found["Zoe"].ruling.by) == ("102", "Ada")
    with pytest.raises(CommandError, match="no student 'Yves' in 01_cartesian_ekf; the LMS has Ada, Zoe"):
        rules(book, '[[groups]]\nmembers = ["Ada", "Yves"]')


def test_options_go_before_the_file_for_their_lab_until_it_is_graded_without_them(book):
    hand_in(book, "Ada", day=22, hour=10)
    course = policy.read(write(book, f'attempts = "first"\n{DUE}'))
    args = Namespace(due=datetime(2026, 11, 21, 12), late=None, attempts="best")
    said = memory.options(args)
    memory.remember(book, LAB, said, [])
    assert policy.ruled(book, LAB)[0].points == 14.4 and policy.course_of(book, LAB).lab(LAB).attempts == "best"
    own, notes = memory.overridden(course, LAB, said)
    assert notes == [
        f"--due: 2026-11-21 12:00 goes before course.toml, by which {LAB} is due 2026-11-20 12:00.",
        "--attempts best goes before course.toml, by which the first counts.",
    ]
    assert own.lab("03_range_bearing_ekf").attempts == "first"
    late = {"late": "count"}
    assert memory.overridden(course, LAB, late)[1] == [
        "--late count goes before what course.toml says of late hand-ins."
    ]
    memory.remember(book, LAB, late, [])
    assert policy.ruled(book, LAB)[0].points == 16 and policy.ruled(book, LAB)[0].late
    memory.remember(book, LAB, {}, [])
    assert policy.ruled(book, LAB)[0].points == 12.8
    assert memory.overridden(policy.Course(), LAB, {**said, **late})[1] == []
