"""Where recorded data live on this computer, and taking in what was downloaded.

Nothing here goes to the network: the student fetches a data set, `labkit data PATH` checks it and
puts it where the labs look.
"""

import os
import shutil
import stat
import struct
import sys
import tempfile
import time
import zipfile
import zlib
from collections.abc import Sequence
from functools import partial
from pathlib import Path, PurePosixPath

from ..recorded import DataError, folder
from . import others
from .files import FILES, PUBLISHED, set_number, standard, verify

DEEP = 3  # how many folders below PATH are searched
LARGEST, LARGEST_ZIP, ENTRIES = 2**26, 2**30, 2000  # bytes unpacked (all of set 7: 27 MB), files in a zip
_BROKEN = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, ValueError, NotImplementedError, RuntimeError)


class DataMissingError(DataError):
    """A path that leads to nothing that can be read as a data set."""


def find(name: str) -> Path | None:
    """Path of a data set ('MRCLAM_Dataset7') in the data folder or one folder below it, or None."""
    places = [folder() / name, *sorted(folder().glob(f"[!.]*/{name}"))]
    return next((place for place in places if place.is_dir()), None)


def main(paths: Sequence[str]) -> int:
    """`labkit data PATH ...`: take in each path and say so; without a path, say what is there.

    Returns the exit code: 0 all is well, 1 a data set failed its verification, 2 a path cannot be read.
    """
    code = 0
    for path in paths:
        try:
            print("\n".join(take_in(path)))
        except DataError as error:
            print(error, file=sys.stderr)
            code = max(code, 2 if isinstance(error, DataMissingError) else 1)
    if not paths:
        there = [find(f"MRCLAM_Dataset{i}") for i in range(1, 10)]
        print(f"The data folder is {folder()}.")
        there += sorted(steps.parent for steps in folder().glob("*/steps.csv"))
        print("\n".join(f"  {place}" for place in there if place) or "  It holds no data set yet.")
        command = "python3 lab.py" if Path("lab.py").is_file() else "labkit"  # here, where a kit's folder is open
        print(f"{PUBLISHED}\nDownload one, then: {command} data PATH")
    return code


def take_in(path: str | Path) -> list[str]:
    """Copy the data sets in `path`, a folder or a zip file, into the data folder: a sentence for each.

    A set is copied beside its place, verified there and then renamed, so that a half-copied or a bad
    one never counts as a data set; a verified one that is already there stays.  Raises DataMissingError for
    a path that is no folder and no sound zip file, or has no data set in it, and DataError, after all
    sets were tried, when some failed.
    """
    path = Path(path).expanduser()
    try:
        if path.is_dir():
            return _take_all(_in_folder(path), path)
        with _opened(path) as archive:
            return _take_all(_in_zip(archive, path), path)
    except _BROKEN as error:
        raise DataMissingError(f"{path} is a damaged zip file ({error}): download it again") from None
    except OSError as error:
        raise DataMissingError(
            f"{error.filename or path} cannot be read or written: {error.strerror or error}"
        ) from None


def _take_all(sets, path):
    """Take in `sets`, a list of (folder name, {file name: function that opens it}): a sentence for each."""
    sets = [(name, files) for name, files in sets if files.keys() & FILES.keys() or others.known(files)]
    if not sets:
        raise DataMissingError(
            f"{path} has no MRCLAM data set: no files like Robot1_Odometry.dat were found in it, "
            f"and none of a single run: Odometry.csv, sensor_data.dat or steps.csv. {PUBLISHED}"
        )
    said, failed = [], []
    for name, files in sets:
        files, whole = _published(files)
        if not whole and others.known(files):
            try:
                said += others.take(path.stem if name in ("", "data") else name, files)
            except DataError as error:
                failed.append(f"{error}\nIt was not taken in from {path}.")
            continue
        number = set_number(name) or (set_number(path.name) if len(sets) == 1 else None)
        if number is None:
            failed.append(
                f"Which data set is in '{name or path}'? Its name does not tell: "
                "rename it to MRCLAM_Dataset7, if it is number 7, and try again."
            )
            continue
        try:
            said.append(_take_one(f"MRCLAM_Dataset{number}", files))
        except DataError as error:
            failed.append(f"{error}\nIt was not taken in from {path}; download it again? {PUBLISHED}")
    if failed:
        raise DataError("\n".join(said + failed))
    return said


