"""The page that a student gets back, and the page from which written answers are marked."""

import base64
from collections import defaultdict

from .. import records
from .page import ANSWER, LINE, RUBRIC, TITLE, box, counted, name, number, page, prose, region, text
from .tables import labels

LINES = 60  # lines of a report that are shown
LONG = 2500  # characters, from which on paper an entry may run over the end of a sheet
LOOKS = {  # status: (class, sign, word)
    records.PASSED: ("good", "✓", "passed"),
    records.FAILED: ("bad", "✗", "not yet"),
    records.NOT_RUN: ("wait", "–", "not run"),
    records.ERROR: ("wait", "!", "not graded"),
    records.OPEN: ("wait", "…", "to be read"),
    records.BY_HAND: ("good", "✎", "by hand"),
}
PICTURES = {  # kind: (title, what it shows, how to read it)
    "run": (
        "Your filter on the lab's run",
        "Left, the map: the true path and your estimate, with 3σ ellipses. Right, over time: the error in "
        "x and y and the 3σ bounds that your filter claims.",
        "A filter that knows how good it is keeps its error between the bounds nearly all the time, and "
        "the bounds are not much wider than the error.",
    ),
    "curve": (
        "Your curve",
        "What your code computed, as a blue line, over the band in which a consistent filter lies.",
        "Above the band a filter trusts itself too much, below it too little.",
    ),
}


def feedback_page(result, checks, title, drawer=None):
    """The HTML of a student's page. checks: the lab's records.Check in order; drawer: a figures.Drawer."""
    given = {mark.check: mark for mark in result.marks}
    shown = [] if result.problem and not given else checks
    return page(
        f"{title}: {result.student}",
        f'<header><h1>{text(title, TITLE)}</h1><p class="soft">{name(result.student)}</p></header>',
        _problem(result) if result.problem else _points(result, checks),
        _notes(result),
        '<h2>What was checked</h2>\n<ol class="checks">' if shown else "",
        *[_check(check, given.get(check.id), result.answers.get(check.id, "")) for check in shown],
        "</ol>" if shown else "",
        _about_hidden() if any(check.hidden for check in shown) else "",
        _picture(result, drawer),
    )


def _points(result, checks):
    most = result.max_points or sum(check.points for check in checks)
    told = f'<p class="points"><b>{number(result.points)}</b> of {number(most)} points'
    if not result.open:
        return f"{told}</p>"
    waiting = f"{counted(result.open, 'written answer')} still to be read."
    return f'{told} so far<br><span class="soft small">{waiting}</span></p>'


def _problem(result):
    return (
        f'<div class="problem"><h2>This could not be graded</h2><p>{prose(result.problem)}</p>'
        "<p>What to do: open your notebook, choose <i>Run → Run All Cells</i>, save it, and hand in the "
        "saved <code>.ipynb</code> file again. "
        "If this page stays the same, show it to your instructor.</p></div>"
    )


def _notes(result):
    file = result.source.replace("\\", "/").rpartition("/")[2]
    told = [f"Handed in: {file}" + (f", {result.when:%Y-%m-%d %H:%M}" if result.when else "")] if file else []
    late = result.late and not any("late" in str(note).lower() for note in result.notes)
    told += [*["This was handed in late."] * late, *result.notes]
    items = "".join(f"<li>{prose(line, LINE)}</li>" for line in told)
    return f'<ul class="soft small">{items}</ul>' if told else ""


def _check(check, mark, answer):
    mark = mark or records.Mark(check.id, 0, check.points, records.NOT_RUN)
    look, sign, word = LOOKS.get(mark.status, ("wait", "?", text(mark.status, 20)))
    points = "–" if mark.points is None else number(mark.points)
    told = []
    if check.hand:
        none = '<p class="soft">You gave no answer.</p>'
        told.append(box(answer, ANSWER, "your answer") if answer.strip() else none)
    told += [f"<p>{prose(mark.reason)}</p>"] if mark.reason else []
    if not check.hidden:  # the reason is all that may be told of a hidden check
        told += [f"<p>{prose(mark.mistake)}</p>"] if mark.mistake and mark.mistake not in mark.reason else []
        told += [_lines(mark.lines)] if mark.lines else []
    tag = ' <span class="tag">hidden check</span>' if check.hidden else ""
    points = f'<span class="sum">{points} of {number(mark.max_points)}</span>'
    return _row(look, sign, word, f"{prose(check.title, TITLE)}{tag}", points, told)


