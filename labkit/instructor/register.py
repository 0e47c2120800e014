"""What a class handed in, entered into the gradebook; what is not graded yet becomes jobs."""

from argparse import Namespace
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path

from .exam.jobs import Job, keep
from .exam.paper import Paper
from .intake.attempts import hand_ins
from .intake.collect import Submissions, Unfit
from .policy import Course, intake, variants
from .records import CommandError
from .report import code
from .report.canvas import names_of
from .report.gradebook import Gradebook
from .report.moodle_times import dated


def register(
    book: Gradebook, paper: Paper, submissions: Submissions, args: Namespace, folder: str, course: Course | None = None
) -> tuple[list[Job], list[str]]:
    """(jobs, notes): what is to be graded, entered into the gradebook; the rest is there already.

    folder: where the jobs' work is kept;  course: its file's rules. Raises CommandError before anything is entered.
    """
    entries, unfits, notes = submissions.survey(paper.lab)
    if not entries and all(f"no notebook of lab {paper.lab}" in unfit.reason for unfit in unfits):
        raise CommandError(f"No submission holds {paper.lab}, but other labs: is --lab right?")
    _know(args.regrade or (), entries)
    # What was to be graded anew when the grader was killed is entered already, and goes on.
    unfinished = book.unfinished(paper.lab)
    if unfinished:
        end = "; --regrade is not begun anew." if args.regrade else "."
        notes.append(f"Going on where the last run was stopped{end}")
    book.retry(paper.lab)
    entries, unfits = _called(book, entries, unfits, args.canvas)
    rules, due, told = intake.rules(book, paper.lab, course or Course(), args, [*entries, *unfits])
    own = variants.of_class(paper, course or Course(), book.path.parent, entries)
    entries, of_times = dated(entries, args.moodle, Path(args.submissions).name, due)
    notes += [*told, *of_times]
    jobs, older = [], 0
    for found in hand_ins(submissions, entries, paper.released, rules):
        if isinstance(found, Unfit):
            _refuse(book, paper, found)
            continue
        anew = not unfinished and _asked_for(args.regrade, found.entry)
        variants.give(found.work, own.get((found.entry.student, found.entry.identifier)))
        job, outdated = _enter(book, paper, found, anew, folder)
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


def _enter(book, paper, found, anew, folder):
    """Let a hand-in count for its student; (Job or None if it is graded, whether that was by older checks)."""
    entry, work = found.entry, found.work
    about = (paper.lab, entry.student, entry.identifier)
    id, done, graded_by = book.find(*about, found.digest) or (None, False, "")
    if id is None or anew or not done and graded_by != paper.digest:
        source = entry.source
        id = book.add(*about, source, found.digest, paper.digest, entry.when, entry.late, found.notes, work.answers)
        done = False
    book.choose(id, found.notes, entry.late, entry.when)
    code.keep(book, id, work)
    if done:
        return None, graded_by != paper.digest
    key = f"{entry.student}\n{entry.identifier}"
    return Job(id, key, keep(Path(folder, f"{id}.json"), work), frozenset(book.marked(id))), False


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
