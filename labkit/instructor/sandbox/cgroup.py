"""A control group (cgroup v2) for each worker: one cap on memory and on processes for all that it starts."""

import os
import re
import uuid
from functools import cache
from pathlib import Path

MEMORY, TASKS = 2 * 2**30, 64


@cache
def parent():
    """The nearest group above this process in which we may make groups with both limits, or None."""
    try:
        mounts = Path("/proc/self/mountinfo").read_text()
        top = re.search(r"^\S+ \S+ \S+ \S+ (\S+) .* - cgroup2 ", mounts, re.MULTILINE)[1]
        own = re.search(r"^0::(.*)$", Path("/proc/self/cgroup").read_text(), re.MULTILINE)[1]
    except (OSError, TypeError):
        return None
    place = Path(top + own)
    for group in (place, *place.parents):
        if not str(group).startswith(top):
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


def make():
    """A new group with its limits set; returns its folder. Raises OSError."""
    group = Path(parent() or "/nonexistent") / f"labkit-{uuid.uuid4().hex[:12]}"
    group.mkdir()
    (group / "memory.max").write_text(str(MEMORY))
    (group / "pids.max").write_text(str(TASKS))
    swap = group / "memory.swap.max"
    if swap.exists():
        swap.write_text("0")
    return str(group)


def within(group):
    """The start of a command line that puts the rest of it into the group."""
    return ["/bin/sh", "-c", 'echo 0 > "$0/cgroup.procs"; exec "$@"', group]


def remove(group):
    """Kill what is left in the group and remove it."""
    try:
        (Path(group) / "cgroup.kill").write_text("1")
    except OSError:
        pass
    for _ in range(100):
        try:
            os.rmdir(group)
            return
        except FileNotFoundError:
            return
        except OSError:
            os.sched_yield()
