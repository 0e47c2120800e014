"""What there is to read: the written answers of a gradebook, by question and alike ones together, and their marks."""

import hashlib
from dataclasses import replace
from typing import NamedTuple

from ..exam.paper import read as read_paper
from ..policy import course_of, variants
from ..records import BLANK, BY_HAND, OPEN, Check, Result
from ..report.by_hand import Given, Slot
from ..report.gradebook import Gradebook
from ..report.names import labels
from ..report.texts import is_blank
from .alike import groups

NEVER = Given(0, "", None, "", (), "", None)  # nobody has marked it


class Answer(NamedTuple):
    """A student's answer to one question. label: what the student is called;  blank: whether nobody wrote anything."""

    label: str
    result: Result
    text: str
    blank: bool

    @property
    def id(self) -> int:
        """The number of the submission."""
        return self.result.id


class Group(NamedTuple):
    """Answers that are read together. variants: the different ones of them, each with all who gave it."""

    variants: list[list[Answer]]

    @property
    def answers(self) -> list[Answer]:
        """All of them."""
        return [answer for variant in self.variants for answer in variant]

    @property
    def id(self) -> int:
        """That of its first answer, by which the group is found."""
        return self.variants[0][0].id


class Question(NamedTuple):
    """A written question with the groups of its answers. key: its name in addresses;  apart: whether each answer
    is read alone, since students have numbers of their own.
    """

    key: str
    lab: str
    check: Check
    groups: list[Group]
    apart: bool = False

    @property
    def answers(self) -> list[Answer]:
        """All answers to it."""
        return [answer for group in self.groups for answer in group.answers]

    def group(self, id: int) -> Group | None:
        """The group in which the answer of this submission is."""
        return next((group for group in self.groups if any(answer.id == id for answer in group.answers)), None)


class Desk:
    """The answers of `book`, as they are now: `refresh` looks again. questions: {key: Question}."""

    def __init__(self, book: Gradebook) -> None:
        self.book, self.questions = book, dict[str, Question]()
        self._version, self._counting = -1, dict[int, tuple[str, ...]]()
        self._given: dict[str, dict[tuple[str, str, str], Given]] = {}
        self._results: dict[int, Result] = {}
        self._apart = dict[str, bool]()
        self.refresh()

    def refresh(self, anew: bool = False) -> None:
        """Take in what others have written into the gradebook since; anew: what was written here, too."""
        version = self.book.version()
        if version == self._version and not anew:
            return
        counting = self.book.counting()
        if counting != self._counting:
            self._collect(counting)
        self._given = {lab: self.book.hands.newest(lab) for lab in {lab for lab, *_ in counting.values()}}
        self._version, self._counting = version, counting

    def _collect(self, counting: dict[int, tuple[str, ...]]) -> None:
        """Read hand-ins that are new, and put the answers together where some have changed."""
        known = self._results
        self._results = {
            id: replace(known.get(id) or self.book.result(id), student=student, identifier=identifier)
            for id, (_, student, identifier) in counting.items()
        }
        before, self.questions = self.questions, {}
        for lab in sorted({lab for lab, *_ in counting.values()}):
            results = [result for result in self._results.values() if result.lab == lab and not result.problem]
            named = list(zip(labels(results), results))
            if lab not in self._apart:
                self._apart[lab] = _apart(self.book, lab)
            for check in self.book.hands.questions(lab):
                key = hashlib.sha256(f"{lab}\n{check.id}\n{check.points}".encode()).hexdigest()[:10]
                answers = [
                    Answer(label, result, text := result.answers.get(check.id, ""), is_blank(text))
                    for label, result in named
                    if any(mark.check == check.id and mark.max_points == check.points for mark in result.marks)
                ]
                if answers:
                    self.questions[key] = _question(key, lab, check, answers, self._apart[lab], before.get(key))

    def given(self, question: Question, answer: Answer) -> Given:
        """The newest mark that a person gave to an answer, `NEVER` if there is none."""
        of = (answer.result.student, answer.result.identifier, question.check.id)
        return self._given[question.lab].get(of, NEVER)

    def status(self, question: Question, answer: Answer) -> str:
        """`BY_HAND` if it is marked, as it is now; `BLANK` if there is nothing to read, else `OPEN`."""
        given = self.given(question, answer)
        if given.points is not None and (given.answer == answer.text or answer.blank):
            return BY_HAND
        return BLANK if answer.blank else OPEN

    def open(self, question: Question, group: Group) -> list[Answer]:
        """The answers of a group that are to be read."""
        return [answer for answer in group.answers if self.status(question, answer) == OPEN]

    def slots(self, question: Question, seen: dict[int, int]) -> list[Slot] | None:
        """Where marks go that somebody gives who has `seen`, {id of a submission: number of its newest mark}.

        None if one of these is not there any more.
        """
        there = {answer.id: answer for answer in question.answers}
        if not seen.keys() <= there.keys():
            return None
        return [Slot(there[id].result, question.check.id, number) for id, number in seen.items()]

    def next(self, reader: str, question: Question, after: int = 0) -> Group | None:
        """The next group with something to read at which nobody else looks, kept for this reader. after: the id of
        the group behind which it is looked for.
        """
        places = [n for n, group in enumerate(question.groups) if any(a.id == after for a in group.answers)]
        start = places[0] + 1 if places else 0
        order = question.groups[start:] + question.groups[:start]
        waiting = [(group, ids) for group in order if (ids := [answer.id for answer in self.open(question, group)])]
        place = self.book.hands.deal(reader, question.check.id, [ids for _, ids in waiting])
        return None if place is None else waiting[place][0]


def _apart(book: Gradebook, lab: str) -> bool:
    course = course_of(book, lab)
    return bool(course.variants) and variants.own(read_paper(lab), course)


def _question(
    key: str, lab: str, check: Check, answers: list[Answer], apart: bool, before: Question | None
) -> Question:
    """The question with its answers in groups; those of before, if all answers are the same."""
    if before and {(a.id, a.label) for a in before.answers} == {(a.id, a.label) for a in answers}:
        return before._replace(check=check)
    if apart:
        read = [Group([[answer]]) for answer in answers if not answer.blank]
        blank = [answer for answer in answers if answer.blank]
        return Question(key, lab, check, read + [Group([blank])] * bool(blank), apart)
    found = groups([answer.text for answer in answers])
    return Question(key, lab, check, [Group([[answers[n] for n in same] for same in group]) for group in found])
