"""The pipe to one worker process: ask with data, wait no longer than allowed, believe nothing."""

import os
import selectors
import time
from typing import Any

from ...checks.feedback import STOPPED, FilterError
from ...notebook.usage import LOOK, Deadline, Usage
from . import wire
from .forms import ODD, RAISED, Form, fields, flag
from .launch import Sandbox
from .space import BYTES, FILES

START = 30  # seconds of the processor for a worker to be there
ENDED = "leave out exit() and the like, and look for a list that never stops growing."
FULL = f"Your code kept more than {BYTES >> 20} MB or {FILES} files: leave out what it writes into files."
TINY, PAUSE = 4096, 0.001  # bytes: for more, one waits so many seconds, lest an answer come byte by byte
SPOILT = "What came back from your code is no answer to what was asked, so this check was lost."


class NotGradedError(Exception):
    """The machine or the grader ended a worker: nobody's mark. The text says how."""


class WorkerLostError(FilterError):
    """The worker gave no answer: it ended, hung or talked nonsense. The text says so to the student.

    stopped: whether that was because its time was up;  killed: whether it may have been somebody else who ended it.
    """

    def __init__(self, text: str, stopped: bool = False, killed: bool = False) -> None:
        super().__init__(text)
        self.stopped, self.killed = stopped, killed


class StudentCodeError(FilterError):
    """The student's code raised: kind is the exception's type, place (cell label, line) or None."""

    public = False  # whether its text may be shown: what raised had seen nothing secret

    def __init__(self, kind: str, place: tuple[str, int] | None, text: str, stopped: bool = False) -> None:
        super().__init__(text)
        self.kind, self.place, self.stopped = kind, place, stopped


class Channel:
    """One worker process and its pipes; seconds: how much of the processor it may use in all."""

    def __init__(self, sandbox: Sandbox, seconds: float) -> None:
        self.worker = sandbox.start(seconds)
        self.usage = Usage(self.worker.process.pid)
        self.ready = False
        self.armed = False  # whether any of a student's code is in it
        for stream in (self.worker.requests, self.worker.answers):
            os.set_blocking(stream.fileno(), False)

    def settle(self) -> None:
        """Wait until it has confined itself. Raises NotGradedError."""
        if not self.ready:
            self.ask({"do": "confine", **self.worker.limits}, START, fields(ready=flag))
            self.armed = True  # what it is asked from now on runs a student's code
            self.usage = Usage(self.worker.process.pid)  # what shuts it in has started it by now
            self.ready = True

    def ask(self, request: dict[str, Any], seconds: float, form: Form) -> dict[str, Any]:
        """The answer to a request, for which the worker may compute or sleep so many seconds, in its form.

        Raises StudentCodeError; or WorkerLostError or NotGradedError: then the worker is no use any more.
        """
        try:
            return self._answer(request, seconds, form)
        except FilterError as error:
            if self.armed:
                raise
            raise NotGradedError(f"a worker did not start: {error}") from None

    def _answer(self, request, seconds, form):
        limit = Deadline(self.usage, seconds)
        self._send(wire.pack({**request, "allowed": seconds}, objects=True), limit)
        try:
            text, raw = wire.sizes(self._receive(8, limit))
            body = self._receive(text + raw, limit)
            return understood(body[:text], body[text:], form)
        except wire.FrameError:
            raise WorkerLostError(SPOILT) from None

    def _send(self, data, limit):
        stream = self.worker.requests
        view = memoryview(data)
        while view:
            self._wait(stream, selectors.EVENT_WRITE, limit)
            try:
                view = view[os.write(stream.fileno(), view) :]
            except BlockingIOError:
                continue
            except OSError:
                raise self._gone() from None

    def _receive(self, count, limit):
        stream, came, filled = self.worker.answers, bytearray(count), 0
        while filled < count:
            self._wait(stream, selectors.EVENT_READ, limit)
            try:
                part = os.readv(stream.fileno(), [memoryview(came)[filled:]])
            except BlockingIOError:
                continue
            except OSError:
                part = 0
            if not part:
                raise self._gone()
            filled += part
            if part < TINY and filled < count:
                time.sleep(PAUSE)
        return bytes(came)

    def _wait(self, stream, event, limit):
        with selectors.DefaultSelector() as selector:
            selector.register(stream, event)
            while not selector.select(LOOK):
                # What it had started may hold its pipes open: bwrap's inner half, where the outer one was killed early.
                if self.worker.process.poll() is not None and not selector.select(0):
                    raise self._gone()
                if limit.over():
                    raise WorkerLostError(STOPPED, stopped=True)

    def _gone(self):
        """What to raise for a worker that has closed its pipes."""
        if self.worker.watch.full:
            return WorkerLostError(FULL)
        how = self.worker.ended()
        if how is None:
            return WorkerLostError(SPOILT)
        if how.outside or not self.armed:
            return NotGradedError(f"the system ended a worker ({how.words})")
        return WorkerLostError(f"Your code ended Python itself ({how.words}): {ENDED}", killed=how.unclear)

    def end(self) -> None:
        """Be rid of the worker."""
        self.worker.end()


def understood(text: bytes, raw: bytes, form: Form) -> dict[str, Any]:
    """The answer in a frame's two parts. Raises StudentCodeError if it tells of one, FrameError for another form."""
    answer = wire.unpack(text, raw)
    fields_of = answer if isinstance(answer, dict) else {}
    if "odd" in fields_of:
        raise StudentCodeError("TypeError", None, f"What came back is no number and no array: {ODD(answer)['odd']}.")
    if "raised" in fields_of:
        error = RAISED(answer)
        place = error["place"] and tuple(error["place"])
        raise StudentCodeError(error["raised"], place, error["text"], error["stopped"])
    return form(answer)
