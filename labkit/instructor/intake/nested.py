"""Zips inside an archive of submissions: students who were asked for one file pack what they have."""

import io
import zipfile
from collections import Counter
from dataclasses import replace
from pathlib import Path

from ..records import CommandError, HandInError
from .archive import DAMAGE, Archive, Zip, capped, check
from .listing import MAX_FILES, MAX_OF_ONE, Member, too_many

MAX_INSIDE = 500  # files of one student's zip


class Opened:
    """An archive with the zips in it as folders, one level deep; reads like the archive itself.

    What is no sound zip, or holds too much, stays the file that it is, for its student to be told.
    """

    def __init__(self, archive: Archive, path: Path | str) -> None:
        self.name, self.notes, self._archive = archive.name, archive.notes, archive
        self._outer: tuple[str, zipfile.ZipFile] | None = None  # the zip that was opened last
        self.members: list[Member] = []
        count: Counter[tuple[str, ...]] = Counter()  # of each student's zips
        for member in archive.members:
            top = member.parts[: archive.level + 1]
            is_zip = not member.folder and not member.wrong and member.path.lower().endswith(".zip")
            inside = self._inside(member) if is_zip and count[top] <= MAX_OF_ONE else []
            count[top] += len(inside)
            self.members += inside or [member]
            if len(self.members) > MAX_FILES:
                raise CommandError(too_many(path))

    def _inside(self, outer):
        try:
            inner = Zip(Path(outer.path), io.BytesIO(self._archive.read(outer)))
        except (CommandError, HandInError):
            return []
        if len(inner.members) > MAX_INSIDE:
            return []
        # What counts is when it was handed in; what the student's computer says only orders what came together.
        return [
            replace(
                member, path=f"{outer.path}/{member.path}", when=outer.when, own=member.when, key=(outer, member.key)
            )
            for member in inner.members
        ]

    def read(self, member: Member) -> bytes:
        """The bytes of a member; raises HandInError if they cannot be had or are too many."""
        if not (isinstance(member.key, tuple) and isinstance(member.key[0], Member)):
            return self._archive.read(member)
        check(member)
        outer, info = member.key
        try:
            if not self._outer or self._outer[0] != outer.path:
                self._outer = outer.path, zipfile.ZipFile(io.BytesIO(self._archive.read(outer)))
            with self._outer[1].open(info) as file:
                return capped(file, member)
        except DAMAGE:
            raise HandInError(f"{member.parts[-1]} is damaged inside the zip: hand it in again.") from None

    def close(self) -> None:
        """Let go of the archive."""
        self._archive.close()