def _row(look, sign, word, heading, points, told):
    """One entry of a list: sign and word, so that nothing is told by its colour alone."""
    told = "".join(told)
    long = " long" if len(told) > LONG else ""
    return (
        f'<li class="check {look}{long}">'
        f'<span class="word"><span class="sign" aria-hidden="true">{sign}</span>{word}</span>'
        f"<h3>{heading}</h3>{points}" + (f'<div class="told">{told}</div>' if told else "") + "</li>"
    )


def _lines(lines):
    shown = "".join(f'<span class="line">{text(line, LINE)}</span>' for line in lines[:LINES])
    rest = len(lines) - LINES
    more = f'<p class="soft small">({counted(rest, "more line")})</p>' if rest > 0 else ""
    return f'<div class="box lines" {region("details")}>{shown}</div>{more}'


def _about_hidden():
    return (
        '<p class="soft small">A <i>hidden check</i> tries your code on inputs that you have not seen. '
        "This page says what went wrong there, but not with which numbers; the checks in the notebook "
        "show everything, so begin with those.</p>"
    )


def _picture(result, drawer):
    image = drawer.png(result.figure) if drawer and result.figure else None
    if not image:
        return ""
    heading, what, reading = PICTURES["run" if "P" in result.figure else "curve"]
    source = "data:image/png;base64," + base64.b64encode(image).decode("ascii")
    return (
        f'<h2>{heading}</h2>\n<figure><div class="scroll" {region("picture")}>'
        f'<img src="{source}" alt="{what}"></div>'
        f'<figcaption class="small">{what} {reading}</figcaption></figure>'
    )


def to_mark_page(results, checks, title):
    """The HTML of all written answers, question by question, for the instructor."""
    results = list(results)
    named = list(zip(labels(results), results))
    written = [check for check in checks if check.hand]
    how = (
        "<p>Write the points into the column <code>points</code> of <code>grades.csv</code>, and a comment "
        "for the student into <code>reason</code> if you like; then run the same command again. "
        "All pages and tables then have them.</p>"
    )
    return page(
        f"Written answers: {title}",
        f"<header><h1>Written answers</h1><p class='soft'>{text(title, TITLE)}</p></header>",
        how if written else "<p>This lab has no written question.</p>",
        *[_question(check, named) for check in written],
    )


def _question(check, named):
    groups, empty = defaultdict(list), []
    for label, result in named:
        mark = next((mark for mark in result.marks if mark.check == check.id), None)
        answer = result.answers.get(check.id, "").strip()
        if mark and answer:
            groups[answer].append((label, mark))
        elif mark:
            empty.append((label, mark))
    order = sorted(groups.items(), key=lambda pair: (_read(pair[1]), min(map(_order, pair[1]))))
    nobody = ", ".join(map(_given, sorted(empty, key=_order)))
    told = f"{counted(check.points, 'point')}; <code>{text(check.id, TITLE)}</code> in grades.csv"
    return "\n".join(
        [
            f"<section><h2>{prose(check.title, TITLE)}</h2>",
            f'<p class="soft">{told}. {_progress(groups.values(), empty)}.</p>',
            f"<h3>Question</h3>{box(check.question, RUBRIC, 'question')}" if check.question.strip() else "",
            f"<h3>How to mark it</h3>{box(check.rubric, RUBRIC, 'rubric')}" if check.rubric.strip() else "",
            '<ol class="checks">' if groups else "",
            *[_group(answer, who) for answer, who in order],
            "</ol>" if groups else "",
            f'<p class="soft">No answer: {nobody}.</p>' if empty else "",
            "</section>",
        ]
    )


def _progress(groups, empty):
    handed = sum(map(len, groups))
    if not handed and not empty:
        return "Nobody has handed this in yet"
    waiting = sum(mark.points is None for who in [empty, *groups] for _, mark in who)
    return f"{counted(handed, 'answer')}, {waiting or 'none'} still to be read"


def _group(answer, who):
    who = sorted(who, key=_order)
    look, sign, word = LOOKS[records.BY_HAND if _read(who) else records.OPEN]
    same = f'<p class="soft small">{len(who)} students gave this same answer.</p>' if len(who) > 1 else ""
    told = [same, box(answer, RUBRIC, "answer")]
    return _row(look, sign, word, ", ".join(map(_given, who)), "", told)


def _order(pair):
    return pair[0].casefold()


def _read(who):
    return all(mark.points is not None for _, mark in who)


def _given(pair):
    """'Ada Byron', or 'Ada Byron (1.5)' once there are points."""
    label, mark = pair
    return name(label) + ("" if mark.points is None else f" ({number(mark.points)})")
