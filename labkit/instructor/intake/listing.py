"""The files of an archive as they are found: which are taken, under what names, and what is left aside."""

import unicodedata
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from ..records import CommandError
from .names import readable, several

MAX_FILES = 20_000
MAX_NAME = 1000  # characters of a path
JUNK = {"__macosx", "__pycache__", "thumbs.db", "desktop.ini"}


@dataclass(frozen=True)
class Member:
    """One file or folder of an archive.

    path    relative, with '/', fit to be printed: no control characters, no '..', no empty parts.
    size    in bytes, as the archive says.
    when    its time in local time without a zone, or None.
    wrong   why it cannot be read, continuing 'notebook.ipynb ...', or ''.
    key     what the archive finds it by.
    """

    path: str
    size: int
    when: datetime | None
    folder: bool
    wrong: str
    key: Any

    @property
    def parts(self) -> tuple[str, ...]:
        """The names of its folders, and its own."""
        return tuple(self.path.split("/"))


class Listing:
    """Members as they are found, and what was left aside because its name says where to write."""

    def __init__(self, path: Path) -> None:
        self.members: list[Member] = []
        self._path = path
        self._folders: set[str] = set()
        self._refused: dict[str, list[str]] = {}
        self._slashes: list[str] = []

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
        parts = [part for part in map(readable, name.split("/")) if part not in ("", ".")]
        junk = next((number for number, part in enumerate(parts) if _junk(part)), len(parts))
        taken = junk == len(parts)
        if not taken:  # the folder around it still tells that its student handed something in
            parts, size, when, folder, wrong = parts[:junk], 0, None, True, ""
        path = "/".join(parts)
        if path and not (folder and path in self._folders):
            if folder:
                self._folders.add(path)
            if any(unicodedata.category(c) == "Cc" for c in name):
                wrong = wrong or "has control characters in its name"
            self.members.append(Member(path, size, when, folder, wrong, key))
        if len(self.members) > MAX_FILES:
            raise CommandError(too_many(self._path))
        return taken

    def refuse(self, problem: str, name: str) -> None:
        """Note a name that is left aside; the problem continues '2 names (a, b) ...'."""
        self._refused.setdefault(problem, []).append(readable(name))

    def notes(self) -> list[str]:
        """Sentences on what was left aside or read in another way."""
        notes = [f"Left aside {several(names, 'name')} {why}." for why, names in self._refused.items()]
        if self._slashes:
            notes.append(f"Read the backslashes as folders in {several(self._slashes, 'name')}.")
        return notes


def too_many(path: Path | str) -> str:
    """What is told about an archive of too many files."""
    return f"{path} holds more than {MAX_FILES} files: give one class at a time."


def _junk(part):
    """Whether an operating system, an editor or Jupyter made it, and no student."""
    return part.startswith((".", "~$")) or part.lower() in JUNK


def _unsafe(name, zipped):
    if len(name) > MAX_NAME:
        return f"of more than {MAX_NAME} characters"
    if ".." in name.split("/") or zipped and (name.startswith("/") or name[1:2] == ":"):
        return "pointing outside of the submissions"
    return ""