def _published(files):
    """The files, by their published names where these or a course's copies are a whole set; whether they are one."""
    if any(name.startswith("Robot") for name in files if name in FILES):
        return {name: opened for name, opened in files.items() if name in FILES}, True
    named = {standard(name): opened for name, opened in files.items() if standard(name)}
    return (named, True) if named.keys() >= FILES.keys() else (files, False)


def _take_one(name, files):
    """Copy, verify, rename; the sentence of `verify` and the place."""
    data, there = folder(), find(name)
    if there:
        try:
            return f"{verify(there)}; it was already in {there} and stays as it is"
        except DataError:
            pass  # a spoilt copy: replaced if the new one is sound
    data.mkdir(parents=True, exist_ok=True)
    for old in data.glob(".incoming-*"):  # left by a copy that was killed
        if time.time() - old.stat().st_mtime > 3600:
            shutil.rmtree(old, ignore_errors=True)
    with tempfile.TemporaryDirectory(prefix=".incoming-", dir=data) as incoming:
        new = Path(incoming, name)
        new.mkdir()
        for file, opened in files.items():
            with opened() as source, open(new / file, "wb") as target:
                shutil.copyfileobj(source, target)
        report = verify(new)
        target = there or data / name
        if target.exists():
            target.rename(Path(incoming, "spoilt"))
        new.rename(target)
    return f"{report}; now in {target}"


def _in_folder(path):
    """The data sets in a folder: a list of (name, {file name: function that opens it})."""
    sets = []
    for place, folders, names in os.walk(path):
        files = {name: partial(open, Path(place, name), "rb") for name in names if others.wanted(name)}
        if files:
            sets.append((Path(place).resolve().name, files))
        depth = len(Path(place).relative_to(path).parts)
        folders[:] = [f for f in folders if not f.startswith((".", "__MACOSX"))] if depth < DEEP else []
    return sets


def _opened(path):
    """`path` as an open ZipFile."""
    if not path.exists():
        raise DataMissingError(f"There is nothing at {path}. {PUBLISHED}")
    if not zipfile.is_zipfile(path):
        raise DataMissingError(f"{path} is neither a folder nor a zip file. {PUBLISHED}")
    return zipfile.ZipFile(path)


def _in_zip(archive, path):
    """The data sets in a zip, as `_in_folder` gives them; DataMissingError for one that plays tricks.

    Only plain names that are known are ever written, so no entry can choose its place; that the others
    are refused too is because a data set with such entries is none.
    """
    entries = archive.infolist()
    size = sum(entry.file_size for entry in entries)
    problem = "it unpacks to far too much" if size > LARGEST_ZIP or len(entries) > ENTRIES else ""
    sets, seen = {}, set()
    for entry in entries:
        place = PurePosixPath(entry.filename.replace("\\", "/"))
        if place.is_absolute() or ".." in place.parts or ":" in entry.filename:
            problem = f"'{entry.filename}' leads out of its folder"
        elif stat.S_ISLNK(entry.external_attr >> 16):
            problem = f"'{entry.filename}' is a link"
        elif entry.flag_bits & 1:
            problem = "it is protected by a password"
        elif place in seen and not entry.is_dir():
            problem = f"'{entry.filename}' is in it twice"
        elif others.wanted(place.name) and "__MACOSX" not in place.parts:
            if entry.file_size > LARGEST:
                problem = f"'{entry.filename}' unpacks to {entry.file_size / 2**20:.0f} MB, far too much"
            if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                problem = f"'{entry.filename}' is packed in a way that is not read here"  # bounded memory
            files = sets.setdefault(place.parent, {})
            files[place.name] = partial(archive.open, entry)
        seen.add(place)
        if problem:
            raise DataMissingError(f"{path} was not unpacked: {problem}. Get the original file. {PUBLISHED}")
    return [(parent.name, files) for parent, files in sets.items()]
