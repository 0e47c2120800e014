"""The files of an archive as they are found: which are taken, under what names, and what is left aside."""

import hashlib
import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

from ..records import CommandError
from .names import readable, several

MAX_FILES = 20_000
MAX_OF_ONE = 2000  # files of one student
MAX_NAME = 1000  # characters of a path
JUNK = {"__macosx", "__pycache__", "thumbs.db", "desktop.ini", "node_modules", "site-packages"}
UNLIKE = "≠"  # with a few letters behind it, tells a name from one that looks the same
ENDING = re.compile(r"(\.ipynb)?\.\w{1,5}$", re.IGNORECASE)
CROWDED = f"holds more than {MAX_OF_ONE} files"


@dataclass(frozen=True, slots=True)
class Member:
    """One file or folder of an archive.

    path    relative, with '/', fit to be printed: no control characters, no '..', no empty parts.
    size    in bytes, as the archive says.
    when    its time in local time without a zone, or None; that of a student's archive, if it lies in one.
    wrong   why it cannot be read, continuing 'notebook.ipynb ...', or ''; CROWDED for a folder that is not looked into.
    key     what the archive finds it by.
    raw     the names of its folders and its own, as the archive has them.
    own     its own time in a student's archive, or None.
    """

    path: str
    size: int
    when: datetime | None
    folder: bool
    wrong: str
    key: Any
    raw: tuple[str, ...] = ()
    own: datetime | None = None

    @property
    def parts(self) -> tuple[str, ...]:
        """The names of its folders, and its own."""
        return tuple(self.path.split("/"))


class Listing:
    """Members as they are found, and what was left aside because its name says where to write.

    level: how many folders hold the whole class; what is in them is one student's each.
    """

    def __init__(self, path: Path) -> None:
        self.level = 0
        self._members: list[Member] = []
        self._path = path
        self._folders: set[str] = set()
        self._refused: dict[str, list[str]] = {}
        self._slashes: list[str] = []
        self._count: Counter[tuple[str, ...]] = Counter()  # files of each student, by the raw names that lead to them

    def add(
        self, name: str, size: int, when: datetime | None, folder: bool, wrong: str, key: Any, zipped: bool = False
    ) -> bool:
        """Whether the member was taken as it is; raises CommandError when there are too many."""
        if zipped and "\\" in name:
            self._slashes.append(readable(name))
            name = name.replace("\\", "/")
        problem = _unsafe(name, zipped)
        if problem:
            self.refuse(problem, name)
            return False
        raw = _parts(name)
        junk = next((number for number, part in enumerate(raw) if is_junk(part)), len(raw))
        taken = junk == len(raw)
        if not taken:  # the folder around it still tells that its student handed something in
            raw, size, when, folder, wrong = raw[:junk], 0, None, True, ""
        path = "/".join(map(readable, raw))
        seen = "/".join(raw)
        if path and not (folder and seen in self._folders) and self._room(raw):
            if folder:
                self._folders.add(seen)
            if any(unicodedata.category(c) == "Cc" for c in name):
                wrong = wrong or "has control characters in its name"
            self._members.append(Member(path, size, when, folder, wrong, key, raw))
        if len(self._members) > MAX_FILES:
            raise CommandError(too_many(self._path))
        return taken and not self.crowded(raw)

    def _room(self, raw):
        """Whether one more file of this student is looked at."""
        top = raw[: self.level + 1]
        if len(raw) > len(top):
            self._count[top] += 1
        if self._count[top] == MAX_OF_ONE + 1:  # all of them go, and a folder that says so stays
            self._members = [member for member in self._members if member.raw[: len(top)] != top]
            self._members.append(Member("/".join(map(readable, top)), 0, None, True, CROWDED, None, top))
        return not self.crowded(raw)

    def crowded(self, raw: Sequence[str]) -> bool:
        """Whether these raw names lead to a student who has too many files."""
        return self._count[tuple(raw[: self.level + 1])] > MAX_OF_ONE

    def refuse(self, problem: str, name: str) -> None:
        """Note a name that is left aside; the problem continues '2 names (a, b) ...'."""
        self._refused.setdefault(problem, []).append(readable(name))

    def found(self) -> tuple[list[Member], list[str]]:
        """(members, sentences on what was left aside or read in another way)."""
        members, told = _apart(self._members)
        notes = [f"Left aside {several(names, 'name')} {why}." for why, names in self._refused.items()]
        if self._slashes:
            notes.append(f"Read the backslashes as folders in {several(self._slashes, 'name')}.")
        if told:
            one = "s" * (len(told) == 1)
            notes.append(
                f"{several(told, 'name')} look{one} like another and differ{one} in letters that are not seen or in "
                "how letters are stored: they are kept apart."
            )
        return members, notes


def level_of(names: Iterable[str]) -> int:
    """How many folders hold all files of these names."""
    common: tuple[str, ...] | None = None
    for name in names:
        raw = _parts(name)
        if any(map(is_junk, raw)):
            continue
        if common is None:
            common = raw[:-1]
        while common != raw[: len(common)] or len(common) == len(raw):
            common = common[:-1]
    return len(common or ())


def too_many(path: Path | str) -> str:
    """What is told about an archive of too many files."""
    return f"{path} holds more than {MAX_FILES} files: give one class at a time, and unpack it if it is a zip."


def _parts(name):
    return tuple(part for part in name.split("/") if readable(part) not in ("", "."))


def _apart(members):
    """(members, names told apart): of names that look alike, those that are not stored as they look get a mark."""
    alike: dict[tuple, set[str]] = defaultdict(set)
    for member in members:
        for at, part in enumerate(member.raw):
            alike[*member.raw[:at], _look(part)].add(part)
    alike = {where: parts for where, parts in alike.items() if len(parts) > 1}
    if not alike:
        return members, []
    told: dict[tuple[str, ...], str] = {}

    def named(member, at):
        part, last = member.raw[at], at == len(member.raw) - 1
        if part == _look(part) or (*member.raw[:at], _look(part)) not in alike:
            return readable(part)
        mark = f" {UNLIKE}{hashlib.sha256(part.encode('utf-8', 'surrogatepass')).hexdigest()[:6]}"
        end = ENDING.search(readable(part)) if last and not member.folder else None
        stem, end = (readable(part)[: end.start()], end[0]) if end else (readable(part), "")
        return told.setdefault(member.raw[: at + 1], f"{stem}{mark}{end}")

    names = ["/".join(named(member, at) for at in range(len(member.raw))) for member in members]
    return [replace(member, path=path) for member, path in zip(members, names)], list(told.values())


def _look(part):
    """A name as people see it: without the joiners that `readable` leaves."""
    return readable(part).replace("\u200c", "").replace("\u200d", "")


def is_junk(part: str) -> bool:
    """Whether an operating system, an editor or Jupyter made it, and no student."""
    part = readable(part)
    return part.startswith((".", "~$")) or part.lower() in JUNK


def _unsafe(name, zipped):
    if len(name) > MAX_NAME:
        return f"of more than {MAX_NAME} characters"
    if ".." in name.split("/") or zipped and (name.startswith("/") or name[1:2] == ":"):
        return "pointing outside of the submissions"
    return ""
