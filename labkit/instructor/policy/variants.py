"""Numbers of students' own: who gets which when the course is handed out, and the same when it is graded."""

import re
import sys
from collections.abc import Sequence
from pathlib import Path

from ...notebook import variant
from ..exam.paper import Paper
from ..intake.collect import Entry
from ..intake.submission import Work
from ..records import CommandError
from ..report.texts import counted
from . import roster
from .course import Course


def uses(paper: Paper) -> bool:
    """Whether a lab asks for numbers of students' own."""
    sources = [
        paper.setup,
        *(cell.source for cell in paper.cells),
        *(cell.source for cell in paper.released if cell.code),
    ]
    return any(re.search(r"\bvariant\b", source) for source in sources)  # other `variants` ask for none


def own(paper: Paper, course: Course) -> bool:
    """Whether students have numbers of their own in a lab: the same words may be right for one, wrong for another."""
    return bool(course.variants) and uses(paper)


def of_class(paper: Paper, course: Course, out: Path, entries: Sequence[Entry]) -> dict[tuple[str, str], str]:
    """{(name, number): the text of the student's variant.toml} of a lab that uses variants, {} for others.

    out: where course.toml is, and the roster if it is named without a folder. Raises CommandError for who is not in it.
    """
    if not own(paper, course):
        return {}
    path = out / course.roster
    keys = roster.keys(roster.read(path), [(entry.student, entry.identifier) for entry in entries], path)
    return {person: variant.text(course.variants, key) for person, key in keys.items()}


def give(work: Work, text: str | None) -> None:
    """Let a student's code find its numbers; a file that came with the hand-in says nothing."""
    work.files.pop(variant.FILE, None)
    if text is not None:
        work.files[variant.FILE] = text.encode()


def hand_out(out: Path, force: bool, course: str, table: Path | str) -> int:
    """Write a zip for each student of a table into a folder; how many. Raises CommandError.

    course: its name, from which numbers are drawn;  force: write over older zips.
    """
    from ..authoring import release  # which loads what reads labs' sources: grading needs none of it

    texts = kits(course, table)
    if out.name.lower().endswith(".zip") or out.is_file():
        raise CommandError(f"{out}: the kits of a class go into a folder; name a new one.")
    for name, text in texts.items():
        release.release(release.ROOT, out / f"{name}.zip", force, text)
    return len(texts)


def kits(course: str, table: Path | str) -> dict[str, str]:
    """{name of a student's kit: text of its variant.toml}. Raises CommandError for a roster that cannot be used."""
    found: dict[str, str] = {}
    for pupil in roster.read(table):
        name = _file(f"{pupil.name} {pupil.number}".strip())
        if name in found:
            raise CommandError(f"{table}: the kits of two students would both be called {name}.zip: give them numbers.")
        found[name] = variant.text(course, pupil.key)
    return found


def _file(name: str) -> str:
    letters = (letter if letter.isalnum() or letter in " -." else "-" for letter in name[:80])
    return "".join(letters).strip(" .") or "student"


def main(out: Path, force: bool, course: str, table: Path | str) -> int:
    """`labkit release --class`: as `hand_out`; the exit status."""
    try:
        if not course:
            raise CommandError("--class needs --variants COURSE: without, one kit is for all.")
        count = hand_out(out, force, course, table)
    except CommandError as problem:
        print(f"labkit release: {problem}", file=sys.stderr)
        return 2
    print(f"{out}: {counted(count, 'kit')}, one for each student of {table}, with numbers of their own.")
    return 0
