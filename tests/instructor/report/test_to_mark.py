"""The page from which written answers are marked."""

from labkit.instructor import records
from labkit.instructor.records import Mark, Result
from labkit.instructor.report.to_mark import to_mark_page

from helpers.graded import CHECKS, TITLE, classroom, sound


def test_the_same_answers_are_grouped_and_open_ones_come_first():
    def student(name, answer, points=None):
        status = records.OPEN if points is None else records.BY_HAND
        return Result(name, lab="lab3", marks=[Mark("q6", points, 3, status)], answers={"q6": answer})

    results = [student("Ada", "read", 2), student("Cem", " same\n"), student("Bo", "same"), student("Dee", "")]
    page = to_mark_page(results, CHECKS, TITLE)
    text = sound(page).text
    assert (
        "2 students gave this same answer." in text
        and "Ada (2)" in text
        and "No answer, and 0 points unless you give others: Dee" in text
    )
    assert "3 answers, 3 still to be read" in text and "grades.csv" in text and "run the same command again" in text
    assert text.index("Bo, Cem") < text.index("Ada (2)")
    assert (
        "<msub><mi>σ</mi><mi>β</mi></msub>" in page
        and "SECRET-RUBRIC" in text
        and "Nobody has handed this in yet" in text
    )
    sound(to_mark_page([], CHECKS, TITLE))
    assert "no written question" in to_mark_page(results, CHECKS[:3], TITLE)


def test_where_numbers_are_the_students_own_no_answer_stands_for_two():
    results = [Result(n, marks=[Mark("q6", None, 3, records.OPEN)], answers={"q6": "same"}) for n in ("Ada", "Bo")]
    page = to_mark_page(results, CHECKS, TITLE, apart=True)
    assert "students gave this same" not in page and "alike answers come together" not in page
    assert "numbers of their own" in sound(page).text and page.count("same</p>") == 2


def test_a_large_class_fits_a_page():
    sound(to_mark_page(classroom(1000), CHECKS, TITLE))


def test_who_gave_no_answer_is_named_with_what_could_not_be_placed():
    marks, note = [Mark("q6", 0, 3, records.BLANK)], "The text of cell 12 could not be placed."
    results = [Result("Ada", marks=marks, answers={"q6": " "}, notes=[note]), Result("Bo", marks=marks)]
    text = sound(to_mark_page(results, CHECKS, TITLE)).text
    assert "No answer, and 0 points unless you give others: Ada (0), Bo (0)." in text
    assert f"Ada: {note}" in text and "0 answers, none still to be read" in text and text.count(note) == 1
