"""How much time a process has taken: of the processor, and asleep; not what it waited for a busy machine."""

import time

import psutil

LOOK = 0.1  # seconds between two looks
FAR = 20  # times as long as code may compute one waits for it on a busy machine
ASLEEP = (psutil.STATUS_SLEEPING, psutil.STATUS_IDLE, psutil.STATUS_STOPPED)


class Usage:
    """The time of a process and of all that it had started when this began.

    A process that is ready to run and does not get the processor takes no time: other programs do. One that sleeps
    does, as it would for ever.
    """

    def __init__(self, pid: int) -> None:
        try:
            top = psutil.Process(pid)
            self._processes = [top, *top.children(recursive=True)]
        except psutil.Error:
            self._processes = []
        self._cpu, self._when, self.seconds = self._count(), time.monotonic(), 0.0

    def look(self, waiting: bool = False) -> float:
        """Seconds that it has taken so far. waiting: whether nothing came since the last look, so that sleep counts."""
        cpu, now = self._count(), time.monotonic()
        computed, passed = max(cpu - self._cpu, 0.0), now - self._when
        slept = waiting and computed < passed / 10 and self._asleep()
        self.seconds += passed if slept else computed
        self._cpu, self._when = cpu, now
        return self.seconds

    def _count(self):
        total = 0.0
        for process in self._processes:
            try:
                times = process.cpu_times()
                total += times.user + times.system
            except psutil.Error:
                continue
        return total

    def _asleep(self):
        try:
            return all(process.status() in ASLEEP for process in self._processes)
        except psutil.Error:
            return False


class Deadline:
    """When the time for one thing of `seconds` is up for a process."""

    def __init__(self, usage: Usage, seconds: float) -> None:
        # Code is stopped from inside first; where that does not help after a while, a library is at it.
        seconds = 1.2 * seconds + 0.5
        self.usage, self.stop, self.far = usage, usage.look() + seconds, time.monotonic() + FAR * seconds

    def over(self) -> bool:
        """Whether it is, while nothing comes."""
        return self.usage.look(waiting=True) > self.stop or time.monotonic() > self.far
