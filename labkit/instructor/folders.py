"""Temporary folders that go with the process that made them: at its end, or when the next one begins."""

import contextlib
import os
import stat
import tempfile
import uuid
from collections.abc import Iterator
from contextlib import contextmanager

SHORT = "/tmp"  # the names of local sockets are 100 bytes at most, and other folders may be deep
PREFIX, OWNER = "labkit-", ".owner"  # a file that is locked as long as whoever made the folder lives


@contextmanager
def temporary(kind: str, short: bool = False) -> Iterator[str]:
    """A folder that students' workers can go through and not list, removed at the end.

    kind: a part of its name;  short: whether it is for a socket. What killed processes left is removed first.
    """
    sweep()
    place = SHORT if short and os.access(SHORT, os.W_OK) else tempfile.gettempdir()
    folder = tempfile.mkdtemp(prefix=f"{PREFIX}{kind}-", dir=place)
    os.chmod(folder, 0o711)
    try:
        with _locked(folder):
            yield folder
    finally:
        remove(folder)


@contextmanager
def _locked(folder):
    path = os.path.join(folder, OWNER)
    with open(f"{path}.new", "w") as file:
        if _lock(file):
            os.replace(f"{path}.new", path)  # under this name it is locked from the beginning
        yield


def _lock(file):
    """Whether the file was free; it is locked then, until it is closed or this process ends in whatever way."""
    try:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (ImportError, OSError):  # another has it, or this system has no such locks
        return False
    return True


def sweep() -> None:
    """Remove this user's folders of processes that are gone; one that lives, or has no owner's file, is left alone."""
    for place in {tempfile.gettempdir(), SHORT}:
        with contextlib.suppress(OSError), os.scandir(place) as entries:
            for entry in [entry for entry in entries if entry.name.startswith(PREFIX)]:
                with contextlib.suppress(OSError):
                    about = entry.stat(follow_symlinks=False)
                    if stat.S_ISDIR(about.st_mode) and about.st_uid == os.geteuid():
                        _swept(entry.path)


def remove(folder: str) -> None:
    """Remove a folder with what students' code made in it: deeper than any path may be long, closed to its owner.

    Each folder in it is lifted to the top before it is emptied. What cannot be removed stays, without a word.
    """
    with contextlib.suppress(OSError):
        while folders := _emptied(folder):
            for path in folders:
                for below in _emptied(path):
                    os.rename(below, os.path.join(folder, uuid.uuid4().hex))
                os.rmdir(path)
        os.rmdir(folder)


def _emptied(folder):
    """The folders in a folder, which can be opened now; all else in it is removed."""
    with os.scandir(folder) as found:
        entries = list(found)
    folders = [entry.path for entry in entries if entry.is_dir(follow_symlinks=False)]
    for entry in entries:
        if not entry.is_dir(follow_symlinks=False):
            os.remove(entry.path)
    for path in folders:
        os.chmod(path, 0o700)
    return folders


def _swept(folder):
    owner = os.open(os.path.join(folder, OWNER), os.O_RDWR | os.O_NOFOLLOW)
    with open(owner, "w") as file:
        if _lock(file):
            remove(folder)
