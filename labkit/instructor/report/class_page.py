"""The page about the whole class: what went wrong for how many, and what to explain again next week."""

import math
from collections import Counter, defaultdict
from statistics import median
from urllib.parse import quote

from .. import records
from .page import LINE, TITLE, counted, name, number, page, prose, region, text
from .pages import LOOKS
from .tables import labels

SIGNS = (records.PASSED, records.FAILED, records.NOT_RUN, records.ERROR)
MANY = 100  # rows, above which a table is folded away
BAR = "<th><span class='unseen'>bar</span></th>"  # the head of a column of bars
TOP = 12  # mistakes that are shown before the rest is folded away


def class_page(results, checks, title, pages, folder="feedback"):
    """The HTML of the class's page.

    results: of one lab;  pages: {label: file name of the feedback page} in `folder`/lab.
    """
    named = sorted(zip(labels(results), results), key=lambda pair: pair[0].casefold())
    graded = [result for result in results if not result.problem]
    written = [check for check in checks if check.hand]
    coded = [check for check in checks if not check.hand]
    return page(
        f"The class: {title}",
        f"<header><h1>The class</h1><p class='soft'>{text(title, TITLE)}</p></header>",
        _overview(results, graded),
        _spread(graded),
        _again(graded, checks),
        _checks(graded, coded),
        _written(graded, written),
        _unfit(named),
        _late(named),
        _students(named, coded, pages, folder),
    )


def _overview(results, graded):
    if not results:
        return "<p>Nobody has handed in anything yet.</p>"
    unfit, waiting = len(results) - len(graded), sum(result.open for result in graded)
    late, levels = sum(result.late for result in results), Counter(result.level for result in graded)
    lines = [f"<b>{counted(len(graded), 'student')}</b> graded"]
    lines += [f"{unfit} could not be graded"] if unfit else []
    lines += [f"{late} late"] if late else []
    lines += [f"{counted(waiting, 'written answer')} still to be read"] if waiting else []
    return f"<p>{', '.join(lines)}.</p>{_sandbox(levels)}"


def _sandbox(levels):
    """levels: {level: how many students' code ran at it}."""
    if not levels:
        return ""
    order = sorted(levels, reverse=True)
    each = [f"level {level} for {counted(levels[level], 'student')}" for level in order]
    told = f"<p class='soft'>Sandbox: {', '.join(each) if len(each) > 1 else f'level {min(levels)}'}.</p>"
    if 0 in levels:
        told += "<p><b>Level 0 is no sandbox:</b> that code could read and change files of yours.</p>"
    return told


def _spread(graded):
    """How many students have how many points, as bars over the points."""
    most = max((result.max_points for result in graded), default=0)
    if not most:
        return ""
    points = [result.points for result in graded]
    step = next(s for s in _steps() if most / s <= 15)
    bins = max(1, math.ceil(most / step - 1e-9))
    counts = Counter(min(bins - 1, max(0, int(p / step + 1e-9))) for p in points)
    so_far = ", as far as they are marked" if any(result.open for result in graded) else ""
    mean = round(sum(points) / len(points), 1)
    return (
        f"<h2>Points</h2><p>Median {number(median(points))}, mean {number(mean)} "
        f"of {number(most)} points{so_far}.</p>{_bars(counts, bins, step)}"
    )


def _steps():
    """Widths of a bar in points, ever wider: .1, .2, .5, 1, 2, 5 ..."""
    for power in range(-1, 9):
        yield from (10.0**power, 2 * 10.0**power, 5 * 10.0**power)


def _bars(counts, bins, step, width=720, height=170):
    top, left, each, foot = max(counts.values()), 10, (width - 20) / bins, 135
    edges, parts = [number(i * step) for i in range(bins + 1)], []
    for i in filter(counts.get, range(bins)):
        tall, x = 110 * counts[i] / top, left + i * each
        place = f'x="{x + 2:.1f}" y="{foot - tall:.1f}" width="{each - 4:.1f}" height="{tall:.1f}"'
        parts.append(f"<rect {place}></rect>")
        parts.append(f'<text x="{x + each / 2:.1f}" y="{foot - 5 - tall:.1f}">{counts[i]}</text>')
    for i, edge in enumerate(edges):
        parts.append(f'<text class="soft" x="{left + i * each:.1f}" y="152">{edge}</text>')
    told = "; ".join(f"{edges[i]} to {edges[i + 1]}: {counts[i]}" for i in range(bins) if counts[i])
    key = "points"
    return (
        f'<div class="scroll" {region("chart")}><svg viewBox="0 0 {width} {height}" role="img" '
        f'aria-label="Students by points. {told}.">'
        f'<line x1="{left}" x2="{width - left}" y1="{foot}" y2="{foot}"></line>{"".join(parts)}'
        f'<text class="soft" x="{width / 2}" y="168">{key}</text></svg></div>'
    )


