"""Find out which sandboxes this machine has, by trying to break out of each."""

import os
import shutil
import socket
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from .. import folders
from . import cgroup, fill, probe
from .channel import Channel, WorkerLostError
from .confine import MEMORY, usable
from .forms import fields, flag, table, whole
from .launch import Sandbox
from .space import BYTES, FILES

WORDS = {
    4: "no network, no files, one memory cap for all that a submission starts",
    3: "no network, no files; the memory cap is per process",
    2: "no network, no files; sees that other processes exist, and scratch space is on the disk",
    1: "files are closed, but some ways out are open",
    0: "nothing but resource limits: students' code could read and change your files",
}


@dataclass(frozen=True)
class Found:
    """What the probe found of one way: its sandbox with the level that it earned, or why there is none."""

    way: str
    sandbox: Sandbox | None
    held: frozenset[str] = frozenset()
    why: str = ""


def find(runtime: str) -> Iterator[Found]:
    """A Found for each way, the best first, tried when it is asked for. runtime: see launch.make_runtime."""
    can = usable()
    ways: list[tuple[str, Sandbox | None, str]] = []
    if shutil.which("bwrap"):
        if cgroup.parent():
            ways.append(("bubblewrap + cgroup", Sandbox("bubblewrap", runtime, group=True, seccomp=can["seccomp"]), ""))
        ways.append(("bubblewrap", Sandbox("bubblewrap", runtime, seccomp=can["seccomp"]), ""))
    else:
        ways.append(("bubblewrap", None, "the program bwrap is not installed"))
    if can["landlock"]:
        ways.append(("landlock", Sandbox("landlock", runtime, seccomp=can["seccomp"]), ""))
    else:
        ways.append(("landlock", None, "this kernel or its Python package landlock is missing"))
    ways.append(("limits only", Sandbox("limits", runtime), ""))
    yield from (_found(name, sandbox, why) for name, sandbox, why in ways)


def _found(name, sandbox, why):
    if not sandbox:
        return Found(name, None, why=why)
    try:
        held = try_out(sandbox)
    except Exception as error:  # a sandbox that cannot even start is none, whatever the reason
        return Found(name, None, why=f"it does not start ({str(error).splitlines()[0][:120]})")
    level = probe.level(held, sandbox.group)
    if level is None:
        broken = ", ".join(sorted(probe.USABLE - held))
        return Found(name, None, held, why=_unusable(broken))
    return Found(name, replace(sandbox, level=level), held)


def _unusable(broken):
    closed = [path for path in (sys.base_prefix, sys.prefix) if not _open_to_all(path)]
    if hasattr(os, "geteuid") and os.geteuid() == 0 and closed:
        return f"Python is in {closed[0]}, which only root can open"
    return f"answers could not run in it ({broken})"


def _open_to_all(path):
    return all(os.stat(p).st_mode & 0o005 == 0o005 for p in [Path(path), *Path(path).parents])


def try_out(sandbox: Sandbox) -> frozenset[str]:
    """The promises of probe.PROMISES that this sandbox keeps."""
    with _targets() as targets, _secret(), _trial(sandbox) as ask:
        canary, before = targets["canary"], _about(targets["canary"])
        answer = ask({"do": "probe", **targets}, table(flag, probe.PROMISES)) or {}
        held = {name for name in probe.PROMISES if answer.get(name) is True}
        if os.path.exists(os.path.join(targets["folder"], "from-inside")):
            held.discard("write")
        if _about(canary) == before:
            held.add("metadata")
        for name, what, most in (("space", "bytes", BYTES), ("count", "files", FILES)):
            request = {"do": "fill", "what": what, "places": fill.around(), "most": 2 * most}
            kept = ask(request, fields(kept=whole))
            if kept is None or kept["kept"] <= most:
                held.add(name)
    return frozenset(held)


@contextmanager
def _trial(sandbox):
    """A function of requests and forms: what a worker answers, or None if it was stopped since it kept too much.

    After that a new worker is asked; each costs time before anything is graded.
    """
    channels: list[Channel] = []

    def ask(request, form):
        if not channels or channels[-1].worker.watch.full:
            channels.append(Channel(sandbox, 60))
        channel = channels[-1]
        try:
            channel.settle()
            answer = channel.ask(request, 30, form)
            return None if channel.worker.watch.look() else answer
        except WorkerLostError:
            if not channel.worker.watch.full:
                raise
            return None

    try:
        yield ask
    finally:
        for channel in channels:
            channel.end()


def _about(path):
    """What can be changed of a file without writing into it."""
    about = os.stat(path)
    more = os.listxattr(path) if hasattr(os, "listxattr") else []
    return about.st_mode, about.st_uid, about.st_gid, about.st_size, about.st_mtime_ns, more


@contextmanager
def _secret():
    os.environ["LABKIT_PROBE_SECRET"] = "1"
    try:
        yield
    finally:
        del os.environ["LABKIT_PROBE_SECRET"]


@contextmanager
def _targets():
    """Things of the grader's that a worker should not reach."""
    with ExitStack() as stack:
        folder = stack.enter_context(folders.temporary("probe", short=True))
        os.chmod(folder, 0o777)
        canary = Path(folder, "canary")
        canary.write_text("not for students")
        canary.chmod(0o644)

        def listening(family, kind, address):
            sock = stack.enter_context(socket.socket(family, kind))
            sock.bind(address)
            if kind == socket.SOCK_STREAM:
                sock.listen()
            return sock

        tcp = listening(socket.AF_INET, socket.SOCK_STREAM, ("127.0.0.1", 0)).getsockname()[1]
        udp = listening(socket.AF_INET, socket.SOCK_DGRAM, ("127.0.0.1", 0)).getsockname()[1]
        unix, abstract = os.path.join(folder, "socket"), f"labkit-{os.getpid()}"
        if hasattr(socket, "AF_UNIX"):
            listening(socket.AF_UNIX, socket.SOCK_STREAM, unix)
            os.chmod(unix, 0o777)
            if os.path.isdir("/proc"):  # abstract names are Linux's own
                listening(socket.AF_UNIX, socket.SOCK_STREAM, b"\0" + abstract.encode())
        yield {
            "canary": str(canary),
            "folder": folder,
            "tcp": tcp,
            "udp": udp,
            "unix": unix,
            "abstract": abstract,
            "grader": os.getpid(),
            "memory": MEMORY,
        }
