"""What really holds: a worker tries to break out of each sandbox before any student's code does."""

import os
import socket
import sys
from collections.abc import Set
from pathlib import Path

PROMISES = {
    "files": "cannot read files outside its sandbox",
    "write": "cannot write outside its scratch folder",
    "scratch": "can write in its scratch folder",
    "imports": "can import what students use",
    "environment": "sees no environment variables of the grader",
    "memory": "is stopped at its memory cap",
    "fork": "cannot start processes",
    "signal": "cannot signal the grader",
    "tcp": "cannot connect by TCP",
    "udp": "cannot send by UDP",
    "unix": "cannot connect to local sockets",
    "abstract": "cannot connect to abstract local sockets",
    "alone": "sees no process but its own",
    "user": "is not root",
}
USABLE = {"scratch", "imports"}  # without these, no answer could run at all
LEVEL_1 = USABLE | {"files", "write", "environment", "memory", "user"}
LEVEL_2 = set(PROMISES) - {"alone"}
LEVEL_3 = set(PROMISES)


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
        "signal": lambda: os.kill(grader, 0),
        "tcp": lambda: socket.socket(socket.AF_INET).connect(("127.0.0.1", tcp)),
        "udp": lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b"?", ("127.0.0.1", udp)),
        "unix": lambda: socket.socket(socket.AF_UNIX).connect(unix),
        "abstract": lambda: socket.socket(socket.AF_UNIX).connect(b"\0" + abstract.encode()),
        "memory": lambda: len(bytearray(memory + 2**28)),
    }
    held = {name: _fails(attempt) for name, attempt in tries.items()}
    held["scratch"] = not _fails(_scratch)
    held["imports"] = not _fails(_imports)
    held["environment"] = "LABKIT_PROBE_SECRET" not in os.environ
    held["user"] = not hasattr(os, "geteuid") or os.geteuid() != 0
    held["alone"] = not _fails(lambda: os.listdir("/proc/self")) and _processes() <= 3
    return held


def _fails(attempt):
    try:
        attempt()
    except (OSError, MemoryError, ImportError, LookupError):
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
