"""Everything that a grading run leaves for people: tables, pages, and the LMS's own file filled in."""

from argparse import Namespace
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path

from .. import files
from ..exam.paper import Paper
from ..records import ERROR, Result
from .canvas import fill_canvas
from .class_overview import class_page
from .feedback import all_read, feedback_page
from .figures import Drawer
from .gradebook import Gradebook
from .moodle import fill_moodle, rows_of
from .names import labels, page_names
from .send_back import send_back
from .sheet import Sheet
from .tables import write_grades, write_summary, written_for_excel
from .texts import clean, counted, listed, plain
from .to_mark import to_mark_page
from .told import remember
from .ways import TERM


def write_all(
    book: Gradebook,
    paper: Paper,
    out: Path,
    args: Namespace,
    results: Sequence[Result] | None = None,
    apart: bool = False,
) -> int:
    """Write all files into the folder `out`, print a summary, and return the exit status.

    results: of all labs after the course's rules; None: there are none. grades.csv has the marks before them, of the
    hand-ins that count for anybody. apart: whether students have numbers of their own in this lab. The status is 0 if
    every submission could be graded, else 1. Raises CommandError if a file cannot be written.
    """
    every = [result for lab in book.labs() for result in book.results(lab)]
    results = every if results is None else results
    counting = {result.id for result in results}
    book.pass_over(result.id for result in every if result.id not in counting)
    raw = [result for result in every if result.id in counting]
    book.wrote(raw)
    excel = args.csv == "excel" or not args.csv and written_for_excel(out / "grades.csv")
    write_grades(out / "grades.csv", raw, excel)
    book.settled()
    write_summary(out / "summary.csv", results, excel)
    mine = [result for result in results if result.lab == paper.lab]
    pages = _feedback(book, paper, out, mine, vars(args).get("show_answers"))
    rows = rows_of(Sheet(args.moodle)) if args.moodle else {}
    send_back(out / f"feedback-{paper.lab}.zip", out / "feedback" / paper.lab, mine, pages, rows)
    files.write(out / f"class-{paper.lab}.html", class_page(mine, paper.checks, paper.title, pages))
    to_read = [result for result in raw if result.lab == paper.lab]
    files.write(out / f"to-mark-{paper.lab}.html", to_mark_page(to_read, paper.checks, paper.title, apart))
    titles = {check.id: check.title for check in paper.checks}
    mine = [
        replace(result, marks=[replace(mark, check=titles.get(mark.check, mark.check)) for mark in result.marks])
        for result in mine
    ]  # what students read has titles
    status = _summary(mine, out, paper, _to_lms(mine, paper, out, args))
    remember(book, paper.lab, args, [result for result in every if result.lab == paper.lab])
    return status


def _to_lms(results: Sequence[Result], paper: Paper, out: Path, args: Namespace) -> list[str]:
    """Fill in the LMS's own files; what there is to tell of it."""
    told = []
    if args.moodle:
        columns = args.grade_column, args.feedback_column
        told += fill_moodle(args.moodle, out / "moodle.csv", results, *columns, args.partial)
    if args.canvas:
        told += fill_canvas(args.canvas, out / "canvas.csv", results, paper.title, args.column, args.partial)
    return told


def _feedback(
    book: Gradebook, paper: Paper, out: Path, results: Sequence[Result], answers: bool | None
) -> dict[str, str]:
    """Write a page for each student, with model answers if that is asked for; returns {label: file name} of them."""
    solved = all_read(results, paper.checks) if answers else frozenset()
    folder = out / "feedback" / paper.lab
    folder.mkdir(parents=True, exist_ok=True)
    drawer, pages = Drawer(), page_names(results)
    for name, result in zip(pages.values(), results):
        seen = replace(result, figure=book.figure(result.id))  # a copy, since a class's figures are heavy
        files.write(folder / name, feedback_page(seen, paper.checks, paper.title, drawer, solved))
    return pages


def _rules(results: Sequence[Result]) -> list[str]:
    """What the course's rules did, for the console."""
    named = list(zip(labels(results), results))
    late = [label + _cost(result) for label, result in named if result.late]
    by = [f"{label} (by {result.ruling.by})" for label, result in named if result.ruling.by]
    best = [f"{label} ({plain(result.points, 2)} points)" for label, result in named if result.ruling.best]
    told = [
        ("Late", late),
        ("Handed in by another member of their group", by),
        ("The best hand-in counts, another has less", best),
    ]
    return [f"{what}: {len(who)}: {listed(who)}." for what, who in told if who]


def _cost(result: Result) -> str:
    """' (2 days, 3.2 points less)'."""
    ruling = result.ruling
    said = [counted(ruling.days, "day")] * bool(ruling.days)
    said += [f"{counted(ruling.less, 'point')} less"] * bool(ruling.less)
    return f" ({', '.join(said)})" if said else ""


def _summary(results: Sequence[Result], out: Path, paper: Paper, told: Sequence[str]) -> int:
    """Print what came of it; 0 if every submission could be graded, else 1."""
    graded = [result for result in results if not result.problem]
    unfit = [result for result in results if result.problem]
    broken = sorted(((m.reason, r, m) for r in graded for m in r.marks if m.status == ERROR), key=lambda of: of[0])
    print()
    once = {result.id: result for result in graded}.values()  # what counts for several students is one submission
    print(f"{len(once)} of {len({result.id for result in results})} submissions graded, {paper.lab}.", end=" ")
    whole = [result for result in graded if not result.ungraded]
    if whole:
        mean, most = (sum(of) / len(whole) for of in zip(*((r.points, r.max_marked) for r in whole)))
        so_far = " marked so far" if any(result.open for result in whole) else ""
        print(f"Mean {mean:.1f} of {plain(most, 1)} points{so_far};", end=" ")
    if graded:
        waiting, blank = sum(result.open for result in once), sum(result.blank for result in once)
        print(f"{counted(waiting, 'written answer')} to be read (points go into {out / 'grades.csv'})", end="")
        print(f", {counted(blank, 'question')} without an answer, at 0 points." if blank else ".")
    for result in unfit:
        print(f"Could not be graded: {clean(result.student)}: {clean(result.problem)}")
    for reason, alike in groupby(broken, key=lambda of: of[0]):
        (_, first, mark), *others = alike
        who = f"the first of {clean(first.student)}, {mark.check}"
        print(f"{counted(len(others) + 1, 'check')} could not be run, {who}: {clean(reason)}")
    for sentence in (*_rules(results), *told):
        print(clean(sentence))
    overview, to_mark = out / f"class-{paper.lab}.html", out / f"to-mark-{paper.lab}.html"
    print(f"See {overview} for the class, {to_mark} for the written answers, {out / TERM} for all labs.")
    return 1 if unfit or broken else 0
