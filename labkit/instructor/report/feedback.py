"""The page that a student gets back."""

from collections.abc import Collection, Sequence
from typing import NamedTuple

from ...guesses import told
from ..intake.guesses import PREFIX
from ..records import NOT_RUN, OPEN, UNSHUT, Check, Mark, Result
from .divided import divided
from .figures import Drawer
from .pages import LOOKS, Look, address, cut, render
from .texts import final, is_blank, plain
from .ways import ways


class Entry(NamedTuple):
    """What a student is told of one check, and nothing that must not be told.

    after: headings and texts that are shown once all is read.
    """

    title: str
    hidden: bool
    look: Look
    points: str
    written: bool
    answer: str
    reason: str
    mistake: str
    after: Sequence[tuple[str, str]]
    more: Sequence[str]
    lines: Sequence[str]


class Picture(NamedTuple):
    """The picture of a page; source: the address of the image."""

    heading: str
    shows: str
    reading: str
    source: str = ""


class Guess(NamedTuple):
    """A prediction: what it was about, the letter that was chosen, the one that is right, and why each was tempting."""

    name: str
    chosen: str
    right: str
    why: Sequence[tuple[str, str]]


SENTENCES = ("Also: ", "First mend ", "In `")  # how the sentences of a report begin that follow its first

PICTURES = {
    "run": Picture(
        "Your filter on the lab's run",
        "Left, the map: the true path and your estimate, with 3σ ellipses. Right, over time: the error in "
        "x and y and the 3σ bounds that your filter claims.",
        "A filter that knows how good it is keeps its error between the bounds nearly all the time, and "
        "the bounds are not much wider than the error.",
    ),
    "curve": Picture(
        "Your curve",
        "What your code computed, as a blue line, over the band in which a consistent filter lies.",
        "Above the band a filter trusts itself too much, below it too little.",
    ),
}


def all_read(results: Sequence[Result], checks: Sequence[Check]) -> frozenset[str]:
    """The written questions to which no answer waits to be read."""
    waiting = {mark.check for result in results for mark in result.marks if mark.status == OPEN}
    return frozenset(check.id for check in checks if check.hand and check.id not in waiting)


def feedback_page(
    result: Result,
    checks: Sequence[Check],
    title: str,
    drawer: Drawer | None = None,
    solved: Collection[str] = frozenset(),
) -> str:
    """The HTML of a student's page. checks: all of the lab, in order; without a drawer there is no picture.

    solved: the written questions of which the student sees rubric and model answer.
    """
    given = {mark.check: mark for mark in result.marks}
    shown = [] if result.problem and not given else checks
    return render(
        "feedback",
        result=result,
        title=title,
        ways=ways(result.lab, "", "../../"),
        most=result.max_points or sum(check.points for check in checks),
        origin=_origin(result),
        notes=_notes(result),
        entries=_once([_entry(check, given.get(check.id), result, check.id in solved) for check in shown]),
        divided=divided(result, shown),
        picture=_picture(result, drawer),
        guesses=_guesses(result),
    )


def _origin(result: Result) -> str:
    file = result.source.replace("\\", "/").rpartition("/")[2]
    return f"Handed in: {file}" + (f", {result.when:%Y-%m-%d %H:%M}" if result.when else "") if file else ""


def _notes(result: Result) -> list[str]:
    late = result.late and not any("late" in str(note).lower() for note in (*result.notes, *result.ruling.told))
    unshut = any(mark.reason.endswith(UNSHUT) for mark in result.marks)
    return [*["This was handed in late."] * late, *["It was marked without a sandbox."] * unshut, *result.notes]


def _guesses(result: Result) -> list[Guess]:
    made = {key.removeprefix(PREFIX): letter for key, letter in result.answers.items() if key.startswith(PREFIX)}
    known = [(name, letter, told()[name]) for name, letter in made.items() if name in told()]
    return [
        Guess(name.replace("-", " "), letter, said["right"], [(k, why) for k, why in said.items() if k != "right"])
        for name, letter, said in known
    ]


def _once(entries: Sequence[Entry]) -> list[Entry]:
    """The entries, where what several would tell in the same words is told by the first; the others name it."""
    first: dict[str, str] = {}
    told = []
    for entry in entries:
        reason = entry.reason
        if reason in first and not entry.written:
            reason = f"The same as for “{first[reason]}”."
        mistake = "" if entry.mistake in first and reason != entry.reason else entry.mistake
        if mistake in first:
            mistake = f"This is explained at “{first[mistake]}”."
        for sentence in filter(None, (entry.reason, entry.mistake)):
            first.setdefault(sentence, entry.title)
        told.append(entry._replace(reason=reason, mistake=mistake))
    return told


def _entry(check: Check, mark: Mark | None, result: Result, solved: bool) -> Entry:
    answer = result.answers.get(check.id, "")
    after = [("How it is marked", check.rubric), ("A model answer", check.model)] if check.hand and solved else []
    mark = mark or Mark(check.id, 0, check.points, NOT_RUN)
    points = "–" if mark.points is None else plain(mark.points, 2)
    new = not check.hidden and mark.mistake not in mark.reason  # the reason is all that is told of a hidden check
    return Entry(
        check.title,
        check.hidden,
        LOOKS.get(mark.status) or Look("wait", "?", cut(mark.status, 20)),
        f"{points} of {plain(mark.max_points, 2)}",
        check.hand,
        answer if check.hand and not is_blank(answer) else "",
        final(mark.reason.removesuffix(UNSHUT).rstrip()),
        mark.mistake if new else "",
        [(heading, text) for heading, text in after if text.strip()],
        *(((), ()) if check.hidden else _apart(mark.lines)),
    )


def _apart(lines):
    """(sentences, other lines) of a report: its sentences are folded for a terminal, and a page folds by itself."""
    sentences, others, inside = [], [], False
    for line in lines:
        inside = line.startswith(SENTENCES) or inside and not line.startswith(" ")
        if line.startswith(SENTENCES):
            sentences.append(line)
        elif inside:
            sentences[-1] += f" {line}"
        else:
            others.append(line)
    return sentences, others


def _picture(result: Result, drawer: Drawer | None) -> Picture | None:
    image = drawer.png(result.figure) if drawer and result.figure else None
    kind = "run" if "P" in result.figure else "curve"
    return PICTURES[kind]._replace(source=address(image)) if image else None
