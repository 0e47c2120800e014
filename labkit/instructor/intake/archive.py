"""Files of a folder or a zip that nobody vouches for: listed unopened, read in memory up to a cap.

Nothing is ever unpacked to the disk, and no link is followed.
"""

import io
import os
import stat
import struct
import unicodedata
import zipfile
import zlib
from dataclasses import dataclass
from datetime import datetime
from itertools import islice
from pathlib import Path

from ..records import CommandError, HandInError

MAX_BYTES = 20_000_000  # of one file
MAX_FILES = 20_000
MAX_DIRECTORY = 6_000_000  # bytes of a zip's table of contents, 300 for each file
MAX_NAME = 1000  # characters of a path
MAX_DEPTH = 8  # folders inside folders
CHUNK = 1 << 20

JUNK = {"__macosx", "__pycache__", "thumbs.db", "desktop.ini"}
DAMAGE = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    EOFError,
    ValueError,
    OverflowError,
    OSError,
    NotImplementedError,
    RuntimeError,
)


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
    key: object

    @property
    def parts(self):
        return tuple(self.path.split("/"))


def open_archive(path):
    """The Folder or Zip at `path`; raises CommandError if it is neither, or cannot be read."""
    path = Path(path)
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        raise CommandError(f"{path} does not exist: give the folder or the zip of the submissions.") from None
    except (OSError, ValueError) as error:
        raise CommandError(f"{path} cannot be opened: {getattr(error, 'strerror', error)}.") from None
    if stat.S_ISDIR(mode):
        return Folder(path)
    if path.suffix.lower() == ".ipynb":
        raise CommandError(f"{path} is one notebook: give the folder that it is in.")
    if not stat.S_ISREG(mode):
        raise CommandError(f"{path} is neither a folder nor a zip: give one of the submissions.")
    return Zip(path)


class Folder:
    """The regular files below a folder."""

    def __init__(self, path):
        self.name = readable(path.resolve().name)
        self._listing = _Listing(path)
        self._walk(path, "", 0)
        self.members, self.notes = self._listing.members, self._listing.notes()

    def _walk(self, folder, prefix, depth):
        try:
            with os.scandir(folder) as found:
                names = sorted(entry.name for entry in islice(found, MAX_FILES + 1))
        except OSError as error:
            if not prefix:
                raise CommandError(f"{folder} cannot be opened: {error.strerror}.") from None
            self._listing.refuse("which cannot be opened", prefix)
            return
        for name in names:
            path = os.path.join(folder, name)
            try:
                info = os.lstat(path)
            except OSError:
                continue
            is_folder = stat.S_ISDIR(info.st_mode)
            key = path, info.st_dev, info.st_ino
            when = _moment(datetime.fromtimestamp, info.st_mtime)
            added = self._listing.add(prefix + name, info.st_size, when, is_folder, _no_file(info.st_mode), key)
            if added and is_folder and depth + 1 < MAX_DEPTH:
                self._walk(path, f"{prefix}{name}/", depth + 1)
            elif added and is_folder:
                self._listing.refuse(f"nested deeper than {MAX_DEPTH} folders", prefix + name)

    def read(self, member):
        """The bytes of a member; raises HandInError if they cannot be had or are too many."""
        _check(member)
        path, *identity = member.key
        flags = [getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_BINARY")]
        try:
            with open(os.open(path, os.O_RDONLY | sum(flags)), "rb", buffering=0) as file:
                info = os.fstat(file.fileno())
                # The very file that was listed: no link or folder took its place since.
                if _no_file(info.st_mode) or [info.st_dev, info.st_ino] != identity:
                    raise HandInError(f"{_last(member)} was replaced while it was being read: start again.")
                return _capped(file, member)
        except OSError as error:
            raise HandInError(f"{_last(member)} cannot be opened: {error.strerror or error}.") from None

    def close(self):
        pass


class Zip:
    """The members of a zip file, which stays open until `close`."""

    def __init__(self, path):
        self.name = readable(path.name)
        self._listing = _Listing(path)
        try:
            self._file = _Bounded(io.FileIO(path))
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
        self.members, self.notes = self._listing.members, self._listing.notes()

    def _list(self, path):
        infos = self._zip.infolist()
        files = [info for info in infos if not info.is_dir()]
        if files and all(info.flag_bits & 1 for info in files):
            raise CommandError(f"{path} is encrypted: give a zip without a password.")
        shared = _overlapping(infos, self._zip.start_dir)
        for number, info in enumerate(infos):
            when = _moment(datetime, *info.date_time)
            wrong = "overlaps another file of the zip" if number in shared else _unreadable(info)
            # 1980 begins where a zip has no time at all.
            when = None if when == datetime(1980, 1, 1) else when
            self._listing.add(_name(info), info.file_size, when, info.is_dir(), wrong, info, zipped=True)

    def read(self, member):
        """The bytes of a member; raises HandInError if they cannot be had or are too many."""
        _check(member)
        try:
            with self._zip.open(member.key) as file:
                return _capped(file, member)
        except DAMAGE:
            raise HandInError(f"{_last(member)} is damaged inside the zip: hand it in again.") from None

    def close(self):
        self._file.close()


class _Bounded(io.BufferedReader):
    """A file that refuses to be read in one very large piece, as the contents of a zip of 10^6 files are."""

    def read(self, size=-1):
        if size is not None and size > MAX_DIRECTORY:
            raise CommandError(_too_many(self.raw.name))
        return super().read(size)


class _Listing:
    """Members as they are found, and what was left aside because its name says where to write."""

    def __init__(self, path):
        self.members = []
        self._path = path
        self._folders = set()
        self._refused = {}
        self._slashes = []

    def add(self, name, size, when, folder, wrong, key, zipped=False):
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
            raise CommandError(_too_many(self._path))
        return taken

    def refuse(self, problem, name):
        self._refused.setdefault(problem, []).append(readable(name))

    def notes(self):
        notes = [f"Left aside {several(names, 'name')} {why}." for why, names in self._refused.items()]
        if self._slashes:
            notes.append(f"Read the backslashes as folders in {several(self._slashes, 'name')}.")
        return notes


def readable(name):
    """`name` as it can be printed: what has no glyph becomes U+FFFD, any white space a space."""
    name = unicodedata.normalize("NFC", " ".join(name.split()))
    # Two joiners have no glyph but belong to words of Persian and of Indian languages.
    return "".join(c if c.isprintable() or c in "\u200c\u200d" else "\ufffd" for c in name)


def listed(names):
    """'a, b, c, ...': the first three of some names."""
    return ", ".join(shorten(name) for name in names[:3]) + (", ..." if len(names) > 3 else "")


def several(names, noun):
    """'2 files (a, b)'."""
    return f"{len(names)} {noun}{'s' if len(names) > 1 else ''} ({listed(names)})"


def shorten(name, width=80):
    return name if len(name) <= width else f"{name[: width // 2]}...{name[3 - width // 2 :]}"


def too_large(name):
    return f"{name} has more than {MAX_BYTES // 10**6} MB: clear the outputs, save it and hand it in again."


def _check(member):
    if member.wrong:
        raise HandInError(f"{_last(member)} {member.wrong}: hand in the notebook file itself.")
    if member.size > MAX_BYTES:
        raise HandInError(too_large(_last(member)))


def _capped(file, member):
    raw = bytearray()
    while piece := file.read(CHUNK):
        raw += piece
        if len(raw) > MAX_BYTES:
            raise HandInError(too_large(_last(member)))
    return bytes(raw)


def _last(member):
    return shorten(member.parts[-1])


def _too_many(path):
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
