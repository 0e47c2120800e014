"""From the submissions of a class, as an LMS or a person packed them, to the notebooks of one lab.

Whatever is inside is taken for hostile: see `archive`. `survey` looks at names only, `read` at one notebook.
Which of a student's attempts counts is decided in `attempts`.
"""

import hashlib
import re
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Self

from ...notebook.read import Cell
from ..records import CommandError, HandInError
from .archive import open_archive
from .choice import alike, choose
from .handin import read_cells
from .listing import CROWDED, Member
from .names import several, shorten
from .nested import Opened
from .owners import MAX_DEPTH, OTHER, is_lab, is_notebook, may_be_notebook, owner_of, system_of, unwrapped

MAX_BESIDE, MAX_BESIDE_BYTES = 50, 5_000_000  # files beside a notebook, and bytes of them in all
NOT_THEIRS = {"site-packages", "node_modules", "venv", "env", "labkit"}  # installed or given out, not written


@dataclass(frozen=True)
class Entry:
    """One notebook that may be a student's hand-in, not yet opened.

    student     display name;  identifier: the LMS's number, '' if there is none.
    source      archive and path, for reports;  name: the file's own name.
    when        time of the file, local, or None; None for Canvas, which writes the time of the download.
    late        the LMS itself says so.
    notes       sentences on what is odd.
    apart       whether the folder that it is in is its student's own.
    """

    student: str
    identifier: str
    source: str
    name: str
    when: datetime | None
    late: bool
    notes: tuple[str, ...]
    member: Member
    apart: bool = False


@dataclass(frozen=True)
class Unfit:
    """A student's hand-in that cannot be graded; the reason is a sentence that the student understands."""

    student: str
    identifier: str
    source: str
    when: datetime | None
    reason: str


@dataclass
class _Student:
    """One student's files, as pairs of Owner and Member."""

    top: str
    files: list = field(default_factory=list)
    typed: bool = False
    problem: str = ""  # why none of them is looked at


