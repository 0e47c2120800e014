"""Inside the worker, before any of a student's code: give away every right that is not needed."""

import ctypes
import ctypes.util
import importlib
import os
import platform
import resource
import signal
import sys
from collections.abc import Sequence
from types import ModuleType

from . import calls

MEMORY = 2 * 2**30  # bytes of address space, for each process
PR_SET_PDEATHSIG = 1
# What libraries are called with glibc; musl's names are searched for.
LIBRARIES = {"c": "libc.so.6", "seccomp": "libseccomp.so.2"} if platform.libc_ver()[0] == "glibc" else {}


def confine(
    landlock: bool,
    seccomp: bool,
    uid: int | None,
    scratch: str,
    readable: Sequence[str],
    seconds: int,
    threads: int,
    parent: int | None,
) -> None:
    """Limit this process for good; raises if any part that is asked for does not hold.

    landlock, seccomp: whether to use them;  uid: the user to become, or None;  scratch: the one folder
    that can be written;  readable: the folders that can be read (landlock only);  seconds: of CPU;
    threads: of this user, see launch;  parent: the process with which this one ends, or None.
    """
    (py_landlock,) = load("py_landlock") if landlock else [None]  # while they can still be read
    (pyseccomp,) = load("pyseccomp") if seccomp else [None]
    limits = {"AS": MEMORY, "CPU": seconds, "FSIZE": 2**26, "CORE": 0, "NOFILE": 256, "MEMLOCK": 0}
    limits["NPROC"] = threads
    for name, value in limits.items():
        resource.setrlimit(getattr(resource, f"RLIMIT_{name}"), (value, value))
    if uid is not None:
        os.setgroups([])
        os.setresgid(uid, uid, uid)
        os.setresuid(uid, uid, uid)
    if parent is not None:
        _end_with(parent)  # Linux forgets it when the user changes
    if landlock:
        _landlock(py_landlock, scratch, readable)
    if seccomp:
        calls.allow(pyseccomp)


def _end_with(parent):
    """Be killed when the parent ends, by whomever orphans are taken in."""
    if sys.platform == "linux" and ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, int(signal.SIGKILL)):
        raise OSError("this process cannot be tied to its parent")
    if os.getppid() != parent:  # it has ended meanwhile
        os._exit(1)


def _landlock(py_landlock, scratch, readable):
    AccessFs = py_landlock.AccessFs
    rules = py_landlock.Landlock(strict=False)  # without the newest rights on an old kernel; the probe sees what holds
    see = AccessFs.READ_FILE | AccessFs.READ_DIR
    for path in readable:
        if os.path.isdir(path):
            rules.add_path_rule(path, access=see)
        elif os.path.exists(path):
            rules.add_path_rule(path, access=AccessFs.READ_FILE)
    rules.allow_read_write(scratch)
    rules.add_path_rule(scratch, access=AccessFs.REFER)  # files may be moved from one folder in there to another
    rules.apply()


def load(*names: str) -> list[ModuleType | None]:
    """The packages of these names, each None where it does not work: 'py_landlock', 'pyseccomp'."""
    found: list[ModuleType | None] = []
    search = ctypes.util.find_library
    # They look for their libraries with the help of other programs, a compiler among them, in each worker anew.
    ctypes.util.find_library = lambda name: LIBRARIES.get(name) or search(name)
    for name in names:
        try:
            found.append(importlib.import_module(name))
        except Exception:  # not installed, no such library, another system: it does not work, whatever the reason
            found.append(None)
    ctypes.util.find_library = search
    return found


def usable() -> dict[str, bool]:
    """Which of the two packages work here: {'landlock': bool, 'seccomp': bool}."""
    py_landlock, pyseccomp = load("py_landlock", "pyseccomp")
    found = {"landlock": False, "seccomp": False}
    try:
        found["landlock"] = bool(py_landlock and py_landlock.get_abi_version())
        found["seccomp"] = bool(pyseccomp and pyseccomp.SyscallFilter(pyseccomp.ALLOW))
    except Exception:  # the kernel has it not, or does not let us; each package has errors of its own
        pass
    return found
