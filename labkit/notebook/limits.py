"""How long a student's code may compute: the processor's time counts, so that a busy machine changes nothing."""

import contextlib
import ctypes
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

CALL = 10.0  # seconds of the processor for one check of one answer
PATIENCE = 2.0  # the same for an answer that has used up its time in a check before; a right one takes 0.1 s
AGAIN = 0.2  # seconds until code that caught the exception is stopped once more


class TimeUpError(KeyboardInterrupt):
    """Code has used up its time; no `except Exception` of a student's catches it."""


@dataclass
class Limit:
    """spent: seconds of the processor since the limit began;  reached: whether the code was stopped."""

    spent: float = 0.0
    reached: bool = False


@contextmanager
def cpu_limit(seconds: float) -> Iterator[Limit]:
    """Let the block use so many seconds of the processor; then TimeUpError is raised in it.

    It is raised between two of Python's own steps: a library that computes for long is not interrupted.
    """
    limit, start, over = Limit(), time.process_time(), threading.Event()
    thread, lock = threading.get_ident(), threading.Lock()

    def watch():
        while not over.wait(AGAIN if limit.reached else max(seconds - time.process_time() + start, 0.01)):
            with lock:
                if not over.is_set() and time.process_time() - start >= seconds:
                    limit.reached = True
                    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(TimeUpError))

    with contextlib.suppress(RuntimeError):  # the code has taken all threads; it is then stopped from outside only
        threading.Thread(target=watch, daemon=True).start()
    try:
        yield limit
    finally:
        with lock:
            over.set()
        if limit.reached:
            with contextlib.suppress(TimeUpError):  # one that has not arrived yet does so here, and not later
                for _ in range(10):
                    pass
        limit.spent = time.process_time() - start
