"""The page that a student gets back: what it shows, and what it must not."""

from dataclasses import replace
from datetime import datetime

from labkit.instructor import records
from labkit.instructor.records import UNSHUT, Mark, Result
from labkit.instructor.report.feedback import all_read, feedback_page
from labkit.instructor.report.figures import Drawer

from helpers.graded import CHECKS, LINES, MISTAKES, TITLE, curve, sound


def test_a_student_sees_points_words_and_reasons():
    marks = [
        Mark("h", 2, 2, records.PASSED),
        Mark("jacobian", 0, 2, records.FAILED, "Not yet right: one landmark.", LINES, MISTAKES["jacobian"]),
        Mark("kf-none", 0, 2, records.NOT_RUN, "`KF` is still to be written."),
        Mark("kf-one", 0, 3, records.ERROR, "This check could not be run."),
        Mark("q6", None, 3, records.OPEN),
        Mark("q7", 1.5, 2.5, records.BY_HAND, "Well said."),
    ]
    result = Result(
        "Zoë Müller", "7", "lab3", "a/lab3.ipynb", datetime(2026, 3, 2, 9, 5), True, ["One cell is missing."]
    )
    result.marks, result.figure, result.answers = marks, curve(), {"q6": "two\nlines", "q7": "  "}
    page = feedback_page(result, CHECKS, TITLE, Drawer())
    seen = sound(page)
    for told in (
        TITLE,
        "Zoë Müller",
        "3.5 of 14.5 points so far",
        "1 written answer still to be read",
        "One cell is missing.",
        "2026-03-02 09:05",
        "This was handed in late.",
        "✓passed",
        "✗not passed",
        "–not run",
        "!not graded",
        "…to be read",
        "✎by hand",
        "Well said.",
        "squared range",
        "came xk_k",
        "two lines",
        "You gave no answer.",
        "2 of 2",
        "– of 3",
        "1.5 of 2.5",
        "hidden check",
    ):
        assert told in seen.text, told
    order = [seen.text.index(check.title.replace("`", "")) for check in CHECKS]
    assert order == sorted(order)
    assert next(value for _, name, value in seen.attributes if name == "alt").startswith("What your code computed")


def test_a_comment_to_a_written_answer_has_formulas_and_no_html():
    result = Result("Ada", "7", "lab3", "a/lab3.ipynb")
    result.marks = [Mark("q7", 1, 2.5, records.BY_HAND, "Since $\\sqrt{2}$ grows.\n\nSee <script>x</script>.")]
    page = feedback_page(result, CHECKS, TITLE)
    seen = sound(page)
    assert "<msqrt>" in page and "$" not in seen.text and "<script>x</script>." in seen.text


def test_sentences_that_were_folded_for_a_terminal_are_whole_again():
    lines = [
        "  call      predict(1)",
        "  came      2",
        "Also: R, as it",
        "stands in `S`, is off.",
        "First mend `h`: it is",
        "off.",
    ]
    result = Result("Ada", marks=[Mark("jacobian", 0, 2, records.FAILED, "Not yet right.", lines)])
    page = feedback_page(result, CHECKS, TITLE)
    assert "<p>Also: R, as it stands in <code>S</code>, is off.</p>" in page
    assert "<p>First mend <code>h</code>: it is off.</p>" in page and page.count('class="line"') == 2


def test_what_could_not_be_graded_says_what_to_do():
    result = Result("Ada", problem="The file is not a notebook.")
    seen = sound(feedback_page(result, CHECKS, TITLE))
    assert "The file is not a notebook." in seen.text and "What to do" in seen.text and "Question" not in seen.text


def test_nothing_leaks_of_hidden_checks_and_of_rubrics():
    shown = Mark("kf-map", 0, 4, records.FAILED, "It fails on another map.", ("SECRET-LINE",), "SECRET-MISTAKE")
    result = Result("Ada", marks=[shown], answers={"q6": "mine", "kf-map": "SECRET-ANSWER"})
    page = feedback_page(result, CHECKS, TITLE)
    assert "SECRET" not in page and "It fails on another map." in page


def test_a_long_answer_is_cut_and_says_so():
    result = Result("Ada", marks=[Mark("q6", None, 3, records.OPEN)], answers={"q6": "word " * 2000})
    assert "(cut here: 5,000 more characters)" in sound(feedback_page(result, CHECKS, TITLE)).text


def test_the_same_reason_is_told_once_and_then_referred_to():
    reason, mistake = "This part is still to be written.", "The sign of the innovation is wrong."
    marks = [Mark(check.id, 0, check.points, records.FAILED, reason, (), mistake) for check in CHECKS if not check.hand]
    text = sound(feedback_page(Result("Ada", marks=marks), CHECKS, TITLE)).text
    assert text.count(reason) == text.count(mistake) == 1
    assert text.count("The same as for “h: range and bearing of one landmark”.") == len(marks) - 1


def test_what_holds_for_the_whole_notebook_is_told_once():
    marks = [Mark(check.id, check.points, check.points, records.PASSED, UNSHUT) for check in CHECKS if not check.hand]
    notes = ["Cell 7 could not be placed: it defines `KF` a second time."]
    text = sound(feedback_page(Result("Ada", marks=marks, notes=notes), CHECKS, TITLE)).text
    assert text.count("without a sandbox") == 1 and "same as for" not in text
    assert text.index("About what you handed in") < text.index("Cell 7 could not be placed") < text.index("What was")


def test_no_colours_of_a_terminal_and_no_hope_where_a_mark_is_final():
    reason = "\x1b[0;31mNameError\x1b[0m: \x1b]0;title\x07no \x1b[38;5;12m'exam'\x9b0m"
    marks = [Mark("h", 0, 2, records.FAILED, reason, (reason,))]
    marks += [Mark("jacobian", 0, 2, records.FAILED, "Not yet right: one landmark.")]
    text = sound(feedback_page(Result("Ada", marks=marks), CHECKS, TITLE)).text
    assert (
        text.count("NameError: no 'exam'") == 2
        and "[0" not in text
        and "not yet" not in text.lower()
        and "Not right: one" in text
    )


def test_rubric_and_model_answer_are_shown_only_when_asked_for_and_all_is_read():
    checks = [replace(check, model="SECRET-MODEL $r$") for check in CHECKS]
    ada = Result("Ada", marks=[Mark("q6", 1, 3, records.BY_HAND), Mark("q7", None, 2.5, records.OPEN)])
    bela = Result("Bela", marks=[Mark("q6", 0, 3, records.BLANK), Mark("q7", 2, 2.5, records.BY_HAND)])
    assert all_read([ada, bela], checks) == {"q6"}
    assert "SECRET" not in feedback_page(ada, checks, TITLE)
    page = feedback_page(ada, checks, TITLE, solved=all_read([ada, bela], checks))
    text = sound(page).text
    assert text.count("A model answerSECRET-MODEL r") == text.count("How it is markedSECRET-RUBRIC") == 1
    hidden = feedback_page(ada, checks, TITLE, solved={check.id for check in checks})
    assert hidden.count("SECRET-MODEL") == 2 and "SECRET-Q" not in hidden  # those of the two written questions
