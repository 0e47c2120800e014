"""Temporary folders that go with the process that made them: at its end, or when the next one begins."""

import contextlib
import os
import shutil
import stat
import tempfile
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
        shutil.rmtree(folder, ignore_errors=True)


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
                        _remove(entry.path)


def _remove(folder):
    owner = os.open(os.path.join(folder, OWNER), os.O_RDWR | os.O_NOFOLLOW)
    with open(owner, "w") as file:
        if _lock(file):
            shutil.rmtree(folder, ignore_errors=True)
