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
from .names import page_names
from .send_back import send_back
from .sheet import Sheet
from .tables import write_grades, write_summary, written_for_excel
from .texts import clean, counted, plain
from .to_mark import to_mark_page
from .told import remember


def write_all(book: Gradebook, paper: Paper, out: Path, args: Namespace) -> int:
    """Write all files into the folder `out`, print a summary, and return the exit status.

    The status is 0 if every submission could be graded, else 1. Raises CommandError if a file cannot be written.
    """
    results = [result for lab in book.labs() for result in book.results(lab)]
    book.wrote(results)
    excel = args.csv == "excel" or not args.csv and written_for_excel(out / "grades.csv")
    write_grades(out / "grades.csv", results, excel)
    book.settled()
    write_summary(out / "summary.csv", results, excel)
    mine = [result for result in results if result.lab == paper.lab]
    pages = _feedback(book, paper, out, mine, vars(args).get("show_answers"))
    rows = rows_of(Sheet(args.moodle)) if args.moodle else {}
    send_back(out / f"feedback-{paper.lab}.zip", out / "feedback" / paper.lab, mine, pages, rows)
    files.write(out / f"class-{paper.lab}.html", class_page(mine, paper.checks, paper.title, pages))
    files.write(out / f"to-mark-{paper.lab}.html", to_mark_page(mine, paper.checks, paper.title))
    titles = {check.id: check.title for check in paper.checks}
    mine = [
        replace(result, marks=[replace(mark, check=titles.get(mark.check, mark.check)) for mark in result.marks])
        for result in mine
    ]  # what students read has titles
    told = []
    if args.moodle:
        columns = args.grade_column, args.feedback_column
        told += fill_moodle(args.moodle, out / "moodle.csv", mine, *columns, args.partial)
    if args.canvas:
        told += fill_canvas(args.canvas, out / "canvas.csv", mine, paper.title, args.column, args.partial)
    status = _summary(mine, out, paper, told)
    remember(book, paper.lab, args, [result for result in results if result.lab == paper.lab])
    return status


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


def _summary(results: Sequence[Result], out: Path, paper: Paper, told: Sequence[str]) -> int:
    """Print what came of it; 0 if every submission could be graded, else 1."""
    graded = [result for result in results if not result.problem]
    unfit = [result for result in results if result.problem]
    broken = sorted(((m.reason, r, m) for r in graded for m in r.marks if m.status == ERROR), key=lambda of: of[0])
    print()
    print(f"{len(graded)} of {len(results)} submissions graded, {paper.lab}.", end=" ")
    whole = [result for result in graded if not result.ungraded]
    if whole:
        mean = sum(result.points for result in whole) / len(whole)
        so_far = " so far" if any(result.open for result in whole) else ""
        print(f"Mean {mean:.1f} of {plain(max(result.max_points for result in whole))} points{so_far};", end=" ")
    if graded:
        waiting, blank = sum(result.open for result in graded), sum(result.blank for result in graded)
        print(f"{counted(waiting, 'written answer')} to be read (points go into {out / 'grades.csv'})", end="")
        print(f", {counted(blank, 'question')} without an answer, at 0 points." if blank else ".")
    for result in unfit:
        print(f"Could not be graded: {clean(result.student)}: {clean(result.problem)}")
    for reason, alike in groupby(broken, key=lambda of: of[0]):
        (_, first, mark), *others = alike
        who = f"the first of {clean(first.student)}, {mark.check}"
        print(f"{counted(len(others) + 1, 'check')} could not be run, {who}: {clean(reason)}")
    for sentence in told:
        print(clean(sentence))
    overview, to_mark = out / f"class-{paper.lab}.html", out / f"to-mark-{paper.lab}.html"
    print(f"See {overview} for the class, {to_mark} for the written answers.")
    return 1 if unfit or broken else 0
