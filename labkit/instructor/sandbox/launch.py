"""How a worker process is shut in: the ways there are, and the command that starts one."""

import compileall
import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from . import cgroup

GONE = 5  # seconds that a process has to be gone after it has closed its pipes
NOBODY = 65534  # the user that root's workers become
SYSTEM = ("/usr", "/lib", "/lib64", "/lib32", "/bin", "/etc/ld.so.cache", "/etc/alternatives")
DEVICES = ("/dev/null", "/dev/zero", "/dev/urandom", "/dev/random")
# Of the instructors' wing a worker needs these; the checks' numbers and the grader itself stay outside.
INSIDE = ("__init__", "sandbox/__init__", "sandbox/worker", "sandbox/wire", "sandbox/confine", "sandbox/probe")


@dataclass(frozen=True)
class Sandbox:
    """One way to shut a worker in.

    way: 'bubblewrap', 'landlock' or 'limits' (nothing but resource limits);  level: what the probe found;
    runtime: folder with the modules that the worker imports;  group: whether it gets a cgroup of its own.
    """

    way: str
    runtime: str
    level: int = 0
    group: bool = False
    seccomp: bool = True

    def start(self, seconds: float) -> "Process":
        """A new worker process, with `seconds` of the processor for all that it does."""
        inside = "/tmp" if self.way == "bubblewrap" else ""
        scratch = tempfile.mkdtemp(prefix="labkit-work-") if not inside else ""
        uid = NOBODY if hasattr(os, "geteuid") and os.geteuid() == 0 else None
        if uid is not None and scratch:
            os.chown(scratch, uid, uid)
        needs = ["py_landlock"] * (self.way == "landlock") + ["pyseccomp"] * self.seccomp
        begin = f"import sys; sys.path.insert(0, {self.runtime!r}); "
        code = begin + f"from labkit.instructor.sandbox.worker import main; main(*{needs})"
        command = [sys.executable, "-I", "-B", "-X", "utf8", "-c", code]
        if self.way == "bubblewrap":
            command = bubblewrap(self.runtime, uid is not None) + command
        group = cgroup.make() if self.group else None
        if group:
            command = cgroup.within(group) + command
        shortages = _shortages()
        process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=environment(inside or scratch),
            cwd="/",
            start_new_session=True,
            bufsize=0,
        )
        limits = {
            "landlock": self.way == "landlock",
            "seccomp": self.seccomp and self.way != "limits",
            "uid": uid,
            "scratch": inside or scratch,
            "seconds": 2 * int(seconds) + 10,  # a far stop: the grader measures by itself, and says more
            "readable": [*readable(self.runtime), *DEVICES] if self.way == "landlock" else [],
        }
        return Process(process, scratch, limits, group, self.way, shortages)


@dataclass
class Process:
    """A worker that runs: its pipes, and how to be rid of it.

    limits: what `confine` is told in it;  group: the folder of its cgroup, or None.
    """

    process: subprocess.Popen
    scratch: str
    limits: dict[str, Any]
    group: str | None = None
    way: str = ""
    shortages: int = 0  # of the machine's memory, before it

    @property
    def requests(self) -> IO[bytes]:
        """Where frames go in."""
        assert self.process.stdin is not None
        return self.process.stdin

    @property
    def answers(self) -> IO[bytes]:
        """Where frames come out."""
        assert self.process.stdout is not None
        return self.process.stdout

    def ended(self) -> "Ending | None":
        """How it ended by itself, or None if it did not."""
        try:
            status = self.process.wait(GONE)
        except subprocess.TimeoutExpired:
            return None
        short = _shortages() > self.shortages
        # bwrap tells the worker's own end by its exit status; nobody inside can reach bwrap itself.
        outside = short or self.way == "bubblewrap" and status < 0
        number = -status if status < 0 else status - 128
        if number not in set(signal.Signals):
            return Ending(f"exit status {status}", outside)
        words = "the machine's memory was used up" if short else f"signal {signal.Signals(number).name}"
        return Ending(words, outside, unclear=number == signal.SIGKILL)

    def end(self) -> None:
        """Kill it with all that it started, and remove its traces."""
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except (ProcessLookupError, PermissionError):
            self.process.kill()
        for stream in (self.requests, self.answers):
            with contextlib.suppress(OSError):
                stream.close()
        self.process.wait()
        if self.group:
            cgroup.remove(self.group)
        if self.scratch:
            shutil.rmtree(self.scratch, ignore_errors=True)


