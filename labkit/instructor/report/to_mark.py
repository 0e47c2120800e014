"""The page from which written answers are marked."""

from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

from ..records import BY_HAND, OPEN, Check, Result
from .names import labels
from .pages import LOOKS, Look, render
from .texts import counted, is_blank
from .ways import ways

Given = tuple[str, float | None]  # a student's label, and the points, None while the answer waits to be read


class Group(NamedTuple):
    """An answer and who gave it."""

    answer: str
    who: list[Given]
    look: Look


class Question(NamedTuple):
    """A written question with all answers to it, those to be read first.

    empty: who gave none;  noted: of those (label, notes) where something of the notebook was odd.
    """

    check: Check
    progress: str
    groups: list[Group]
    empty: list[Given]
    noted: list[tuple[str, list[str]]]


def to_mark_page(results: Sequence[Result], checks: Sequence[Check], title: str, apart: bool = False) -> str:
    """The HTML of all written answers to one lab, question by question, for the instructor.

    apart: no answer stands for those of several students, whose numbers are their own.
    """
    named = list(zip(labels(results), results))
    questions = [_question(check, named, apart) for check in checks if check.hand]
    to = ways(results[0].lab, "marking") if results else ()
    return render("to_mark", title=title, ways=to, questions=questions, apart=apart)


def _question(check: Check, named: Sequence[tuple[str, Result]], apart: bool) -> Question:
    given: dict[tuple[str, int], list[Given]] = defaultdict(list)
    for place, (label, result) in enumerate(sorted(named, key=lambda pair: pair[0].casefold()), 1):
        text = result.answers.get(check.id, "").strip()
        answer = "" if is_blank(text) else text
        given[answer, place if apart and answer else 0] += [
            (label, mark.points) for mark in result.marks if mark.check == check.id
        ]
    everybody = [points for who in given.values() for _, points in who]
    empty = given.pop(("", 0), [])
    groups = [Group(answer, who, LOOKS[BY_HAND if _read(who) else OPEN]) for (answer, _), who in given.items() if who]
    groups.sort(key=lambda group: (_read(group.who), group.who[0][0].casefold()))
    if everybody:
        answers = counted(len(everybody) - len(empty), "answer")
        progress = f"{answers}, {everybody.count(None) or 'none'} still to be read"
    else:
        progress = "Nobody has handed this in yet"
    without = {label for label, _ in empty}
    noted = [(label, result.notes) for label, result in named if label in without and result.notes]
    return Question(check, progress, groups, empty, noted)


def _read(who: Sequence[Given]) -> bool:
    return all(points is not None for _, points in who)
