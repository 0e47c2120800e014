"""A worker process that runs: its pipes, what it keeps in files, how it ended, and how to be rid of it."""

import contextlib
import os
import re
import signal
import subprocess
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from .. import folders
from . import cgroup
from .space import Watch

GONE = 5  # seconds that a process has to be gone after it has closed its pipes


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
    watch: Watch = field(init=False)

    def __post_init__(self) -> None:
        """Begin to look at what it keeps in files."""
        self.watch = Watch(self.process.pid, self.scratch, self._kill)

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
        short = shortages() > self.shortages
        # bwrap tells the worker's own end by its exit status; nobody inside can reach bwrap itself.
        outside = short or self.way == "bubblewrap" and status < 0
        number = -status if status < 0 else status - 128
        if number not in set(signal.Signals):
            return Ending(f"exit status {status}", outside)
        words = "the machine's memory was used up" if short else f"signal {signal.Signals(number).name}"
        return Ending(words, outside, unclear=number == signal.SIGKILL)

    def end(self) -> None:
        """Kill it with all that it started, and remove its traces."""
        self.watch.end()
        self._kill()
        for stream in (self.requests, self.answers):
            with contextlib.suppress(OSError):
                stream.close()
        self.process.wait()
        if self.group:
            cgroup.remove(self.group)
        if self.scratch:
            folders.remove(self.scratch)

    def _kill(self):
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except (ProcessLookupError, PermissionError):
            self.process.kill()


@dataclass(frozen=True)
class Ending:
    """How a worker ended: in words;  outside: that nothing inside it can have done that;  unclear: nor the opposite."""

    words: str
    outside: bool
    unclear: bool = False


def shortages() -> int:
    """How often this machine has ended a process for want of memory; 0 where it does not tell."""
    try:
        told = re.search(r"^oom_kill (\d+)$", Path("/proc/vmstat").read_text(), re.MULTILINE)
    except OSError:
        return 0
    return int(told[1]) if told else 0
