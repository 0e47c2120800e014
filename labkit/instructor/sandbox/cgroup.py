"""A control group (cgroup v2) for each worker: one cap on memory and on processes for all that it starts."""

import contextlib
import os
import re
import uuid
from functools import cache
from pathlib import Path

MEMORY, TASKS = 2 * 2**30, 64


@cache
def parent() -> str | None:
    """The nearest group above this process in which we may make groups with both limits, or None."""
    try:
        mounts = Path("/proc/self/mountinfo").read_text()
        top = re.search(r"^\S+ \S+ \S+ \S+ (\S+) .* - cgroup2 ", mounts, re.MULTILINE)
        own = re.search(r"^0::(.*)$", Path("/proc/self/cgroup").read_text(), re.MULTILINE)
    except OSError:
        return None
    if not top or not own:
        return None
    place = Path(top[1] + own[1])
    for group in (place, *place.parents):
        if not str(group).startswith(top[1]):
            break
        try:
            enabled = (group / "cgroup.subtree_control").read_text().split()
            if {"memory", "pids"} - set(enabled):
                (group / "cgroup.subtree_control").write_text("+memory +pids")
        except OSError:
            continue
        if os.access(group, os.W_OK) and os.access(group / "cgroup.procs", os.W_OK):
            return str(group)
    return None


def make() -> str:
    """A new group with its limits set; returns its folder. Raises OSError."""
    group = Path(parent() or "/nonexistent") / f"labkit-{uuid.uuid4().hex[:12]}"
    group.mkdir()
    (group / "memory.max").write_text(str(MEMORY))
    (group / "pids.max").write_text(str(TASKS))
    swap = group / "memory.swap.max"
    if swap.exists():
        swap.write_text("0")
    return str(group)


def within(group: str) -> list[str]:
    """The start of a command line that puts the rest of it into the group."""
    return ["/bin/sh", "-c", 'echo 0 > "$0/cgroup.procs"; exec "$@"', group]


def remove(group: str) -> None:
    """Kill what is left in the group and remove it."""
    with contextlib.suppress(OSError):
        (Path(group) / "cgroup.kill").write_text("1")
    for _ in range(100):
        try:
            os.rmdir(group)
            return
        except FileNotFoundError:
            return
        except OSError:
            os.sched_yield()
