"""The pipe to one worker process: ask with data, wait no longer than allowed, believe nothing."""

import os
import selectors
from typing import Any

from ...checks.feedback import STOPPED, FilterError
from ...notebook.usage import LOOK, Deadline, Usage
from . import wire
from .launch import Sandbox

START = 30  # seconds of the processor for a worker to be there
SPOILT = "Your code wrote into the grader's own channel, so its answer was lost."


class WorkerLostError(FilterError):
    """The worker gave no answer: it ended, hung or talked nonsense. The text says so to the student.

    stopped: whether that was because its time was up.
    """

    def __init__(self, text: str, stopped: bool = False) -> None:
        super().__init__(text)
        self.stopped = stopped


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
        for stream in (self.worker.requests, self.worker.answers):
            os.set_blocking(stream.fileno(), False)

    def settle(self) -> None:
        """Wait until it has confined itself. Raises WorkerLostError."""
        if not self.ready:
            self.ask({"do": "confine", **self.worker.limits}, START)
            self.usage = Usage(self.worker.process.pid)  # what shuts it in has started it by now
            self.ready = True

    def ask(self, request: dict[str, Any], seconds: float) -> dict[str, Any]:
        """The answer to a request, for which the worker may compute or sleep so many seconds.

        Raises StudentCodeError, or WorkerLostError: then the worker is no use any more.
        """
        limit = Deadline(self.usage, seconds)
        self._send(wire.pack({**request, "allowed": seconds}, objects=True), limit)
        try:
            head = self._receive(8, limit)
            text, raw = wire.sizes(head)
            body = self._receive(text + raw, limit)
            answer = wire.unpack(body[:text], body[text:])
        except wire.FrameError:
            raise WorkerLostError(SPOILT) from None
        if not isinstance(answer, dict):
            raise WorkerLostError(SPOILT)
        if "odd" in answer:
            raise StudentCodeError("TypeError", None, f"What came back is no number and no array: {answer['odd']}.")
        if "raised" in answer:
            raise StudentCodeError(*_failure(answer))
        return answer

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
                raise WorkerLostError(self._gone()) from None

    def _receive(self, count, limit):
        stream, parts = self.worker.answers, []
        while count:
            self._wait(stream, selectors.EVENT_READ, limit)
            try:
                part = os.read(stream.fileno(), min(count, 1 << 20))
            except BlockingIOError:
                continue
            except OSError:
                part = b""
            if not part:
                raise WorkerLostError(self._gone())
            parts.append(part)
            count -= len(part)
        return b"".join(parts)

    def _wait(self, stream, event, limit):
        with selectors.DefaultSelector() as selector:
            selector.register(stream, event)
            while not selector.select(LOOK):
                if limit.over():
                    raise WorkerLostError(STOPPED, stopped=True)

    def _gone(self):
        return (
            "Your code ended Python itself, or used more memory or time than there is: "
            "leave out exit() and the like, and look for a list that never stops growing."
        )

    def end(self) -> None:
        """Be rid of the worker."""
        self.worker.end()


def _failure(answer):
    kind, place, text = (answer.get(key) for key in ("raised", "place", "text"))
    sound = isinstance(place, list) and len(place) == 2 and isinstance(place[0], str) and type(place[1]) is int
    return str(kind)[:80], tuple(place) if sound else None, str(text)[:4000], answer.get("stopped") is True
