"""The pipe to one worker process: ask with data, wait no longer than allowed, believe nothing."""

import os
import selectors
import time
from typing import Any

from ...checks.feedback import FilterError
from . import wire
from .launch import Sandbox

START = 30  # seconds for a worker to be there, on a busy machine
SPOILT = "Your code wrote into the grader's own channel, so its answer was lost."


class WorkerLostError(FilterError):
    """The worker gave no answer: it ended, hung or talked nonsense. The text says so to the student."""


class StudentCodeError(FilterError):
    """The student's code raised: kind is the exception's type, place (cell label, line) or None."""

    public = False  # whether its text may be shown: what raised had seen nothing secret

    def __init__(self, kind: str, place: tuple[str, int] | None, text: str) -> None:
        super().__init__(text)
        self.kind, self.place = kind, place


class Channel:
    """One worker process and its pipes; seconds: how much of the processor it may use in all."""

    def __init__(self, sandbox: Sandbox, seconds: float) -> None:
        self.worker = sandbox.start(seconds)
        self.ready = False
        for stream in (self.worker.requests, self.worker.answers):
            os.set_blocking(stream.fileno(), False)

    def settle(self) -> None:
        """Wait until it has confined itself. Raises WorkerLostError."""
        if not self.ready:
            self.ask({"do": "confine", **self.worker.limits}, START)
            self.ready = True

    def ask(self, request: dict[str, Any], seconds: float) -> dict[str, Any]:
        """The answer to a request. Raises StudentCodeError, or WorkerLostError: then the worker is no use any more."""
        deadline = time.monotonic() + seconds
        self._send(wire.pack(request, objects=True), deadline)
        try:
            head = self._receive(8, deadline)
            text, raw = wire.sizes(head)
            body = self._receive(text + raw, deadline)
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

    def _send(self, data, deadline):
        stream = self.worker.requests
        view = memoryview(data)
        while view:
            self._wait(stream, selectors.EVENT_WRITE, deadline)
            try:
                view = view[os.write(stream.fileno(), view) :]
            except BlockingIOError:
                continue
            except OSError:
                raise WorkerLostError(self._gone()) from None

    def _receive(self, count, deadline):
        stream, parts = self.worker.answers, []
        while count:
            self._wait(stream, selectors.EVENT_READ, deadline)
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

    def _wait(self, stream, event, deadline):
        left = deadline - time.monotonic()
        with selectors.DefaultSelector() as selector:
            selector.register(stream, event)
            if left <= 0 or not selector.select(left):
                raise WorkerLostError("Your code was still running when its time was up: does a loop never end?")

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
    return str(kind)[:80], tuple(place) if sound else None, str(text)[:4000]
