"""How a worker process is shut in: the ways there are, and the command that starts one."""

import compileall
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from importlib.util import cache_from_source
from pathlib import Path

from . import account, cgroup
from .process import Process, shortages
from .space import BYTES

SYSTEM = ("/usr", "/lib", "/lib64", "/lib32", "/bin", "/etc/ld.so.cache", "/etc/alternatives")
DEVICES = ("/dev/null", "/dev/zero", "/dev/urandom", "/dev/random")
# Of the instructors' wing a worker needs these; the checks' numbers and the grader itself stay outside.
WORKERS = ("__init__", "calls", "confine", "fill", "probe", "wire", "worker")
INSIDE = ("__init__", *(f"sandbox/{name}" for name in WORKERS))


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

    def start(self, seconds: float) -> Process:
        """A new worker process, with `seconds` of the processor for all that it does."""
        inside = "/tmp" if self.way == "bubblewrap" else ""
        scratch = tempfile.mkdtemp(prefix="work-", dir=os.path.dirname(self.runtime)) if not inside else ""
        root = hasattr(os, "geteuid") and os.geteuid() == 0
        needs = ["py_landlock"] * (self.way == "landlock") + ["pyseccomp"] * self.seccomp
        begin = f"import sys; sys.path.insert(0, {self.runtime!r}); "
        code = begin + f"from labkit.instructor.sandbox.worker import main; main(*{needs})"
        command = [sys.executable, "-I", "-B", "-X", "utf8", "-c", code]
        if self.way == "bubblewrap":
            command = bubblewrap(self.runtime, root) + command
        group = cgroup.make() if self.group else None
        if group:
            command = cgroup.within(group) + command
        before = shortages()
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
        uid = account.user(process.pid) if root else None
        if uid is not None and scratch:
            os.chown(scratch, uid, uid)
        limits = {
            "landlock": self.way == "landlock",
            "seccomp": self.seccomp and self.way != "limits",
            "uid": uid,
            "scratch": inside or scratch,
            "threads": account.threads(self.way, uid),
            "parent": os.getpid() if self.way != "bubblewrap" else None,  # which does that by itself
            "seconds": 2 * int(seconds) + 10,  # a far stop: the grader measures by itself, and says more
            "readable": [*readable(self.runtime), *DEVICES] if self.way == "landlock" else [],
        }
        return Process(process, scratch, limits, group, self.way, before)


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
    command += ["--proc", "/proc", "--size", str(BYTES), "--perms", "1777", "--tmpfs", "/tmp"]
    for device in DEVICES:  # its own /dev would be another place to write to
        command += ["--dev-bind", device, device]
    made = {"/", "/tmp", "/usr", "/etc", "/dev"}
    for path in readable(runtime):
        if os.path.islink(path):
            command += ["--symlink", os.readlink(path), path]
            continue
        for parent in reversed(Path(path).parents):
            if str(parent) not in made:
                command += ["--perms", "0755", "--dir", str(parent)]
                made.add(str(parent))
        command += ["--ro-bind", path, path]
    return command + ["--remount-ro", "/", "--chdir", "/tmp", "--"]


def make_runtime(folder: str | Path) -> str:
    """Copy what a worker imports of this package into `folder`; returns its path.

    Compiled modules come along: with their source's times they stay valid, and only what is missing is compiled.
    """
    kit = Path(__file__).resolve().parents[2]
    target = Path(folder) / "labkit"
    own = [path for path in kit.rglob("*") if path.suffix in (".py", ".toml")]
    files = [path for path in own if kit / "instructor" not in path.parents]
    for path in [*files, *(kit / "instructor" / f"{name}.py" for name in INSIDE)]:
        copy = target / path.relative_to(kit)
        compiled = Path(cache_from_source(path))
        for source, aim in ((path, copy), (compiled, copy.parent / "__pycache__" / compiled.name)):
            if source.exists():
                aim.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, aim)
                shutil.copystat(source, aim)
    compileall.compile_dir(target, quiet=2)  # once, and not in each worker, which may not write here
    for path in (Path(folder), target, *target.rglob("*/")):
        path.chmod(0o755 if path.is_dir() else 0o644)
    return str(folder)
