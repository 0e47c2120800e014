"""The page that a student gets back, and the page from which written answers are marked."""

import base64
from collections import defaultdict

from . import records
from .page import counted, number, page, text
from .tables import labels

LOOKS = {  # status: (class, symbol, word)
    records.PASSED: ("good", "✓", "passed"),
    records.FAILED: ("bad", "✗", "not yet"),
    records.NOT_RUN: ("bad", "–", "not run"),
    records.ERROR: ("wait", "!", "not graded"),
    records.OPEN: ("wait", "…", "to be read"),
    records.BY_HAND: ("good", "✎", "marked"),
}


def feedback_page(result, checks, title, drawer=None):
    """The HTML of a student's page. checks: the lab's records.Check in order; drawer: a figures.Drawer."""
    known = {check.id: check for check in checks}
    parts = [f"<h1>{text(title, 200)}</h1>", f'<p class="soft">{text(result.student, 200)}</p>']
    if result.problem:
        parts.append(
            '<article class="bad"><h3>This hand-in could not be graded.</h3>'
            f"<p>{text(result.problem)}</p><p>Put that right and hand it in again, or ask your instructor.</p></article>"
        )
        return page(f"{title}: {result.student}", *parts, _notes(result))
    waiting = f" {counted(result.open, 'written answer')} still to be read." if result.open else ""
    parts.append(
        f'<p class="points"><b>{number(result.points)}</b> of {number(result.max_points)} points'
        f'{" so far." if waiting else "."}<span class="soft">{waiting}</span></p>'
    )
    parts += [_notes(result), _picture(result, drawer), "<h2>Checks</h2>"]
    parts += [_mark(mark, known.get(mark.check)) for mark in result.marks if not _by_hand(mark, known)]
    written = [mark for mark in result.marks if _by_hand(mark, known)]
    if written:
        parts.append("<h2>Written answers</h2>")
        parts += [_mark(mark, known[mark.check], result.answers.get(mark.check, "")) for mark in written]
    parts.append(
        '<p class="soft">A <i>hidden check</i> tries your code on inputs that were drawn for you alone. It tells what went '
        "wrong, and not with which numbers. The checks in the notebook show everything: begin there.</p>"
    )
    return page(f"{title}: {result.student}", *parts)


def _by_hand(mark, known):
    return mark.check in known and known[mark.check].hand


def _notes(result):
    handed = f"Handed in {result.when:%d %B %Y, %H:%M}: " if result.when else "Handed in: "
    lines = [f"{handed}{result.source.rpartition('/')[2] or result.source}"] + result.notes
    return '<p class="soft">' + "<br>".join(text(line, 400) for line in lines) + "</p>"


def _picture(result, drawer):
    image = drawer.png(result.figure) if drawer and result.figure else None
    if not image:
        return ""
    data = base64.b64encode(image).decode("ascii")
    what = "What your own code estimated on the notebook's first run" if "P" in result.figure else "What your own code computed"
    return (
        f'<h2>Your result</h2><img src="data:image/png;base64,{data}" alt="{what}, drawn over the truth or its bounds.">'
        f'<p class="soft">{what}.</p>'
    )


def _mark(mark, check, answer=None):
    look, symbol, word = LOOKS[mark.status]
    points = "" if mark.points is None else number(mark.points)
    title, hidden = (check.title, check.hidden) if check else (mark.check, False)
    tag = '<span class="tag">hidden check</span>' if hidden else ""
    of = f"{points} of {number(mark.max_points)}" if points else f"of {number(mark.max_points)}"
    lines = [
        f'<article class="{look}"><div class="head"><span class="word">{symbol} {word}</span>'
        f'<h3>{text(title, 200)}</h3>{tag}<span class="sum">{of}</span></div>'
    ]
    if answer is not None:
        lines.append(f'<div class="answer">{text(answer)}</div>' if answer.strip() else '<p class="soft">(no answer)</p>')
    if mark.reason:
        lines.append(f"<p>{text(mark.reason)}</p>")
    if mark.mistake and mark.mistake not in mark.reason:
        lines.append(f"<p>{text(mark.mistake)}</p>")
    if mark.lines:
        shown = "\n".join(str(line) for line in mark.lines)
        lines.append(f"<pre>{text(shown)}</pre>")
    return "\n".join([*lines, "</article>"])


def to_mark_page(results, checks, title):
    """The HTML of all written answers, question by question, for the instructor."""
    parts = [
        f"<h1>Written answers: {text(title, 200)}</h1>",
        "<p>Give points in the column <code>points</code> of <code>grades.csv</code> (and a comment in <code>reason</code>, "
        "if you like), then run the same command again. Marks that you gave are never overwritten.</p>",
    ]
    named = list(zip(labels(results), results))
    for check in (check for check in checks if check.hand):
        parts += [f"<h2>{text(check.title, 200)} ({number(check.points)} points, <code>{text(check.id)}</code>)</h2>"]
        parts += [f"<details><summary>Question</summary><pre>{text(check.question)}</pre></details>"] if check.question else []
        parts += [f"<pre>{text(check.rubric)}</pre>"] if check.rubric else []
        groups, empty = defaultdict(list), []
        for label, result in named:
            mark = next((mark for mark in result.marks if mark.check == check.id), None)
            if mark is None:
                continue
            answer = result.answers.get(check.id, "").strip()
            (groups[answer] if answer else empty).append((label, mark))
        for answer, who in groups.items():
            same = f'<p class="tag">{len(who)} students gave this same answer</p>' if len(who) > 1 else ""
            points = ", ".join(
                text(label, 200) + (f" ({number(mark.points)})" if mark.points is not None else "") for label, mark in who
            )
            look = "good" if all(mark.points is not None for _, mark in who) else "wait"
            parts.append(f'<article class="{look}"><h3>{points}</h3>{same}<div class="answer">{text(answer)}</div></article>')
        if empty:
            names = ", ".join(text(label, 200) for label, _ in empty)
            parts.append(f'<p class="soft">No answer: {names}.</p>')
        if not groups and not empty:
            parts.append('<p class="soft">Nobody handed this in yet.</p>')
    return page(f"Written answers: {title}", *parts)
