"""Which answers are read together, and which lines of a rubric give points."""

import time

import pytest

from labkit.instructor.marking import rubric
from labkit.instructor.marking.alike import MOST, differences, groups, normal
from labkit.instructor.records import STUB

LONG = "The truth is inside the ellipse from the start since it is so large and it stays there until the 20th step."
PNG = "![plot](data:image/png;base64,{})"


def together(*texts):
    """The groups, each as sets of texts."""
    return [[{texts[place] for place in same} for same in group] for group in groups(texts)]


def test_the_same_words_are_one_text_whatever_stands_between_them():
    first, *others = groups([LONG, LONG.replace(" ", "\n"), LONG + "\u200b ", "no", "", STUB])
    assert first == [[0, 1, 2]] and [[4, 5]] in others and [[3]] in others
    assert normal(PNG.format("AA")) != normal(PNG.format("AB"))


def test_a_word_more_or_another_one_is_nearly_the_same():
    assert len(together(LONG, LONG.replace("large", "big"), LONG.replace("so ", ""))) == 1
    assert differences(LONG, LONG.replace("large", "big").replace("so ", "")) == [("so large", "big")]


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (LONG, LONG.replace("20th", "200th")),
        (LONG, LONG.replace("is inside", "is not inside")),
        (f"{LONG} $P > Q$", f"{LONG} $P < Q$"),
        (f"{LONG} $P$", f"{LONG} $S$"),
        (LONG + PNG.format("AA"), LONG + PNG.format("AB")),
        ("It grows with time.", "It shrinks with time."),
        (LONG, LONG + " " + LONG.replace("20", "30")),
    ],
)
def test_another_number_sign_picture_or_negation_is_another_answer(one, other):
    assert len(together(one, other)) == 2


def test_groups_are_no_longer_than_can_be_looked_through_and_the_largest_comes_first():
    words = [f"{first}{second}lpha" for first in "bcdfg" for second in "aeio"]
    near = [" ".join([*words[:n], "another", *words[n:]]) for n in range(20)]
    found = together("alone", *near, *near[:3])
    assert [len(group) for group in found] == [MOST, 20 - MOST, 1] and found[-1] == [{"alone"}]


def test_many_long_answers_are_grouped_in_no_time():
    texts = [" ".join(f"w{(n * k) % 97}x" for k in range(200)) for n in range(1, 200)] + ["x " * 200_000]
    start = time.process_time()
    groups(texts)
    assert time.process_time() - start < 5


def test_lines_that_give_points_are_told_from_the_text_around_them():
    around, lines = rubric.read(
        "**Q, 3 points.**\n- 1 point: the *reason*\n  goes on\n- 1,5 points - both\n* 2 pts. all\n- no points\nEnd."
    )
    assert lines == [(1, "the *reason* goes on"), (1.5, "both"), (2, "all")]
    assert around == "**Q, 3 points.**\n- no points\nEnd."
    assert rubric.read("") == ("", [])
