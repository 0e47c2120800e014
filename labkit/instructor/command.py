"""`labkit grade`: from a class's submissions to marks, feedback and a file for the LMS."""

import contextlib
import importlib
import os
import sys
import threading
from itertools import groupby
from pathlib import Path

from .console import Progress
from .exam import pool as run
from .exam.paper import read as read_paper
from .intake.collect import open_submissions, tidy
from .intake.submission import assemble
from .records import CommandError, HandInError
from .report import tables
from .report.names import labels
from .report.gradebook import Gradebook
from .sandbox.choose import choose

GRADED, SOME_NOT, CANNOT = 0, 1, 2


def main(args):
    """Run the command with parsed arguments; returns the exit status."""
    try:
        return grade(args)
    except CommandError as problem:
        print(f"labkit grade: {problem}", file=sys.stderr)
        return CANNOT
    except KeyboardInterrupt:
        print("\nStopped. The marks so far are kept: the same command goes on from here.", file=sys.stderr)
        return 130


def grade(args):
    """Collect, grade what is not graded yet, and write everything out. Raises CommandError."""
    paper = read_paper(args.lab)
    out = Path(args.out)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CommandError(f"{out} cannot be made: {error.strerror or error}.") from None
    with contextlib.ExitStack() as stack:
        stack.enter_context(_alone(out))
        book = stack.enter_context(contextlib.closing(Gradebook(out / "gradebook.db", args.seed)))
        book.set_paper(paper.lab, paper.digest, paper.checks)
        take_hand_marks(book, out / "grades.csv")
        with open_submissions(args.submissions) as submissions, book:
            jobs, notes = register(book, paper, submissions, args)
        for note in notes:
            print(f"Note: {note}")
        loading = threading.Thread(target=importlib.import_module, args=("labkit.instructor.report.output",))
        if jobs:
            # The processes load while the sandboxes are tried out, and matplotlib while they work.
            here = stack.enter_context(run.Local(args.jobs)) if not args.scheduler else None
            sandbox = choose(args)
            book.set_level([job.id for job in jobs], sandbox.level)
            loading.start()
            work(book, paper, sandbox, jobs, here, args)
            loading.join()
        if args.attempts == "best":
            book.choose_best(paper.lab)
        from .report.output import write_all

        return write_all(book, paper, out, args)


@contextlib.contextmanager
def _alone(out):
    """Only one grader may use a folder at a time; the lock goes with the process, however it ends."""
    with open(out / ".lock", "w") as lock:
        try:
            import fcntl

            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except ImportError:
            pass
        except OSError:
            raise CommandError(f"Another labkit grade is using {out}: wait for it, or choose another --out.") from None
        yield


def take_hand_marks(book, path):
    """Take the points that a person filled in in grades.csv into the gradebook. Raises CommandError for bad ones."""
    snapshots = book.written()
    if not path.exists() or not snapshots:
        return
    found, notes, problem = None, [], None
    for written in snapshots:  # the newer one first; the file may still be the one before it
        told = []
        try:
            marks = tables.read_hand_marks(path, written, told)
        except CommandError as error:
            problem = problem or error
            continue
        if found is None or len(marks) < len(found):
            found, notes = marks, told
    if found is None:
        raise problem
    now = {
        (label, result.lab): result
        for lab in book.labs()
        for results in [list(book.results(lab))]
        for label, result in zip(labels(results), results)
    }
    with book:
        for (label, lab, check), (points, reason) in found.items():
            if (label, lab) in now:
                book.hand(now[label, lab], check, points, reason)
    if found:
        print(f"Took {len(found)} mark{'s' * (len(found) > 1)} from {path.name}.")
    for note in notes:
        print(f"Note: {note}")


