"""What really holds: a worker tries to break out of each sandbox before any student's code does."""

import ctypes
import fcntl
import os
import resource
import signal
import socket
import sys
import threading
from collections.abc import Set
from pathlib import Path

# {name: (what a worker does or not, what it tries to find that out)}
PROMISES = {
    "files": ("cannot read files outside its sandbox", "a file that all may read"),
    "write": ("cannot write outside its scratch folder", "a folder that all may write to"),
    "metadata": ("cannot change other files' rights and times", "chmod, utime, setxattr, chown, truncate of that file"),
    "scratch": ("can write in its scratch folder", "a file there"),
    "space": ("is stopped when it keeps more than 64 MB in files", "deleted open files, wherever it can write at all"),
    "count": ("is stopped when it keeps more than 1024 files", "empty files, wherever it can write at all"),
    "imports": ("can import what students use", "numpy.random, scipy.linalg, wave"),
    "environment": ("sees no environment variables of the grader", "a variable set for this"),
    "memory": ("is stopped at its memory cap", "an array of 256 MB more"),
    "threads": ("is stopped at a number of threads", "one more than that"),
    "fork": ("cannot start processes", "fork"),
    "signal": ("cannot signal the grader", "kill with signal 0, a pipe that tells its owner"),
    "limits": ("cannot set other processes' limits", "prlimit, setpriority, sched_setaffinity, sched_setscheduler"),
    "tcp": ("cannot connect by TCP", "a port of the grader's"),
    "udp": ("cannot send by UDP", "a port of the grader's"),
    "unix": ("cannot connect to local sockets", "one that all may use"),
    "abstract": ("cannot connect to abstract local sockets", "one of the grader's"),
    "alone": ("sees no process but its own", "/proc"),
    "user": ("is not root", "its own number"),
}
USABLE = {"scratch", "imports"}  # without these, no answer could run at all
LEVEL_1 = USABLE | {"files", "write", "environment", "memory", "user"}
LEVEL_2 = set(PROMISES) - {"alone"}
LEVEL_3 = set(PROMISES)
MANY = 4000  # threads, more than a limit worth the name lets anybody have


def level(held: Set[str], group: bool = False) -> int | None:
    """The sandbox level of a set of promises that held, or None if no answer could run."""
    if not USABLE <= held:
        return None
    if LEVEL_3 <= held:
        return 4 if group else 3
    return 2 if LEVEL_2 <= held else 1 if LEVEL_1 <= held else 0


def inside(
    canary: str, folder: str, tcp: int, udp: int, unix: str, abstract: str, grader: int, memory: int
) -> dict[str, bool]:
    """Run in the worker: {promise: whether it held}.

    canary: a file of the grader's;  folder: one of the grader's that all may write;  tcp, udp: ports on
    127.0.0.1;  unix, abstract: names of local sockets;  grader: its process number;  memory: the cap.
    """
    tries = {
        "files": Path(canary).read_bytes,
        "write": lambda: Path(folder, "from-inside").write_text("x"),
        "fork": _fork,
        "tcp": lambda: socket.socket(socket.AF_INET).connect(("127.0.0.1", tcp)),
        "udp": lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b"?", ("127.0.0.1", udp)),
        "unix": lambda: socket.socket(socket.AF_UNIX).connect(unix),
        "abstract": lambda: socket.socket(socket.AF_UNIX).connect(b"\0" + abstract.encode()),
        "memory": lambda: len(bytearray(memory + 2**28)),
        "threads": _threads,
    }
    held = {name: _fails(attempt) for name, attempt in tries.items()}
    held["scratch"] = not _fails(_scratch)
    held["imports"] = not _fails(_imports)
    held["environment"] = "LABKIT_PROBE_SECRET" not in os.environ
    held["user"] = not hasattr(os, "geteuid") or os.geteuid() != 0
    held["alone"] = not _fails(lambda: os.listdir("/proc/self")) and _processes() <= 3
    held["signal"] = all(_fails(attempt) for attempt in (lambda: os.kill(grader, 0), lambda: _own(grader)))
    held["limits"] = all(_fails(attempt) for attempt in _limits(grader))
    for attempt in _metadata(canary):  # whether they did anything, the grader sees
        _fails(attempt)
    return held


def _metadata(path):
    """Ways to change a file without writing into it."""
    libc = ctypes.CDLL(None)
    return [
        lambda: os.chmod(path, 0o600),
        lambda: os.utime(path, (1, 1)),
        lambda: os.utime(path),
        lambda: os.setxattr(path, "user.labkit", b"1"),
        lambda: os.chown(path, os.getuid(), os.getgid()),
        lambda: os.truncate(path, 0),
        lambda: libc.chmod(path.encode(), 0o600),
        lambda: libc.syscall(452, -100, path.encode(), 0o600, 0),  # fchmodat2, which Python does not know yet
    ]


def _own(other):
    """Have another process sent a signal when a pipe can be read: one that it ignores."""
    reading, writing = os.pipe()
    try:
        fcntl.fcntl(reading, 10, signal.SIGURG)  # F_SETSIG, which Python has no name for
        fcntl.fcntl(reading, fcntl.F_SETOWN, other)
        fcntl.fcntl(reading, fcntl.F_SETFL, os.O_ASYNC)
        os.write(writing, b"x")
    finally:
        os.close(reading)
        os.close(writing)


def _limits(other):
    """Ways to slow or end another process by its limits; each sets what is so already."""
    if sys.platform != "linux":
        return [lambda: os.setpriority(os.PRIO_PROCESS, other, 0)]
    return [
        lambda: resource.prlimit(other, resource.RLIMIT_CORE, (0, 0)),
        lambda: os.setpriority(os.PRIO_PROCESS, other, os.getpriority(os.PRIO_PROCESS, other)),
        lambda: os.sched_setaffinity(other, os.sched_getaffinity(other)),
        lambda: os.sched_setscheduler(other, os.SCHED_OTHER, os.sched_param(0)),
    ]


def _threads():
    """Start many threads at once; raises if that is not possible."""
    limit = resource.getrlimit(resource.RLIMIT_NPROC)[0]  # of a user: others of theirs may end meanwhile
    if not 0 < limit < MANY:
        return
    over, stack = threading.Event(), threading.stack_size(2**16)
    threads = [threading.Thread(target=over.wait, daemon=True) for _ in range(limit + 1)]
    begun = []
    try:
        for thread in threads:
            thread.start()
            begun.append(thread)
    finally:
        over.set()
        threading.stack_size(stack)
        for thread in begun:
            thread.join()


def _fails(attempt):
    try:
        attempt()
    except (OSError, MemoryError, ImportError, LookupError, RuntimeError):
        return True
    return False


def _fork():
    child = os.fork()
    if child == 0:
        os._exit(0)
    os.waitpid(child, 0)


def _scratch():
    Path("probe.txt").write_text("x")
    os.remove("probe.txt")


def _imports():
    import wave  # noqa: F401 - a module that nothing has imported yet

    import numpy.random  # noqa: F401
    import scipy.linalg  # noqa: F401


def _processes():
    return sum(name.isdigit() for name in os.listdir("/proc")) if sys.platform == "linux" else 99
