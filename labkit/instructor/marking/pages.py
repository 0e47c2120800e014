"""The pages of `labkit mark` as HTML."""

from collections.abc import Sequence
from typing import NamedTuple

from ..records import BY_HAND, OPEN
from ..report.by_hand import Given
from ..report.markdown import inline
from ..report.pages import LINE, environment
from ..report.texts import clean, cut, plain
from . import rubric
from .alike import differences
from .desk import Answer, Desk, Group, Question

LONG_ANSWER = 20_000  # characters of an answer that are shown at once
COMMENTS = 20  # reusable ones that are offered
EARLIER = 3  # marks before the one that counts, of one student


class Shown(NamedTuple):
    """An answer's mark on the page. chosen: whether it gets the one that is given now."""

    answer: Answer
    given: Given
    chosen: bool
    told: str
    before: str


class Variant(NamedTuple):
    """One of the different texts in a group, with whoever gave it."""

    text: str
    differences: list[tuple[str, str]]
    slots: list[Shown]
    notes: list[str]


class Pages:
    """Makes the pages about what is on the desk. root: the address of all, with its token."""

    def __init__(self, desk: Desk, root: str) -> None:
        self.desk, self.root = desk, root

    def ask(self) -> str:
        """The page that asks for the reader's name."""
        known = {who for lab in self._labs() for who in self.desk.book.hands.readers(lab)}
        return self._page("ask", "", readers=sorted(known - {""}))

    def overview(self, home: str, reader: str) -> str:
        """All questions with how far they are read. home: the address of this reader's pages."""
        labs = []
        for lab in self._labs():
            mine = [question for question in self.desk.questions.values() if question.lab == lab]
            readers = {who or "(before)": count for who, count in self.desk.book.hands.readers(lab).items()}
            labs.append((lab, [(question, *self._counts(question)) for question in mine], readers))
        return self._page("overview", home, reader=reader, labs=labs)

    def every(self, home: str, reader: str, question: Question) -> str:
        """All answers to a question, with who gave what."""
        rows = [(group, [answer.label for answer in group.answers], *self._marks(question, group))
                for group in question.groups]  # fmt: skip
        held = self.desk.book.hands.held(question.check.id)
        waiting = [held.get(a.id, reader) for group in question.groups for a in self.desk.open(question, group)]
        elsewhere = sorted(set(waiting)) if reader not in waiting else []
        about = {"rows": rows, "waiting": waiting, "elsewhere": elsewhere, "progress": self._progress(question)}
        return self._page("all", home, question=question, **about)

    def mark(self, home: str, reader: str, question: Question, group: Group) -> str:
        """The page on which a group of answers is marked."""
        variants = self._variants(question, group)
        slots = [slot for variant in variants for slot in variant.slots]
        first = next((slot.given for slot in slots if slot.chosen), slots[0].given)
        prefilled = first.points is not None and all(slot.given.points is not None for slot in slots if slot.chosen)
        around, lines = rubric.read(question.check.rubric)
        place = question.groups.index(group)
        held = self.desk.book.hands.held(question.check.id)
        return self._page(
            "mark",
            home,
            reader=reader,
            question=question,
            group=group,
            previous=question.groups[place - 1],
            variants=variants,
            several=len(slots) > 1,
            chosen=sum(slot.chosen for slot in slots),
            others=sorted({held[a.id] for a in group.answers if held.get(a.id, reader) != reader}),
            around=around,
            lines=lines,
            ticks=first.ticks if prefilled else (),
            points=plain(first.points or 0) if prefilled else "",
            comment=first.reason if prefilled else "",
            comments=self.desk.book.hands.comments(question.lab, question.check.id)[:COMMENTS],
            progress=self._progress(question),
            LONG_ANSWER=LONG_ANSWER,
        )

    def _page(self, template: str, home: str, **context: object) -> str:
        return _PAGES.get_template(f"{template}.html.j2").render(context, home=home, root=self.root)

    def _labs(self) -> list[str]:
        return sorted({question.lab for question in self.desk.questions.values()})

    def _counts(self, question: Question) -> tuple[int, int]:
        """(how many answers are read, how many there are to be read); those where nothing was written are neither."""
        states = [self.desk.status(question, answer) for answer in question.answers if not answer.blank]
        return states.count(BY_HAND), states.count(BY_HAND) + states.count(OPEN)

    def _progress(self, question: Question) -> str:
        return "{} of {} read.".format(*self._counts(question))

    def _marks(self, question: Question, group: Group) -> tuple[str, list[str]]:
        """(points as text, readers) of a group."""
        given = [self.desk.given(question, answer) for answer in group.answers]
        states = [self.desk.status(question, answer) for answer in group.answers]
        points = {plain(mark.points, 2) if mark.points is not None else "" for mark in given}
        told = [one for one in sorted(points) if one] + ["to be read"] * (OPEN in states)
        readers = sorted({mark.reader or "(before)" for mark in given if mark.points is not None})
        return ", ".join(told) or "no answer, 0", readers

    def _variants(self, question: Question, group: Group) -> list[Variant]:
        waiting = {answer.id for answer in self.desk.open(question, group)}
        first = group.variants[0][0].text
        found = []
        for variant in group.variants:
            text = variant[0].text
            other = differences(first, text) if variant is not group.variants[0] else []
            slots = [self._slot(question, answer, waiting) for answer in variant]
            notes = [note for answer in variant for note in answer.result.notes] if variant[0].blank else []
            found.append(Variant("" if variant[0].blank else text, other, slots, notes))
        return found

    def _slot(self, question: Question, answer: Answer, waiting: set[int]) -> Shown:
        given = self.desk.given(question, answer)
        told = before = ""
        if given.number:
            result = answer.result
            every = self.desk.book.hands.all_of(result.lab, result.student, result.identifier, question.check.id)
            told = said(given) if given.points is not None else ""
            if told and self.desk.status(question, answer) == OPEN:
                told += ", for another answer, which was handed in before"
            before = "; ".join(said(mark) for mark in every[-1 - EARLIER : -1] if mark.points is not None)
        chosen = answer.id in waiting or not waiting
        return Shown(answer, given, chosen, told, before)


def said(given: Given) -> str:
    """A mark as words: '1.5 by Emmy (Say why.)'."""
    if given.points is None:
        return "taken back"
    comment = f" ({cut(clean(given.reason), LINE)})" if given.reason.strip() else ""
    return f"{plain(given.points, 2)} by {given.reader or 'somebody'}{comment}"


def _first_words(text: str) -> str:
    words = clean(text)
    return (words[:80] + "…" if len(words) > 80 else words) or "(nothing)"


def looks() -> str:
    """The style sheet of all pages."""
    return source("style.css") + source("page.css")


def source(name: str) -> str:
    """One of the files that are no page."""
    assert _PAGES.loader
    return _PAGES.loader.get_source(_PAGES, name)[0]


def words(sentences: Sequence[str]) -> str:
    """Some sentences, and how many more there are."""
    more = [f"And {len(sentences) - 3} more."] if len(sentences) > 3 else []
    return " ".join([*sentences[:3], *more])


_PAGES = environment("labkit.instructor.marking", "labkit.instructor.report")
_PAGES.filters.update(inline=lambda text: inline(text, LINE), first_words=_first_words)
