"""The page about the whole class: what went wrong for how many, and what to explain again next week."""

from collections import Counter, defaultdict
from urllib.parse import quote

from . import records
from .page import counted, number, page, text
from .tables import labels

MANY = 200  # students, above which their table is folded away


def class_page(results, checks, title, pages, folder="feedback"):
    """The HTML of the class's page.

    results: of one lab;  pages: {label: file name of the feedback page} in `folder`.
    """
    graded = [result for result in results if not result.problem]
    unfit = [result for result in results if result.problem]
    parts = [f"<h1>{text(title, 200)}: the class</h1>", _overview(graded, unfit)]
    if graded:
        parts += [_spread(graded), _again(graded, checks), _checks(graded, checks)]
    if unfit:
        parts += ["<h2>Could not be graded</h2>", "<table><tr><th>Student</th><th>Reason</th></tr>"]
        parts += [f"<tr><td>{text(r.student, 200)}</td><td>{text(r.problem, 500)}</td></tr>" for r in unfit]
        parts.append("</table>")
    if results:
        parts.append(_students(results, pages, folder))
    return page(f"{title}: the class", *parts)


def _overview(graded, unfit):
    if not graded and not unfit:
        return "<p>Nobody has handed in anything yet.</p>"
    late = sum(result.late for result in graded)
    waiting = sum(result.open for result in graded)
    levels = sorted({result.level for result in graded})
    lines = [f"<b>{counted(len(graded), 'student')}</b> graded"]
    lines += [f"{len(unfit)} could not be graded"] if unfit else []
    lines += [f"{late} late"] if late else []
    lines += [f"{counted(waiting, 'written answer')} to be read"] if waiting else []
    lines += [f"sandbox level {', '.join(map(str, levels))}"] if levels else []
    return f"<p>{'; '.join(lines)}.</p>"


def _spread(graded):
    """How many students have how many of the points, in tenths."""
    tenths = Counter(min(9, int(10 * r.points / r.max_points)) if r.max_points else 0 for r in graded)
    most = max(tenths.values())
    rows = [
        f'<tr><td class="n">{10 * i}–{10 * i + 10} %</td><td style="width:75%"><div class="track">{_bar(tenths[i] / most)}</div></td>'
        f'<td class="n">{tenths[i] or ""}</td></tr>'
        for i in range(9, -1, -1)
    ]
    mean = sum(r.points for r in graded) / len(graded)
    return (
        f"<h2>Points</h2><p>Mean {mean:.1f} of {number(max(r.max_points for r in graded))}, as far as marked.</p>"
        "<table><tr><th>Share of the points</th><th></th><th class='n'>Students</th></tr>" + "".join(rows) + "</table>"
    )


def _again(graded, checks):
    """The known mistakes by how many students made them."""
    titles, where, who = {check.id: check.title for check in checks}, {}, defaultdict(set)
    for result in graded:
        for mark in result.marks:
            if mark.mistake:
                who[mark.mistake].add((result.student, result.identifier))
                where.setdefault(mark.mistake, titles.get(mark.check, mark.check))
    if not who:
        return "<h2>What to explain again</h2><p>No known mistake was recognised.</p>"
    order = sorted(who, key=lambda mistake: -len(who[mistake]))[:20]
    most = len(who[order[0]])
    rows = [
        f'<tr><td class="n">{len(who[m])}</td><td style="width:25%"><div class="track">{_bar(len(who[m]) / most)}</div></td>'
        f'<td>{text(m, 400)} <span class="soft">({text(where[m], 100)})</span></td></tr>'
        for m in order
    ]
    return (
        "<h2>What to explain again next week</h2><p>The mistakes that were recognised, and how many students made each.</p>"
        "<table><tr><th class='n'>Students</th><th></th><th>Mistake</th></tr>" + "".join(rows) + "</table>"
    )


def _checks(graded, checks):
    rows = []
    for check in (check for check in checks if not check.hand):
        marks = [mark for result in graded for mark in result.marks if mark.check == check.id]
        passed = sum(mark.status == records.PASSED for mark in marks)
        failed = sum(mark.status == records.FAILED for mark in marks)
        other = len(marks) - passed - failed
        share = passed / len(marks) if marks else 0
        rows.append((share, (
            f'<tr><td>{text(check.title, 200)}{" <span class=tag>hidden</span>" if check.hidden else ""}</td><td class="n">{passed}</td>'
            f'<td class="n">{failed}</td><td class="n">{other or ""}</td><td style="width:25%"><div class="track">{_bar(share)}</div></td>'
            f'<td class="n">{100 * share:.0f} %</td></tr>'
        )))  # fmt: skip
    return (
        "<h2>Checks</h2><div class='wide'><table><tr><th>Check</th><th class='n'>passed</th><th class='n'>failed</th>"
        "<th class='n'>not run</th><th></th><th class='n'>passed</th></tr>" + "".join(row for _, row in rows) + "</table></div>"
    )


def _students(results, pages, folder):
    rows = []
    for label, result in zip(labels(results), results):
        name = text(label, 200)
        if label in pages:
            name = f'<a href="{quote(f"{folder}/{result.lab}/{pages[label]}")}">{name}</a>'
        points = "–" if result.problem else number(result.points)
        told = "; ".join([*["late"] * result.late, *[f"{result.open} to be read"] * bool(result.open)])
        rows.append(f'<tr><td>{name}</td><td class="n">{points}</td><td>{text(told)}</td></tr>')
    table = "<table><tr><th>Student</th><th class='n'>Points</th><th></th></tr>" + "".join(rows) + "</table>"
    if len(results) > MANY:
        return f"<h2>Students</h2><details><summary>All {len(results)} students</summary>{table}</details>"
    return f"<h2>Students</h2>{table}"


def _bar(share):
    return f'<span class="bar" style="width:{100 * share:.1f}%"></span>'
