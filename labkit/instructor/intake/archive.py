"""Files of a folder or a zip that nobody vouches for: listed unopened, read in memory up to a cap.

Nothing is ever unpacked to the disk, and no link is followed.
"""

import io
import os
import stat
import struct
import zipfile
import zlib
from datetime import datetime
from itertools import islice
from pathlib import Path
from typing import IO, TypeAlias

from ...notebook.read import MAX_BYTES  # of one file
from ..records import CommandError, HandInError
from .listing import MAX_FILES, Listing, Member, is_junk, level_of, too_many
from .names import readable, shorten

MAX_DIRECTORY = 6_000_000  # bytes of a zip's table of contents, 300 for each file
MAX_DEPTH = 8  # folders inside folders
CHUNK = 1 << 20

DAMAGE = (
    *(zipfile.BadZipFile, zlib.error, struct.error, EOFError, ValueError, OverflowError, OSError),
    *(NotImplementedError, RuntimeError),
)


Archive: TypeAlias = "Folder | Zip"


def open_archive(path: Path | str, but: Path | None = None) -> Archive:
    """The Folder or Zip at `path`; raises CommandError if it is neither, or cannot be read."""
    path = Path(path)
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        if any(sign in path.name for sign in "*?["):
            raise CommandError(f"{path} is a pattern: give the folder {path.parent} itself.") from None
        raise CommandError(f"{path} does not exist: give the folder or the zip of the submissions.") from None
    except (OSError, ValueError) as error:
        raise CommandError(f"{path} cannot be opened: {getattr(error, 'strerror', error)}.") from None
    if stat.S_ISDIR(mode):
        return Folder(path, but)
    if path.suffix.lower() == ".ipynb":
        raise CommandError(f"{path} is one notebook: give the folder that it is in.")
    if not stat.S_ISREG(mode):
        raise CommandError(f"{path} is neither a folder nor a zip: give one of the submissions.")
    return Zip(path)


