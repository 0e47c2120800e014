"""`labkit grade`: from a class's submissions to marks, feedback and a file for the LMS."""

import contextlib
import importlib
import os
import sys
import threading
from argparse import Namespace
from base64 import b64encode
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path

from .console import Progress
from .exam import pool
from .exam.jobs import Job, Room, way
from .exam.paper import Paper, read as read_paper
from .intake.attempts import Rules, hand_ins
from .intake.collect import Submissions, Unfit
from .records import CommandError
from .report import hand_marks
from .report.canvas import names_of
from .report.gradebook import Gradebook
from .report.moodle_times import dated
from .report.names import labels
from .sandbox.choose import choose
from .sandbox.launch import Sandbox

GRADED, SOME_NOT, CANNOT = 0, 1, 2


def main(args: Namespace) -> int:
    """Run the command with parsed arguments; returns the exit status."""
    try:
        return grade(args)
    except CommandError as problem:
        print(f"labkit grade: {problem}", file=sys.stderr)
        return CANNOT
    except KeyboardInterrupt:
        print("\nStopped. The marks so far are kept: the same command goes on from here.", file=sys.stderr)
        return 130


def grade(args: Namespace) -> int:
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
        with Submissions(args.submissions) as submissions, book:
            jobs, notes = register(book, paper, submissions, args)
        for note in notes:
            print(f"Note: {note}")
        loading = threading.Thread(target=importlib.import_module, args=("labkit.instructor.report.output",))
        if jobs:
            # The processes load while the sandboxes are tried out, and matplotlib while they work.
            here = stack.enter_context(pool.Local(args.jobs)) if not args.scheduler else None
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


def take_hand_marks(book: Gradebook, path: Path) -> None:
    """Take the points that a person filled in in grades.csv into the gradebook. Raises CommandError for bad ones."""
    snapshots = book.written()
    if not path.exists() or not snapshots:
        return
    found, notes = _hand_marks(path, snapshots)
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


def _hand_marks(path, snapshots):
    """(marks, notes) that differ least from what was written, or from what was written before."""
    readings, problems = [], []
    for written in snapshots:  # the newer one first; the file may still be the one before it
        notes = []
        try:
            readings.append((hand_marks.read_hand_marks(path, written, notes), notes))
        except CommandError as error:
            problems.append(error)
    if not readings:
        raise problems[0]
    return min(readings, key=lambda reading: len(reading[0]))


def register(book: Gradebook, paper: Paper, submissions: Submissions, args: Namespace) -> tuple[list[Job], list[str]]:
    """(jobs, notes): what is to be graded, entered into the gradebook; the rest is there already."""
    entries, unfits, notes = submissions.survey(paper.lab)
    if not entries and all(f"no notebook of lab {paper.lab}" in unfit.reason for unfit in unfits):
        raise CommandError(f"No submission holds {paper.lab}, but other labs: is --lab right?")
    _know(args.regrade or (), entries)
    # What was to be graded anew when the grader was killed is entered already, and goes on.
    unfinished = book.unfinished(paper.lab)
    if unfinished:
        notes.append(
            "Going on where the last run was stopped" + ("; --regrade is not begun anew." if args.regrade else ".")
        )
    book.retry(paper.lab)
    entries, unfits = _called(book, entries, unfits, args.canvas)
    entries, told = dated(entries, args.moodle, Path(args.submissions).name, args.due)
    notes += told
    rules = Rules(args.attempts, args.due, args.late == "count")
    jobs, older = [], 0
    for found in hand_ins(submissions, entries, paper.released, rules):
        if isinstance(found, Unfit):
            _refuse(book, paper, found)
            continue
        anew = not unfinished and _asked_for(args.regrade, found.entry)
        job, outdated = _enter(book, paper, found, anew)
        jobs += [job] if job else []
        older += outdated
    for unfit in unfits:
        _refuse(book, paper, unfit)
    if older:
        notes.append(
            f"The checks of this lab have changed since {older} submission{'s were' if older > 1 else ' was'} graded; "
            "--regrade all grades them anew."
        )
    return jobs, notes


def _called(book, entries, unfits, gradebook):
    """(entries, unfits) under the names that Canvas's gradebook has, now or in a run before."""
    found = [*entries, *unfits]
    told = names_of(gradebook, {of.identifier for of in found}) if gradebook else {}
    names = book.called({(of.student, of.identifier): told[of.identifier] for of in found if of.identifier in told})
    renamed = [replace(of, student=names.get((of.student, of.identifier), of.student)) for of in found]
    return renamed[: len(entries)], renamed[len(entries) :]


def _enter(book, paper, found, anew):
    """Let a hand-in count for its student; (Job or None if it is graded, whether that was by older checks)."""
    entry, work = found.entry, found.work
    about = (paper.lab, entry.student, entry.identifier)
    id, done, graded_by = book.find(*about, found.digest) or (None, False, "")
    if id is None or anew or not done and graded_by != paper.digest:
        source = entry.source
        id = book.add(*about, source, found.digest, paper.digest, entry.when, found.late, found.notes, work.answers)
        done = False
    book.choose(id, found.notes, found.late, entry.when)
    if done:
        return None, graded_by != paper.digest
    key = f"{entry.student}\n{entry.identifier}"
    files = {path: b64encode(content).decode("ascii") for path, content in work.files.items()}
    return Job(id, key, work.cells, work.sources, frozenset(book.marked(id)), files), False


def _refuse(book, paper, unfit):
    """Enter a submission that cannot be graded, once."""
    about = (paper.lab, unfit.student, unfit.identifier)
    known = book.find(*about, unfit.reason)
    id = known[0] if known else None
    if id is None:
        id = book.add(*about, unfit.source, unfit.reason, paper.digest, unfit.when, False, [], {}, unfit.reason)
    book.choose(id, [], False)


def _know(names, entries):
    """Raise CommandError for a name that stands for no student."""
    for name in names:
        if not any(_asked_for([name], entry) for entry in entries):
            near = get_close_matches(name, sorted({entry.student for entry in entries}), 3, 0.5)
            meant = f" Did you mean {' or '.join(map(repr, near))}?" if near else ""
            raise CommandError(f"--regrade: no student {name!r} has handed in this lab.{meant}")


def _asked_for(regrade, entry):
    """Whether the instructor asked for this student to be graded anew."""
    names = ("all", entry.student, entry.identifier, f"{entry.student} ({entry.identifier})")
    return any(name in names for name in regrade or ())


def work(
    book: Gradebook, paper: Paper, sandbox: Sandbox, jobs: list[Job], here: pool.Local | None, args: Namespace
) -> None:
    """Grade the jobs, here or on a cluster; each mark goes into the gradebook as it comes."""
    room = Room(paper, book.seed, way(sandbox), {"call": args.call, "total": args.total})
    if here:
        news = here.grade(room, jobs)
    else:
        from .exam.cluster import remote

        news = remote(room, jobs, args.scheduler)
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
            for mark in pool.lost(paper, item):
                book.mark(id, *mark)
            item = None
        book.finish(id, item)
        progress.tell(book.result(id))
    progress.end()


def cores() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
