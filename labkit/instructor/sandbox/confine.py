"""Inside the worker, before any of a student's code: give away every right that is not needed."""

import ctypes.util
import errno
import importlib
import os
import resource
from collections.abc import Sequence
from types import ModuleType

MEMORY = 2 * 2**30  # bytes of address space, for each process

# What no student's answer needs, and an escape may: processes, sockets (also the local ones that
# landlock leaves open), other processes' memory, namespaces, what outlives a process, the terminal.
FORBIDDEN = [
    "fork",
    "vfork",
    "execve",
    "execveat",
    "kill",
    "pidfd_send_signal",
    "pidfd_open",
    "pidfd_getfd",
    "rt_sigqueueinfo",
    "rt_tgsigqueueinfo",
    "socket",
    "socketpair",
    "connect",
    "bind",
    "listen",
    "accept",
    "accept4",
    "ptrace",
    "process_vm_readv",
    "process_vm_writev",
    "process_madvise",
    "kcmp",
    "mount",
    "umount2",
    "pivot_root",
    "chroot",
    "setns",
    "unshare",
    "move_mount",
    "fsopen",
    "fsconfig",
    "fsmount",
    "open_tree",
    "mount_setattr",
    "open_by_handle_at",
    "name_to_handle_at",
    "bpf",
    "perf_event_open",
    "userfaultfd",
    "io_uring_setup",
    "io_uring_enter",
    "io_uring_register",
    "keyctl",
    "add_key",
    "request_key",
    "init_module",
    "finit_module",
    "delete_module",
    "kexec_load",
    "kexec_file_load",
    "reboot",
    "swapon",
    "swapoff",
    "sethostname",
    "setdomainname",
    "settimeofday",
    "clock_settime",
    "clock_adjtime",
    "adjtimex",
    "shmget",
    "shmat",
    "shmctl",
    "msgget",
    "msgsnd",
    "msgrcv",
    "semget",
    "semop",
    "semtimedop",
    "mq_open",
    "memfd_create",
    "memfd_secret",
    "setsid",
    "setpgid",
    "setpriority",
    "sched_setscheduler",
    "sched_setaffinity",
    "ioprio_set",
    "personality",
    "acct",
    "quotactl",
    "syslog",
    "fanotify_init",
    "inotify_init",
    "inotify_init1",
    "vhangup",
    "nfsservctl",
    "lookup_dcookie",
    "modify_ldt",
    "iopl",
    "ioperm",
]
CLONE_THREAD = 0x00010000
TIOCSTI, TIOCLINUX = 0x5412, 0x541C


def confine(
    landlock: bool, seccomp: bool, uid: int | None, scratch: str, readable: Sequence[str], seconds: int
) -> None:
    """Limit this process for good; raises if any part that is asked for does not hold.

    landlock, seccomp: whether to use them;  uid: the user to become, or None;  scratch: the one folder
    that can be written;  readable: the folders that can be read (landlock only);  seconds: of CPU.
    """
    (py_landlock,) = load("py_landlock") if landlock else [None]  # while they can still be read
    (pyseccomp,) = load("pyseccomp") if seccomp else [None]
    limits = {"AS": MEMORY, "CPU": seconds, "FSIZE": 2**26, "CORE": 0, "NOFILE": 256, "MEMLOCK": 0}
    if uid is not None:
        limits["NPROC"] = 512  # this user's, over all workers
    for name, value in limits.items():
        resource.setrlimit(getattr(resource, f"RLIMIT_{name}"), (value, value))
    if uid is not None:
        os.setgroups([])
        os.setresgid(uid, uid, uid)
        os.setresuid(uid, uid, uid)
    if landlock:
        _landlock(py_landlock, scratch, readable)
    if seccomp:
        _seccomp(pyseccomp)


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
    rules.apply()


def load(*names: str) -> list[ModuleType | None]:
    """The packages of these names, each None where it does not work: 'py_landlock', 'pyseccomp'."""
    found: list[ModuleType | None] = []
    search = ctypes.util.find_library
    # pyseccomp looks for its library with the help of other programs, which takes longer than all the rest.
    ctypes.util.find_library = lambda name: f"lib{name}.so.2" if name == "seccomp" else search(name)
    for name in names:
        try:
            found.append(importlib.import_module(name))
        except Exception:  # not installed, no such library, another system: it does not work, whatever the reason
            found.append(None)
    ctypes.util.find_library = search
    return found


def _seccomp(pyseccomp):
    rules = pyseccomp.SyscallFilter(pyseccomp.ALLOW)
    for name in FORBIDDEN:
        try:
            rules.add_rule(pyseccomp.ERRNO(errno.EPERM), name)
        except (OSError, ValueError):  # unknown to this library or machine
            continue
    # A new thread is fine, a new process is not; libraries fall back from clone3, whose flags a filter
    # cannot see, to clone.
    rules.add_rule(pyseccomp.ERRNO(errno.ENOSYS), "clone3")
    rules.add_rule(pyseccomp.ERRNO(errno.EPERM), "clone", pyseccomp.Arg(0, pyseccomp.MASKED_EQ, CLONE_THREAD, 0))
    for request in (TIOCSTI, TIOCLINUX):
        rules.add_rule(
            pyseccomp.ERRNO(errno.EPERM), "ioctl", pyseccomp.Arg(1, pyseccomp.MASKED_EQ, 0xFFFFFFFF, request)
        )
    rules.load()


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