@dataclass(frozen=True)
class Ending:
    """How a worker ended: in words;  outside: that nothing inside it can have done that;  unclear: nor the opposite."""

    words: str
    outside: bool
    unclear: bool = False


def _shortages():
    """How often this machine has ended a process for want of memory; 0 where it does not tell."""
    try:
        told = re.search(r"^oom_kill (\d+)$", Path("/proc/vmstat").read_text(), re.MULTILINE)
    except OSError:
        return 0
    return int(told[1]) if told else 0


def environment(home: str) -> dict[str, str]:
    """All that a worker sees of the environment; home: the folder that it may write to."""
    # More threads than one would stay outside the limits that a thread sets itself.
    one = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    folders = dict.fromkeys(("HOME", "TMPDIR", "MPLCONFIGDIR"), home)
    return {"PATH": "/usr/bin:/bin", "LANG": "C.UTF-8", "MPLBACKEND": "Agg", **folders, **one}


def readable(runtime: str) -> list[str]:
    """Folders that Python and the student's imports need, each once and without its own subfolders."""
    wanted = [*SYSTEM, sys.prefix, sys.base_prefix, os.path.realpath(sys.base_prefix), runtime]
    wanted += [os.path.dirname(os.path.realpath(sys.executable))]
    found: list[str] = []
    for path in sorted(set(map(os.path.abspath, wanted)), key=len):
        if os.path.exists(path) and not any(path.startswith(f"{top}/") for top in found):
            found.append(path)
    return found


def bubblewrap(runtime: str, root: bool) -> list[str]:
    """The start of a command line that runs the rest of it with its own namespaces and nothing to write."""
    command = [shutil.which("bwrap") or "bwrap", "--die-with-parent", "--new-session", "--unshare-net"]
    command += ["--unshare-pid", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try", "--cap-drop", "ALL"]
    # Only root can open its own home folder, where Python may be: it binds first and drops itself later.
    command += ["--cap-add", "CAP_SETUID", "--cap-add", "CAP_SETGID"] if root else ["--unshare-user"]
    command += ["--proc", "/proc", "--dev", "/dev", "--size", str(2**26), "--perms", "1777", "--tmpfs", "/tmp"]
    made = {"/", "/tmp", "/usr", "/etc"}
    for path in readable(runtime):
        if os.path.islink(path):
            command += ["--symlink", os.readlink(path), path]
            continue
        for parent in reversed(Path(path).parents):
            if str(parent) not in made:
                command += ["--perms", "0755", "--dir", str(parent)]
                made.add(str(parent))
        command += ["--ro-bind", path, path]
    return command + ["--chdir", "/tmp", "--"]


def make_runtime(folder: str | Path) -> str:
    """Copy what a worker imports of this package into `folder`; returns its path."""
    kit = Path(__file__).resolve().parents[2]
    target = Path(folder) / "labkit"
    own = [path for path in kit.rglob("*") if path.suffix in (".py", ".toml")]
    files = [path for path in own if kit / "instructor" not in path.parents]
    for path in [*files, *(kit / "instructor" / f"{name}.py" for name in INSIDE)]:
        copy = target / path.relative_to(kit)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, copy)
    compileall.compile_dir(target, quiet=2)  # once, and not in each worker, which may not write here
    for path in (Path(folder), target, *target.rglob("*/")):
        path.chmod(0o755 if path.is_dir() else 0o644)
    return str(folder)
