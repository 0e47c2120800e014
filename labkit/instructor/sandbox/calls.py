"""Which system calls a student's code may make: those that compute, and use files that are open to it anyway.

Whatever is not named here does not exist for it, calls that are not invented yet included: it is answered as an old
kernel would (ENOSYS), so that the C library (glibc or musl, on 64 bits) falls back to an older call, as from
clone3 to clone. What is left out acts on other processes, sends, mounts, outlives the process or waits for others.
"""

import errno
import os
from typing import Any

ALLOWED = {
    "memory": """
        brk mmap munmap mprotect mremap madvise msync mincore get_mempolicy membarrier pkey_alloc pkey_free
        pkey_mprotect map_shadow_stack mseal
    """,
    "threads": """
        futex futex_wait futex_wake futex_requeue futex_waitv set_robust_list rseq set_tid_address gettid
        sched_yield exit exit_group restart_syscall arch_prctl sched_getaffinity sched_getparam
        sched_getscheduler sched_get_priority_max sched_get_priority_min sched_rr_get_interval getcpu
        getpriority
    """,
    "signals of its own": """
        rt_sigaction rt_sigprocmask rt_sigreturn rt_sigpending rt_sigsuspend rt_sigtimedwait sigaltstack
        signalfd signalfd4 pause wait4 waitid
    """,
    "time": """
        clock_gettime clock_getres clock_nanosleep nanosleep gettimeofday time times getitimer setitimer alarm
        timer_create timer_settime timer_gettime timer_getoverrun timer_delete timerfd_create timerfd_settime
        timerfd_gettime
    """,
    "who it is": """
        getpid getppid getpgrp getpgid getsid getuid geteuid getgid getegid getresuid getresgid getgroups capget
        uname sysinfo getrusage getrlimit umask getrandom
    """,
    "open files": """
        read write readv writev pread64 pwrite64 preadv pwritev preadv2 pwritev2 lseek close close_range dup
        dup2 dup3 fsync fdatasync ftruncate fadvise64 readahead flock sendfile copy_file_range pipe pipe2 poll
        ppoll select pselect6 epoll_create epoll_create1 epoll_ctl epoll_wait epoll_pwait epoll_pwait2 eventfd
        eventfd2
    """,
    "files": """
        open openat openat2 creat stat fstat lstat newfstatat statx statfs fstatfs access faccessat faccessat2
        getdents getdents64 readlink readlinkat getcwd chdir fchdir truncate rename renameat renameat2 mkdir
        mkdirat rmdir unlink unlinkat link linkat symlink symlinkat
    """,
}
# Copying a file sets its rights and times too: that is done only in appearance, and nobody else's file changes.
IN_APPEARANCE = "chmod fchmod fchmodat fchmodat2 utime utimes futimesat utimensat"
# No file has further attributes here, as on some file systems, which those who copy files know.
NO_ATTRIBUTES = """
    getxattr lgetxattr fgetxattr listxattr llistxattr flistxattr setxattr lsetxattr fsetxattr removexattr
    lremovexattr fremovexattr
"""

CLONE_THREAD = 0x00010000
# {a call with many meanings: (which argument tells them apart, the ones that are allowed)}
MEANINGS = {
    # duplicate, flags, locks, a pipe's size as it is; not F_SETOWN and F_SETSIG, which send signals to others
    "fcntl": (1, [0, 1, 2, 3, 4, 5, 6, 7, 36, 37, 38, 1027, 1030, 1032]),
    # is it a terminal, how large, how much can be read, close it in children, do not wait; nothing is typed or set
    "ioctl": (1, [0x5401, 0x802C542A, 0x5413, 0x541B, 0x5450, 0x5451, 0x5421]),
    # a thread's name, a memory area's name; not whether it ends with its parent
    "prctl": (0, [15, 16, 0x53564D41]),
}


def allow(pyseccomp: Any) -> None:
    """Close all other calls to this process, for good; pyseccomp: the package. Raises OSError if it cannot."""
    rules = pyseccomp.SyscallFilter(pyseccomp.ERRNO(errno.ENOSYS))

    def add(action, name, *arguments):
        try:
            rules.add_rule(action, name, *arguments)
        except (OSError, ValueError):  # this library does not know the call, or this machine has it not
            return

    def same(argument, value, bits=0xFFFFFFFF):
        return pyseccomp.Arg(argument, pyseccomp.MASKED_EQ, bits, value)

    for name in " ".join(ALLOWED.values()).split():
        add(pyseccomp.ALLOW, name)
    for name in IN_APPEARANCE.split():
        add(pyseccomp.ERRNO(0), name)
    for name in NO_ATTRIBUTES.split():
        add(pyseccomp.ERRNO(errno.EOPNOTSUPP), name)
    for name, (argument, values) in MEANINGS.items():
        for value in values:
            add(pyseccomp.ALLOW, name, same(argument, value))
    # A new thread is fine, a new process is not.
    add(pyseccomp.ALLOW, "clone", same(0, CLONE_THREAD, CLONE_THREAD))
    for own in (0, os.getpid()):  # its own limits can be read
        add(pyseccomp.ALLOW, "prlimit64", same(0, own), pyseccomp.Arg(2, pyseccomp.EQ, 0))
    for name in ("kill", "tgkill", "tkill"):  # abort() is a signal to itself
        add(pyseccomp.ALLOW, name, same(0, os.getpid()))
    rules.load()