def register(book, paper, submissions, args):
    """(jobs, notes): what is to be graded, entered into the gradebook; the rest is there already."""
    entries, unfits, notes = submissions.survey(paper.lab)
    kinds = {cell.id: cell.code for cell in paper.released if cell.role == "answer"}
    jobs, older = [], 0
    # What was to be graded anew when the grader was killed is entered already, and goes on.
    unfinished = book.unfinished(paper.lab)
    regrade = [] if unfinished else args.regrade
    if unfinished:
        notes.append(
            "Going on where the last run was stopped" + ("; --regrade is not begun anew." if args.regrade else ".")
        )
    book.retry(paper.lab)
    for (student, identifier), group in groupby(entries, key=lambda e: (e.student, e.identifier)):
        attempts, chosen = list(group), None
        picked, why = pick(attempts, args)
        for entry, told in picked:
            late = is_late(entry, args.due)
            about = (paper.lab, student, identifier, entry.source)
            try:
                cells, digest = submissions.read(entry)
                cells, odd = tidy(cells, kinds)
            except HandInError as error:
                why = why or (str(error) if entry.name in str(error) else f"{entry.name}: {error}")
                continue
            made = assemble(paper.released, cells)
            told = [*entry.notes, *odd, *made.notes, *told]
            id, done, graded_by = book.find(paper.lab, student, identifier, digest) or (None, False, "")
            if id is None or again(regrade, student, identifier) or not done and graded_by != paper.digest:
                id = book.add(*about, digest, paper.digest, entry.when, late, told, made.answers)
                done = False
            elif done:
                older += graded_by != paper.digest
            if not done:
                key = f"{student}\n{identifier}"
                jobs.append(run.Job(id, key, made.cells, made.sources, frozenset(book.marked(id))))
            book.choose(id, told, late)
            chosen = id
            if args.attempts != "best":
                break
        if chosen is None:
            refuse(book, paper, attempts[-1], why or "It could not be read.")
    if not entries and all(f"no notebook of lab {paper.lab}" in unfit.reason for unfit in unfits):
        raise CommandError(f"No submission holds {paper.lab}, but other labs: is --lab right?")
    for unfit in unfits:
        refuse(book, paper, unfit, unfit.reason)
    if older:
        notes.append(
            f"The checks of this lab have changed since {older} submission{'s were' if older > 1 else ' was'} graded; "
            "--regrade all grades them anew."
        )
    return jobs, notes


def refuse(book, paper, entry, reason):
    """Enter a submission that cannot be graded, once."""
    about = (paper.lab, entry.student, entry.identifier, entry.source)
    known = book.find(paper.lab, entry.student, entry.identifier, reason)
    id = known[0] if known else book.add(*about, reason, paper.digest, entry.when, False, [], {}, reason)
    book.choose(id, [], False)


def pick(attempts, args):
    """([(entry, notes)] to be tried in turn until one can be graded, why none if none)."""
    counting = attempts
    if args.late == "ignore":
        counting = [entry for entry in attempts if not is_late(entry, args.due)]
        if not counting:
            return [], "It was handed in late, and late hand-ins do not count."
    order = counting if args.attempts == "first" else counting[::-1]
    told = []
    if len(attempts) > 1:
        rule = {"newest": "the newest counts", "first": "the first counts", "best": "the best counts"}[args.attempts]
        told = [f"{len(attempts)} attempts: {rule}."]
    return [(entry, told + ["Handed in late."] * is_late(entry, args.due)) for entry in order], ""


def is_late(entry, due):
    return bool(entry.late or due and entry.when and entry.when > due)


def again(regrade, student, identifier):
    """Whether the instructor asked for this student to be graded anew."""
    return any(name in ("all", student, identifier, f"{student} ({identifier})") for name in regrade or ())


def work(book, paper, sandbox, jobs, here, args):
    """Grade the jobs; each mark goes into the gradebook as it comes."""
    room = run.Room(paper, book.seed, run.way(sandbox), {"call": args.call, "total": args.total})
    if args.scheduler:
        from .exam.cluster import remote

        news = remote(room, jobs, args.scheduler)
    else:
        news = here.grade(room, jobs)
    progress = Progress(len(jobs))
    for kind, id, item in news:
        if kind == "mark":
            book.mark(
                id,
                item["check"],
                item["points"],
                item["status"],
                item.get("reason", ""),
                item.get("lines", ()),
                item.get("mistake", ""),
            )
            continue
        if kind == "lost":
            for mark in run.lost(paper, item):
                book.mark(id, *mark)
            item = None
        book.finish(id, item)
        progress.tell(book.result(id))
    progress.end()


def cores():
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
