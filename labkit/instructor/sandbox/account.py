"""As which user a worker runs, and how many threads that user may have."""

import os
import re
from pathlib import Path

import psutil

NOBODY = 65534  # the user that root's workers become where there are no other numbers
OWN_USER = 0x70000000  # where there are, each becomes a user of its own: from here on nobody has an account
THREADS = 64  # that a worker may have
MORE = 256  # that an account may have more than now, where Linux counts all that it runs and not the worker's alone


def user(pid: int) -> int:
    """The user that root's worker becomes: no other process's, so that its threads are counted alone."""
    try:
        maps = [Path(f"/proc/self/{kind}_map").read_text().splitlines() for kind in ("uid", "gid")]
    except OSError:  # not Linux
        return NOBODY
    last = OWN_USER + 2**22  # no process has a higher number
    spans = [[(int(line.split()[0]), int(line.split()[2])) for line in lines] for lines in maps]
    known = all(any(start <= OWN_USER and last <= start + count for start, count in span) for span in spans)
    return OWN_USER + pid if known else NOBODY


def threads(way: str, uid: int | None) -> int:
    """The limit on threads (RLIMIT_NPROC), which Linux counts for all of a user's processes in a user namespace."""
    alone = uid not in (None, NOBODY)
    if uid is None and way == "bubblewrap":  # it has such a namespace to itself, where Linux counts these apart
        alone = tuple(map(int, re.findall(r"\d+", os.uname().release)[:2])) >= (5, 14)
    if alone:
        return THREADS
    counted, count = os.getuid() if uid is None else uid, 0
    for process in psutil.process_iter(["uids", "num_threads"]):
        count += (process.info["num_threads"] or 0) if (process.info["uids"] or [None])[0] == counted else 0
    return count + MORE
