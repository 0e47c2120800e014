"""`labkit grade`: from a class's submissions to marks, feedback and a file for the LMS."""

import contextlib
import importlib
import os
import sqlite3
import sys
import threading
from argparse import Namespace
from collections.abc import Callable, Iterator
from pathlib import Path

from . import policy
from .console import Progress, stoppable
from .exam import pool
from .exam.jobs import Job, Room, way
from .exam.paper import Paper, read as read_paper
from .folders import temporary
from .intake.collect import Submissions
from .records import CommandError
from .register import register
from .report.gradebook import Gradebook
from .report.schema import trouble
from .report.taken import take_hand_marks
from .report.texts import clean, readable
from .sandbox.choose import choose
from .sandbox.launch import Sandbox
from .trouble import sentence, why

GRADED, SOME_NOT, CANNOT = 0, 1, 2
OUTPUT = "labkit.instructor.report.output"  # it loads matplotlib
KEPT = "The marks so far are kept: the same command goes on from here."


def main(args: Namespace) -> int:
    """Run `labkit grade` with parsed arguments; returns the exit status."""
    return run("grade", grade, args)


@stoppable()
def run(name: str, work: Callable[[Namespace], int], args: Namespace) -> int:
    """The exit status of a command that works on the folder args.out; whatever stops it is told in a sentence."""
    try:
        return work(args)
    except CommandError as problem:
        print(f"labkit {name}: {readable(str(problem))}", file=sys.stderr)
        return CANNOT
    except (OSError, sqlite3.Error) as error:  # of the disk, of what it prints to; the ExitStack has ended the rest
        said = sentence(error) if isinstance(error, OSError) else f"{args.out}: the gradebook: {trouble(error)}."
        print(f"labkit {name}: {readable(said)} {KEPT}", file=sys.stderr)
        return CANNOT
    except KeyboardInterrupt:
        print(f"\nStopped. {KEPT}", file=sys.stderr)
        return 130


def grade(args: Namespace) -> int:
    """Collect, grade what is not graded yet, and write everything out. Raises CommandError."""
    paper = read_paper(args.lab)
    out = Path(args.out)
    if out.resolve() == Path(args.submissions).resolve():
        told = "what is written there would be taken for students' work the next time; name another folder"
        raise CommandError(f"--out {out} is the folder of the submissions: {told}.")
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CommandError(f"{out} cannot be made: {why(error)}.") from None
    with contextlib.ExitStack() as stack:
        stack.enter_context(alone(out))
        course = policy.read(out / policy.NAME)
        book = stack.enter_context(contextlib.closing(Gradebook(out / "gradebook.db", args.seed)))
        book.set_paper(paper.lab, paper.digest, paper.checks)
        take_hand_marks(book, out / "grades.csv")
        fill(book, paper, args, course, threading.Thread(target=importlib.import_module, args=(OUTPUT,)))
        return write_out(book, paper, out, args, course)


def fill(
    book: Gradebook,
    paper: Paper,
    args: Namespace,
    course: policy.Course | None = None,
    meanwhile: threading.Thread | None = None,
) -> None:
    """Grade what was handed in and is not graded yet, into the gradebook. Raises CommandError.

    course: its file's rules;  meanwhile: what may run while the processes work.
    """
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(temporary("class"))
        os.chmod(folder, 0o700)
        with Submissions(args.submissions, book.path.parent) as submissions, book:
            jobs, notes = register(book, paper, submissions, args, folder, course)
        for note in notes:
            print(f"Note: {clean(note)}")
        if not jobs:
            return
        # The processes load while the sandboxes are tried out, and matplotlib while they work.
        here = stack.enter_context(pool.Local(args.jobs)) if not args.scheduler else None
        sandbox = choose(args)
        book.set_level([job.id for job in jobs], sandbox.level)
        if meanwhile:
            meanwhile.start()
        work(book, paper, sandbox, jobs, here, args)
        if meanwhile:
            meanwhile.join()


def write_out(book: Gradebook, paper: Paper, out: Path, args: Namespace, course: policy.Course | None = None) -> int:
    """Write all tables and pages, those of the term too, after the course's rules; the exit status of `write_all`.

    course: what its file says, read anew if it is not given. Raises CommandError.
    """
    from .policy import variants
    from .report.output import write_all
    from .term.command import write_term

    rules = policy.course_of(book, paper.lab, course)
    if rules.lab(paper.lab).attempts == "best":
        policy.choose_best(book, paper.lab, course)
    results = [result for lab in book.labs() for result in policy.ruled(book, lab, course)]
    status = write_all(book, paper, out, args, results, variants.own(paper, rules))
    write_term(book, out)
    return status


@contextlib.contextmanager
def alone(out: Path) -> Iterator[None]:
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
                item.get("parts", ()),
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