class Submissions:
    """A folder or zip of submissions; closed at the end of a `with` block.

    out: the folder that is written into, of which nothing was handed in.
    Raises CommandError if `path` is no folder and no zip that can be read.
    """

    def __init__(self, path: Path | str, out: Path | None = None) -> None:
        self._path = path
        self._archive = Opened(open_archive(path, out), path)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._archive.close()

    def survey(self, lab: str) -> tuple[list[Entry], list[Unfit], list[str]]:
        """(entries, unfits, notes) of a lab, say '01_cartesian_ekf', without opening any notebook.

        Entries of one student follow each other, the latest attempt last. notes: sentences for the
        instructor. Raises CommandError if nothing was handed in at all.
        """
        students, notes = self._students(lab)
        entries, unfits = [], []
        for (student, identifier), found in students.items():
            good, reason, odd = choose(found.files, lab)
            if found.problem:
                good, reason, odd = [], found.problem, []
            notes += [f"{student}: {text}" for text in odd]
            if reason:
                unfits.append(Unfit(student, identifier, self._source(found.top), None, reason))
            twice = len({member.path for _, member in good}) < len(good)
            entries += [self._entry(student, identifier, pair, lab, twice) for pair in good]
            if len({member.parts[:-1] for _, member in good if len(member.parts) > 1}) > 1:
                notes.append(f"{student}: notebooks in several folders count as attempts of one student.")
        notes += alike([student for student, identifier in students if not identifier])
        if not entries and not unfits:
            known = "a download of Moodle or Canvas, a folder of notebooks with their students' names, or one with a"
            told = f"{self._path} holds no hand-ins: give {known} folder for each student."
            raise CommandError(" ".join([told, *notes]))
        return entries, unfits, notes

    def read(self, entry: Entry) -> tuple[list[Cell], str]:
        """(cells, SHA-256 of the file) of an entry. Raises HandInError."""
        raw = self._archive.read(entry.member)
        return read_cells(raw, entry.name), hashlib.sha256(raw).hexdigest()

    def beside(self, entry: Entry) -> dict[str, bytes]:
        """{relative path with '/': content} of the files that its student handed in beside an entry's notebook.

        Notebooks of labs, installed packages and what cannot be read are left out, and so is what comes, by depth and
        name, after 50 files or goes beyond 5 MB. {} where the notebook's folder is the whole class's.
        """
        home = entry.member.parts[:-1]
        if not entry.apart:
            return {}
        inside = [(m.parts[len(home) :], m) for m in self._archive.members if m.parts[: len(home)] == home]
        installed = [parts[:-1] for parts, _ in inside if parts[-1:] == ("pyvenv.cfg",)]
        found: dict[str, bytes] = {}
        left = MAX_BESIDE_BYTES
        for parts, member in sorted(inside, key=lambda pair: (len(pair[0]), pair[0])):
            if len(found) == MAX_BESIDE:
                break
            if member.size > left or not _theirs(parts, member) or any(parts[: len(v)] == v for v in installed):
                continue
            try:
                raw = self._archive.read(member)
            except HandInError:
                continue
            if len(raw) <= left:
                found["/".join(parts)] = raw
                left -= len(raw)
        return found

    def _entry(self, student, identifier, pair, lab, twice):
        owner, member = pair
        notes = [] if is_lab(owner.name, lab) else [f"The notebook is named {shorten(owner.name)}, not {lab}.ipynb."]
        if twice:
            notes.append("The archive holds a file of this name twice; each counts as an attempt.")
        return Entry(
            student,
            identifier,
            self._source(member.path),
            shorten(owner.name),
            owner.when or (None if owner.canvas else member.when),
            owner.late,
            tuple(notes),
            member,
            owner.apart,
        )

    def _source(self, path):
        return f"{self._archive.name}: {path}"

    def _students(self, lab):
        """{(student, identifier): _Student}, and notes on files that are nobody's."""
        students, strays, deep = {}, [], []
        pairs = unwrapped(self._archive.members, lab)
        system = system_of(pairs)
        for parts, member in pairs:
            owner = owner_of(parts, member, lab, system)
            if not owner:
                strays.append(member.path)
                continue
            owner.apart = len(parts) > 1
            own = students.setdefault((owner.student, owner.identifier), _Student(member.path))
            own.top = "/".join(member.parts[: len(member.parts) - len(parts) + 1])
            own.problem = own.problem or owner.doubt
            if member.wrong == CROWDED:
                own.problem = f"The folder {CROWDED}: hand in the notebook itself."
            if len(parts) > 1 + MAX_DEPTH:
                deep.append(member.path)
            elif owner.typed:
                own.typed = True
            elif owner.name and (not member.folder or is_notebook(owner.name)):
                own.files.append((owner, member))
        notes = list(self._archive.notes)
        if strays:
            notes.append(f"Left aside {several(strays, 'file')}: no notebook with a student's name.")
        if deep:
            notes.append(f"Left aside {several(deep, 'file')} nested deeper than {MAX_DEPTH} folders.")
        typed = sum(own.typed for own in students.values())
        if typed:
            notes.append(f"Left aside what {typed} student{'s' * (typed > 1)} typed into the LMS as text.")
        others = sum(
            not (is_notebook(owner.name) or may_be_notebook(owner.name))
            for own in students.values()
            for owner, _ in own.files
        )
        if others:
            what = "files that are not notebooks" if others > 1 else "file that is not a notebook"
            notes.append(f"Left aside {others} {what}.")
        return students, notes


def _theirs(parts, member):
    """Whether a student may have written it for the notebook to use, under a name that is safe everywhere."""
    if not parts or member.folder or member.wrong or any(is_notebook(part) for part in parts[:-1]):
        return False
    if is_notebook(parts[-1]) and OTHER.search(parts[-1]):  # another could be run by `%run`
        return False
    odd = any(re.search(r'[\\:*?"<>|\ufffd]', part) for part in parts)
    return not odd and not any(part.lower() in NOT_THEIRS for part in parts[:-1])
