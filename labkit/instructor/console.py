"""What a person sees while a class is graded."""

import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from . import records
from .report import texts


class Progress:
    """A line for each student, and on a terminal a bar with the time that is left."""

    def __init__(self, total: int) -> None:
        self.total, self.done, self.start = total, 0, time.monotonic()
        self.bar = sys.stderr.isatty()
        self._draw()

    def tell(self, result: records.Result) -> None:
        """Print the line of one student, who is graded."""
        self.done += 1
        if self.bar:
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()
        said = f"{texts.plain(result.points)} of {texts.plain(result.max_points)}"
        waiting = f", {result.open} to be read" if result.open else ""
        blank = f", {result.blank} without an answer" if result.blank else ""
        errors = sum(mark.status == records.ERROR for mark in result.marks)
        trouble = f", {errors} checks could not be run" if errors else ""
        print(f"{texts.clean(result.student)}: {said}{waiting}{blank}{trouble}", flush=True)
        self._draw()

    def _draw(self):
        if not self.bar:
            return
        filled = round(24 * self.done / self.total)
        spent = time.monotonic() - self.start
        left = spent / self.done * (self.total - self.done) if self.done else None
        text = f"{int(left) // 60}:{int(left) % 60:02d} left" if left is not None else "starting"
        sys.stderr.write(f"\r\x1b[K[{'#' * filled}{'-' * (24 - filled)}] {self.done} of {self.total}, {text}")
        sys.stderr.flush()

    def end(self) -> None:
        """Take the bar away."""
        if self.bar:
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()


@contextmanager
def stoppable() -> Iterator[None]:
    """Let whoever ends this program, or closes its terminal, do the same as Ctrl-C: nothing is left behind then."""
    before = {}
    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)  # not every system has both
        if number and signal.getsignal(number) is signal.SIG_DFL:  # under nohup it is ignored
            before[number] = signal.signal(number, signal.default_int_handler)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
