"""Send batches of submissions to processes that grade them, and take in the marks as they come."""

import contextlib
import json
import os
import queue
import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

from .. import folders, records
from ..sandbox.launch import make_runtime
from .jobs import LARGEST, Job, Room, batches, take_figures, write_batch
from .paper import Paper

News: TypeAlias = tuple[str, int, Any]  # what happened, to which job, and what came of it
TRIES = 2
KIT = str(Path(__file__).resolve().parents[3])


class Runner:
    """A process of `labkit.instructor.exam.batch` that grades one batch after the other."""

    def __init__(self, folder: str | Path) -> None:
        self.folder = folder
        # One thread each: the processes share the cores among themselves.
        threads = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
        # What Jupyter leaves in temporary files goes with the folder.
        environment = {**os.environ, **threads, "PYTHONPATH": KIT, "PYTHONUTF8": "1", "TMPDIR": str(folder)}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "labkit.instructor.exam.batch"],
            cwd=folder,
            env=environment,
            text=True,
            encoding="utf-8",
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=1,
        )

    def grade(self, room: Room, jobs: Sequence[Job], runtime: str) -> Iterator[News]:
        """Yield ('mark', job id, mark) and ('done', job id, figure). Raises OSError if the process ends early."""
        folder = tempfile.mkdtemp(prefix="batch-", dir=self.folder)
        try:
            write_batch(folder, room, jobs, runtime)
            assert self.process.stdin is not None
            assert self.process.stdout is not None
            self.process.stdin.write(json.dumps({"folder": folder}) + "\n")
            for line in self.process.stdout:
                item = json.loads(line)
                if "end" in item:
                    break
                yield "mark", jobs[item["number"]].id, item
            else:
                raise OSError("a grading process ended early")
            figures = take_figures(folder, jobs)
            for job in jobs:
                yield "done", job.id, figures.get(job.id)
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def end(self) -> None:
        """Be rid of the process; it may be gone already."""
        with contextlib.suppress(OSError):
            if self.process.stdin:
                self.process.stdin.close()
        self.process.kill()
        self.process.wait()


class Local:
    """The processes of one machine, which load while the grader still looks at what was handed in."""

    def __init__(self, workers: int) -> None:
        self._stack = contextlib.ExitStack()
        folder = self._stack.enter_context(folders.temporary("grade"))
        # Students' workers, which may be another user, read the runtime; nobody else reads the rest.
        self.runtime = make_runtime(Path(folder, "runtime"))
        self._scratch = Path(folder, "batches")
        self._scratch.mkdir(mode=0o700)
        self._workers, self._runners = workers, [Runner(self._scratch)]
        self._threads: list[threading.Thread] = []
        self._stopped = False

    def __enter__(self) -> "Local":
        return self

    def __exit__(self, *error: object) -> None:
        self._stopped = True  # the threads begin nothing new
        for runner in self._runners:
            runner.end()
        for thread in self._threads:
            thread.join(5)
        self._stack.close()

    def grade(self, room: Room, jobs: Sequence[Job]) -> Iterator[News]:
        """Grade all jobs; yields as Runner.grade does, and ('lost', job id, why).

        What ran into a limit of time, or was not the student's doing, is tried once more at the end, with nothing else
        going on: the first check of a submission, and the others if that one gets through. What could not be graded
        then either is tried in a process of its own.
        """
        held: dict[int, dict[str, News]] = {}
        for news in self._together(room, jobs):
            kind, id, item = news
            if kind == "mark" and item.get("again"):
                held.setdefault(id, {})[item["check"]] = news
            elif id in held and kind != "mark":
                held[id][""] = news
            else:
                yield news
        if held:
            self._again(room, _first(room.paper, jobs, held), held, LARGEST)
            self._again(room, _others(room.paper, jobs, held), held, LARGEST)
            self._again(room, _ungraded(room.paper, jobs, held), held, 1)
        for news in held.values():
            yield from (one for check, one in news.items() if check)
            yield news[""]

    def _again(self, room, jobs, held, size):
        """Try these jobs, `size` in a batch; what comes goes into `held`, {job id: {check: news, "": how it ended}}."""
        for batch in (jobs[i : i + size] for i in range(0, len(jobs), size)):
            try:
                for news in self._runners[0].grade(room, batch, self.runtime):
                    kind, id, item = news
                    if kind == "mark" or item:  # a figure
                        held[id][item["check"] if kind == "mark" else ""] = news
            except (OSError, ValueError):  # the first marks stay
                self._runners[0].end()
                self._runners[0] = Runner(self._scratch)

    def _together(self, room, jobs):
        waiting: queue.SimpleQueue = queue.SimpleQueue()
        news: queue.SimpleQueue = queue.SimpleQueue()
        todo = batches(jobs, self._workers)
        for one in todo:
            waiting.put((one, 1))
        busy = min(self._workers, len(todo))
        self._runners += [Runner(self._scratch) for _ in range(busy - len(self._runners))]
        self._threads = [
            threading.Thread(target=self._work, args=(number, room, waiting, news), daemon=True)
            for number in range(busy)
        ]
        for thread in self._threads:
            thread.start()
        while busy:
            item = news.get()
            if item is None:
                busy -= 1
            else:
                yield item

    def _work(self, number, room, waiting, news):
        try:
            while not self._stopped:
                try:
                    jobs, tries = waiting.get_nowait()
                except queue.Empty:
                    return
                try:
                    for item in self._runners[number].grade(room, jobs, self.runtime):
                        news.put(item)
                except (OSError, ValueError) as error:
                    if self._stopped:
                        return
                    self._runners[number].end()
                    self._runners[number] = Runner(self._scratch)
                    if tries < TRIES:
                        waiting.put((jobs, tries + 1))
                    else:
                        for job in jobs:
                            news.put(("lost", job.id, f"The grading process ended twice: {error}."))
        finally:
            news.put(None)


def _first(paper, jobs, held):
    """Of these jobs the first check that is to be tried again."""
    return [_left(paper, job, list(marks)[:1]) for job in jobs if (marks := _marks(held, job))]


def _others(paper, jobs, held):
    """Of these jobs the others of these checks, unless the first was stopped again."""
    found = []
    for job in jobs:
        first, *others = _marks(held, job).items() or [("", {})]
        stopped = first[1].get("again") and first[1]["status"] != records.ERROR
        found += [_left(paper, job, [check for check, _ in others])] if others and not stopped else []
    return found


def _ungraded(paper, jobs, held):
    """Of these jobs what could not be graded, and the figure."""
    figures = [cell.id for cell in paper.cells if cell.points is None]
    found = []
    for job in jobs:
        checks = [check for check, mark in _marks(held, job).items() if mark["status"] == records.ERROR]
        found += [_left(paper, job, checks + figures)] if checks else []
    return found


def _marks(held, job):
    """{check: mark} of a job's held checks, if it did not get lost."""
    news = held.get(job.id, {})
    return {check: item for check, (_, _, item) in news.items() if check} if news.get("", [""])[0] == "done" else {}


def _left(paper, job, checks):
    """The job with no more to do than these checks."""
    return replace(job, done=frozenset(cell.id for cell in paper.cells if cell.id not in checks))


def lost(paper: Paper, reason: str) -> list[tuple[str, float, str, str]]:
    """Marks for a submission whose grading process could not finish."""
    return [(c.id, 0.0, records.ERROR, reason) for c in paper.cells if c.points is not None]
