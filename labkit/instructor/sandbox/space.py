"""How much a worker keeps in files: looked at from outside, since no limit of Linux counts a process's files together.

A single file is capped by a limit, and what bubblewrap gives as scratch space by its size; what is left is many files,
each of which costs a kilobyte of the kernel's memory, and a scratch folder on the disk.
"""

import os
import stat
import threading
from collections.abc import Callable
from contextlib import suppress

import psutil

BYTES, FILES = 2**26, 1024  # that a worker may keep
LOOK = 0.1  # seconds between two looks, in which a quick one gets further


class Watch:
    """Looks after one worker from a thread; calls `stop` when it keeps too much. full: whether that happened.

    pid: what was started;  scratch: the worker's folder, or '' if it is /tmp in bubblewrap.
    """

    def __init__(self, pid: int, scratch: str, stop: Callable[[], object]) -> None:
        self.pid, self.scratch, self.full = pid, scratch, False
        self._stop, self._over = stop, threading.Event()
        self._inside: int | None = None
        self._thread = threading.Thread(target=self._go_on, daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Look no longer."""
        self._over.set()
        self._thread.join()

    def _go_on(self):
        while not self._over.wait(LOOK):
            if self.look():
                return

    def look(self) -> bool:
        """Whether it keeps too much; it is stopped then."""
        with suppress(OSError, psutil.Error):  # it has just ended
            size, files = on_disk(self.scratch, self.pid) if self.scratch else self._in_memory()
            if size > BYTES or files > FILES:
                self.full = True
                self._stop()
        return self.full

    def _in_memory(self):
        """(bytes, files) of bubblewrap's /tmp, as seen through the worker, which is the last process in there."""
        if self._inside is None:  # looking for it takes longer than all else
            below = psutil.Process(self.pid).children(recursive=True)
            self._inside = below[-1].pid if len(below) > 1 else None
        if self._inside is None:
            return 0, 0
        try:
            room = os.statvfs(f"/proc/{self._inside}/root/tmp")
        except OSError:
            self._inside = None
            raise
        return (room.f_blocks - room.f_bfree) * room.f_frsize, room.f_files - room.f_ffree


def on_disk(folder: str, pid: int) -> tuple[int, int]:
    """(bytes, files) that a process keeps in a folder, deleted ones that it still holds included."""
    kept: dict[int, int] = {}  # {number of the file: bytes}
    device, todo = os.stat(folder).st_dev, [folder]
    while todo and len(kept) <= FILES:
        try:
            with os.scandir(todo.pop()) as entries:
                for entry in entries:
                    about = entry.stat(follow_symlinks=False)
                    kept[about.st_ino] = about.st_blocks * 512
                    todo += [entry.path] * entry.is_dir(follow_symlinks=False)
        except FileNotFoundError:  # it has just gone
            continue
        except OSError:  # closed, or deeper than a path may be long: only who hides something makes such a folder
            return BYTES + 1, FILES + 1
    with os.scandir(f"/proc/{pid}/fd") as opened:
        for file in opened:
            with suppress(FileNotFoundError):
                about = file.stat()
                if about.st_dev == device and stat.S_ISREG(about.st_mode) and not about.st_nlink:
                    kept[about.st_ino] = about.st_blocks * 512
    return sum(kept.values()) + _mapped(pid), len(kept)


def _mapped(pid):
    """Bytes of deleted files that a process keeps by mapping them into its memory."""
    with open(f"/proc/{pid}/maps") as maps:
        gone = [line.split()[0].split("-") for line in maps if line.endswith("(deleted)\n")]
    return sum(int(end, 16) - int(start, 16) for start, end in gone)
