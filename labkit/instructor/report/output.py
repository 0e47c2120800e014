"""Everything that a grading run leaves for people: tables, pages, and the LMS's own file filled in."""

import re
import zipfile
from dataclasses import replace
from itertools import groupby

from .. import files
from . import lms, tables
from .class_overview import class_page
from .feedback import feedback_page
from .figures import Drawer
from .names import file_name, labels
from .texts import clean, plain
from .to_mark import to_mark_page


def write_all(book, paper, out, args):
    """Write all files into the folder `out`, print a summary, and return the exit status."""
    results = [result for lab in book.labs() for result in book.results(lab)]
    book.wrote(results)
    tables.write_grades(out / "grades.csv", results)
    tables.write_summary(out / "summary.csv", results)
    mine = [result for result in results if result.lab == paper.lab]
    pages = feedback(book, paper, out, mine)
    title = paper.title
    files.write(out / f"class-{paper.lab}.html", class_page(mine, paper.checks, title, pages))
    files.write(out / f"to-mark-{paper.lab}.html", to_mark_page(mine, paper.checks, title))
    told = []
    titles = {check.id: check.title for check in paper.checks}
    mine = [
        replace(result, marks=[replace(mark, check=titles.get(mark.check, mark.check)) for mark in result.marks])
        for result in mine
    ]  # what students read has titles
    if args.moodle:
        told += lms.fill_moodle(
            args.moodle, out / "moodle.csv", mine, args.grade_column, args.feedback_column, args.partial
        )
    if args.canvas:
        told += lms.fill_canvas(args.canvas, out / "canvas.csv", mine, title, args.column, args.partial)
    return summary(mine, out, paper, told)


def feedback(book, paper, out, results):
    """Write a page for each student; returns {label: file name} of them."""
    folder = out / "feedback" / paper.lab
    folder.mkdir(parents=True, exist_ok=True)
    drawer, pages, taken = Drawer(), {}, set()
    for label, result in zip(labels(results), results):
        result.figure = book.figure(result.id)
        name = file_name(label, taken)
        files.write(folder / name, feedback_page(result, paper.checks, paper.title, drawer))
        result.figure, pages[label] = {}, name
    send_back(out / f"feedback-{paper.lab}.zip", folder, results, pages)
    return pages


def send_back(path, folder, results, pages):
    """Pack the pages as Moodle takes them ("Upload multiple feedback files in a zip"): in the folders that it gave out."""
    found = {}
    for label, result in zip(labels(results), results):
        of = re.search(r"(?:^|[/ ])([^/:]+_\d+_assignsubmission_file_?)/", result.source)
        if of:
            found[f"{of[1]}/{pages[label]}"] = folder / pages[label]
    if not found:
        path.unlink(missing_ok=True)
        return

    def pack(file):
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, page in found.items():
                archive.write(page, name)

    files.write(path, pack)


def summary(results, out, paper, told):
    """Print what came of it; 0 if every submission could be graded, else 1."""
    graded = [result for result in results if not result.problem]
    unfit = [result for result in results if result.problem]
    broken = [(r, m) for r in graded for m in r.marks if m.status == "error"]
    most = max((result.max_points for result in graded), default=0)
    print()
    print(f"{len(graded)} of {len(results)} submissions graded, {paper.lab}.", end=" ")
    if graded:
        mean = sum(result.points for result in graded) / len(graded)
        print(f"Mean {mean:.1f} of {plain(most)} points so far;", end=" ")
        print(
            f"{sum(result.open for result in graded)} written answers to be read (points go into {out / 'grades.csv'})."
        )
    for result in unfit:
        print(f"Could not be graded: {clean(result.student)}: {result.problem}")
    for reason, group in groupby(sorted(broken, key=lambda pair: pair[1].reason), key=lambda pair: pair[1].reason):
        group = list(group)
        print(
            f"{len(group)} checks could not be run, the first of {clean(group[0][0].student)}, {group[0][1].check}: {reason}"
        )
    for sentence in told:
        print(sentence)
    print(
        f"See {out / f'class-{paper.lab}.html'} for the class, {out / f'to-mark-{paper.lab}.html'} for the written answers."
    )
    return 1 if unfit or broken else 0