def _again(graded, checks):
    """The known mistakes by how many students made them."""
    if not graded:
        return ""
    who, where = defaultdict(set), defaultdict(set)
    titles = {check.id: check.title for check in checks}
    for i, result in enumerate(graded):
        for mark in result.marks:
            if mark.mistake:
                who[mark.mistake].add(i)
                where[mark.mistake].add(mark.check)
    if not who:
        return "<h2>What to explain again next week</h2><p>No known mistake was recognised.</p>"
    order = sorted(who, key=lambda mistake: (-len(who[mistake]), mistake))
    most, rows = len(who[order[0]]), []
    for mistake in order:
        at = ", ".join(prose(titles[id], TITLE) for id in titles if id in where[mistake])
        at, count = f"({at})" if at else "", len(who[mistake])
        rows.append(
            f'<tr><td class="n">{count}</td><td class="track">{_bar(count / most)}</td>'
            f'<td class="grow">{prose(mistake, LINE)} <span class="soft small">{at}</span></td></tr>'
        )
    heads = f"<th class='n'>Students</th>{BAR}<th>Mistake (and the check that saw it)</th>"
    more = f"<summary>{len(rows) - TOP} more</summary>"
    rest = f"<details>{more}{_table(heads, rows[TOP:])}</details>" if rows[TOP:] else ""
    return f"<h2>What to explain again next week</h2>{_table(heads, rows[:TOP])}{rest}"


def _checks(graded, checks):
    if not graded or not checks:
        return ""
    rows = []
    for check in checks:
        count = Counter(mark.status for result in graded for mark in result.marks if mark.check == check.id)
        passed, failed = count[records.PASSED], count[records.FAILED]
        share = passed / count.total() if count else 0
        tag = ' <span class="tag">hidden</span>' if check.hidden else ""
        other = count.total() - passed - failed
        numbers = (number(check.points), passed, failed, other, f"{100 * share:.0f} %")
        cells = "".join(f'<td class="n">{told}</td>' for told in numbers)
        rows.append(_row(prose(check.title, TITLE) + tag, f'{cells}<td class="track">{_bar(share)}</td>'))
    words = ("Points", "Passed", "Not yet", "Not run", "Share")
    heads = "".join(f'<th class="n">{word}</th>' for word in words)
    return f"<h2>Checks</h2>{_table(f'<th>Check</th>{heads}{BAR}', rows)}"


def _written(graded, checks):
    if not graded or not checks:
        return ""
    rows = []
    for check in checks:
        marks = [mark for result in graded for mark in result.marks if mark.check == check.id]
        points = [mark.points for mark in marks if mark.points is not None]
        mean = f"{sum(points) / len(points):.1f}" if points else "–"
        numbers = (len(points), len(marks) - len(points), f"{mean} of {number(check.points)}")
        cells = "".join(f'<td class="n">{told}</td>' for told in numbers)
        rows.append(_row(prose(check.title, TITLE), cells))
    heads = "".join(f"<th class='n'>{word}</th>" for word in ("Read", "To be read", "Mean points"))
    return f"<h2>Written questions</h2>{_table(f'<th>Question</th>{heads}', rows)}"


def _unfit(named):
    rows = [
        _row(name(label), f'<td class="grow">{prose(result.problem, LINE)}</td>')
        for label, result in named
        if result.problem
    ]
    table = _folded(len(rows), _table("<th>Student</th><th>Reason</th>", rows))
    return f"<h2>Could not be graded</h2>{table}" if rows else ""


def _late(named):
    late = [name(label) for label, result in named if result.late]
    names = _folded(len(late), f"<p>{', '.join(late)}.</p>")
    return f"<h2>Late</h2>{names}" if late else ""


def _students(named, checks, pages, folder):
    if not named:
        return ""
    rows = [_student(label, result, checks, pages, folder) for label, result in named]
    heads = "<th>Student</th><th class='n'>Points</th><th>Checks</th><th>Remarks</th>"
    key = " &nbsp; ".join("{1} {2}".format(*LOOKS[status]) for status in SIGNS)
    table = f'<p class="soft small">{key}, ✎ marked by hand; in the order of the lab.</p>{_table(heads, rows)}'
    return f"<h2>Students</h2>{_folded(len(rows), table)}"


def _student(label, result, checks, pages, folder):
    shown = name(label)
    if label in pages:
        shown = f'<a href="{quote(f"{folder}/{result.lab}/{pages[label]}", errors="replace")}">{shown}</a>'
    status = {mark.check: mark.status for mark in result.marks}
    signs = "".join(LOOKS.get(status.get(check.id), LOOKS[records.NOT_RUN])[1] for check in checks)
    passed = sum(status.get(check.id) == records.PASSED for check in checks)
    points = "–" if result.problem else f"{number(result.points)} of {number(result.max_points)}"
    told = [*["could not be graded"] * bool(result.problem), *["late"] * result.late]
    told += [f"{result.open} to be read"] if result.open else []
    marks = f'<span class="marks" aria-hidden="true">{signs}</span>'
    marks += f'<span class="unseen">{passed} of {len(checks)} passed</span>'
    cells = f"<td>{'' if result.problem else marks}</td><td>{', '.join(told)}</td>"
    return _row(shown, f'<td class="n">{points}</td>{cells}')


def _row(head, cells):
    return f'<tr><th scope="row" class="grow">{head}</th>{cells}</tr>'


def _table(heads, rows):
    return (
        f'<div class="scroll" {region("table")}>'
        f"<table><thead><tr>{heads}</tr></thead><tbody>\n{chr(10).join(rows)}\n</tbody></table></div>"
    )


def _folded(count, inside):
    """The same, folded away where it is of very many students."""
    summary = f"<summary>{counted(count, 'student')}</summary>"
    return f"<details>{summary}{inside}</details>" if count > MANY else inside


def _bar(share):
    return f'<span class="bar" style="width:{100 * share:.1f}%"></span>'