class Folder:
    """The regular files below a folder, but for another one; its `members`, and `notes` on what was left aside."""

    def __init__(self, path: Path, but: Path | None = None) -> None:
        self._but = os.stat(but) if but else None
        self.name = readable(path.resolve().name)
        self._listing = Listing(path)
        self._walk(path, "", 0)
        self.members, self.notes = self._listing.found()
        self.level = self._listing.level

    def _walk(self, folder, prefix, depth):
        try:
            with os.scandir(folder) as found:
                names = sorted(entry.name for entry in islice(found, MAX_FILES + 1))
        except OSError as error:
            if not prefix:
                raise CommandError(f"{folder} cannot be opened: {error.strerror}.") from None
            self._listing.refuse("which cannot be opened", prefix)
            return
        own = [name for name in names if not is_junk(name)]
        if depth == self._listing.level and len(own) == 1 and os.path.isdir(os.path.join(folder, *own)):
            self._listing.level += 1
        for name in names:
            if self._listing.crowded(tuple(f"{prefix}{name}".split("/"))):
                return
            path = os.path.join(folder, name)
            try:
                info = os.lstat(path)
            except OSError:
                continue
            if self._but and os.path.samestat(info, self._but):
                continue
            is_folder = stat.S_ISDIR(info.st_mode)
            key = path, info.st_dev, info.st_ino
            when = _moment(datetime.fromtimestamp, info.st_mtime)
            added = self._listing.add(prefix + name, info.st_size, when, is_folder, _no_file(info.st_mode), key)
            if added and is_folder and depth + 1 < MAX_DEPTH:
                self._walk(path, f"{prefix}{name}/", depth + 1)
            elif added and is_folder:
                self._listing.refuse(f"nested deeper than {MAX_DEPTH} folders", prefix + name)

    def read(self, member: Member) -> bytes:
        """The bytes of a member; raises HandInError if they cannot be had or are too many."""
        check(member)
        path, *identity = member.key
        flags = [getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_BINARY")]
        try:
            with open(os.open(path, os.O_RDONLY | sum(flags)), "rb", buffering=0) as file:
                info = os.fstat(file.fileno())
                # The very file that was listed: no link or folder took its place since.
                if _no_file(info.st_mode) or [info.st_dev, info.st_ino] != identity:
                    raise HandInError(f"{_last(member)} was replaced while it was being read: start again.")
                return capped(file, member)
        except OSError as error:
            raise HandInError(f"{_last(member)} cannot be opened: {error.strerror or error}.") from None

    def close(self) -> None:
        """A folder needs no closing."""


class Zip:
    """The members of a zip file, which stays open until `close`, and `notes` on what was left aside."""

    def __init__(self, path: Path, content: io.BytesIO | None = None) -> None:
        self.name = readable(path.name)
        self._listing = Listing(path)
        try:
            self._file = _Bounded(content or io.FileIO(path))
        except OSError as error:
            raise CommandError(f"{path} cannot be opened: {error.strerror or error}.") from None
        try:
            self._zip = zipfile.ZipFile(self._file)
            self._list(path)
        except UnicodeDecodeError:
            self.close()
            raise CommandError(f"{path} holds names that are not text: unpack it and give the folder.") from None
        except zipfile.BadZipFile:
            self.close()
            raise CommandError(f"{path} is not a zip, or is damaged: download it again.") from None
        except DAMAGE as error:
            self.close()
            raise CommandError(f"{path} cannot be read as a zip ({error}): download it again.") from None
        except CommandError:
            self.close()
            raise
        self.members, self.notes = self._listing.found()
        self.level = self._listing.level

    def _list(self, path):
        infos = self._zip.infolist()
        files = [info for info in infos if not info.is_dir()]
        if files and all(info.flag_bits & 1 for info in files):
            raise CommandError(f"{path} is encrypted: give a zip without a password.")
        shared = _overlapping(infos, self._zip.start_dir)
        self._listing.level = level_of(map(_name, infos))
        for number, info in enumerate(infos):
            when = _moment(datetime, *info.date_time)
            wrong = "overlaps another file of the zip" if number in shared else _unreadable(info)
            # 1980 begins where a zip has no time at all.
            when = None if when == datetime(1980, 1, 1) else when
            self._listing.add(_name(info), info.file_size, when, info.is_dir(), wrong, info, zipped=True)

    def read(self, member: Member) -> bytes:
        """The bytes of a member; raises HandInError if they cannot be had or are too many."""
        check(member)
        try:
            with self._zip.open(member.key) as file:
                return capped(file, member)
        except DAMAGE:
            raise HandInError(f"{_last(member)} is damaged inside the zip: hand it in again.") from None

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()


class _Bounded(io.BufferedReader):
    """A file that refuses to be read in one very large piece, as the contents of a zip of 10^6 files are."""

    def read(self, size=-1):
        if size is not None and size > MAX_DIRECTORY:
            raise CommandError(too_many(getattr(self.raw, "name", "It")))
        return super().read(size)


def _too_large(name):
    return f"{name} has more than {MAX_BYTES // 10**6} MB: clear the outputs, save it and hand it in again."


def check(member: Member) -> None:
    """Raise HandInError for a member that is not to be read."""
    if member.wrong:
        raise HandInError(f"{_last(member)} {member.wrong}: hand in the notebook file itself.")
    if member.size > MAX_BYTES:
        raise HandInError(_too_large(_last(member)))


def capped(file: IO[bytes], member: Member) -> bytes:
    """All bytes of an open member; raises HandInError if they are too many."""
    raw = bytearray()
    while piece := file.read(CHUNK):
        raw += piece
        if len(raw) > MAX_BYTES:
            raise HandInError(_too_large(_last(member)))
    return bytes(raw)


def _last(member):
    return shorten(member.parts[-1])


def _no_file(mode):
    """What a file mode stands for that cannot be read, or ''; 0 is an unknown mode, as zips have it."""
    if stat.S_ISLNK(mode):
        return "is a link"
    return "" if stat.S_IFMT(mode) in (0, stat.S_IFREG, stat.S_IFDIR) else "is not an ordinary file"


def _unreadable(info):
    if info.flag_bits & 1:
        return "is encrypted"
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        # The other decompressors of Python have no cap on what they return at once.
        return "is packed by a method that is not supported"
    return _no_file(info.external_attr >> 16)


def _overlapping(infos, end):
    """Numbers of the members whose data run into the next one's: so a small zip fakes a very large one."""
    found = set()
    for number in sorted(range(len(infos)), key=lambda i: infos[i].header_offset, reverse=True):
        info = infos[number]
        if info.header_offset + zipfile.sizeFileHeader + len(info.filename) + info.compress_size > end:
            found.add(number)
        end = info.header_offset
    return found


def _name(info):
    """The whole name, also past a NUL; macOS writes UTF-8 into zips without saying so."""
    name = info.orig_filename
    if not name.isascii() and not info.flag_bits & 0x800:
        try:
            return name.encode("cp437").decode("utf-8")
        except UnicodeError:
            pass
    return name


def _moment(make, *numbers):
    try:
        return make(*numbers)
    except (ValueError, OverflowError, OSError):
        return None
