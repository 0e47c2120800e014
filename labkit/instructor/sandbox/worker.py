"""The worker: runs one student's cells inside the sandbox and answers calls, data in and data out.

It starts with everything imported, waits for its limits, then for the cells. Nothing that it says is
believed: the grader compares numbers, and a worker that answers nonsense has only lost its check.
"""

import base64
import os
import sys
from collections.abc import Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from io import TextIOBase
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from ... import checks, history, metrics  # noqa: F401 - metrics are warm for the student
from ...checks import feedback
from ...checks.trace import Trace
from ...notebook.limits import TimeUpError, cpu_limit
from ...notebook.read import Cell
from ...notebook.session import Session
from ...notebook.shell import alone
from . import fill, probe, wire
from .confine import confine, load

TEXT, LINE, PROBLEMS = 1000, 300, 10  # characters of what is only for reading, and of it as many as anybody reads
Cells: TypeAlias = Sequence[Mapping[str, Any]]  # of a notebook, each the fields of a Cell


def main(*packages: str) -> None:
    """Serve the grader until it hangs up. packages: what confining will need, loaded before anyone waits."""
    load(*packages)
    alone()
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    silent = os.open(os.devnull, os.O_RDWR)
    for fd in (0, 1, 2):
        os.dup2(silent, fd)
    os.close(silent)
    worker = Worker()
    while (request := wire.read(requests, objects=True)) is not None:
        try:
            answer = worker.answer(request)
        except BaseException as error:  # a student may raise anything
            answer = failure(error)
        try:
            frame = wire.pack(answer)
        except (wire.FrameError, RecursionError) as error:
            frame = wire.pack({"odd": str(error)[:TEXT]})
        answers.write(frame)
        answers.flush()
    os._exit(0)


class Worker:
    """What the grader can ask for, in requests of data and objects of a kind; answers are data."""

    def __init__(self) -> None:
        self.names: dict[str, Any] = {}  # of the student's notebook
        self.made: list[Any] = []  # objects of the student's classes, which the grader knows by their number

    def answer(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """The answer to {"do": what, "allowed": seconds, ...}: of the method `do_<what>`, given the other fields."""
        request = dict(request)
        do, allowed = request.pop("do"), request.pop("allowed")
        with redirect_stdout(Sink()), redirect_stderr(Sink()), np.errstate(all="ignore"):
            if do == "load":
                return self.do_load(**request, allowed=allowed)
            with cpu_limit(allowed):
                return getattr(self, f"do_{do}")(**request)

    def do_confine(self, **limits: Any) -> dict[str, Any]:
        """Limit this process for good, as `confine.confine` says."""
        confine(**limits)
        os.chdir(limits["scratch"])
        sys.path[:] = [os.getcwd(), *filter(None, sys.path)]
        return {"ready": True}

    def do_probe(self, **targets: Any) -> dict[str, bool]:
        """Try to break out, as `probe.inside` says."""
        return probe.inside(**targets)

    def do_fill(self, what: str, places: list[str], most: int) -> dict[str, int]:
        """Try to keep more in files than is allowed, as `fill.fill` says."""
        return fill.fill(what, places, most)

    def do_load(
        self, cells: Cells, given: Cells, files: Mapping[str, str], wanted: Sequence[str], allowed: float
    ) -> dict[str, Any]:
        """Run what the wanted names need; tell which are there now and what each is.

        given: the cells of the lab as it was handed out;  files: {path: base64} of what lies beside the notebook;
        allowed: seconds of the processor.
        """
        for path, content in files.items():
            Path(path).parent.mkdir(parents=True, exist_ok=True)
            Path(path).write_bytes(base64.b64decode(content))
        session = Session([Cell(**cell) for cell in cells])
        session.supply(Cell(**cell) for cell in given)
        self.names = session.names
        problems = [
            {"place": problem.where, "lines": [str(line)[:LINE] for line in problem.lines[:3]]}
            for problem in list(session.run(wanted, allowed))[:PROBLEMS]
        ]
        stopped = any(isinstance(problem.error, TimeUpError) for problem in session.stopped.values())
        kinds = {name: type(self.names[name]).__name__ for name in wanted if name in self.names}
        return {"kinds": kinds, "problems": problems, "stopped": stopped}

    def do_observe(self, name: str, data: checks.Data) -> dict[str, Any]:
        """What `checks.observe` sees of the object, or `probe` if there are probes: traces, or why there are none."""
        try:
            look = checks.probe if "probing" in data else checks.observe
            traces = look(data, self.names[name])
        except checks.CheckError as error:
            told = {"told": error.summary[:TEXT], "lines": [str(line)[:LINE] for line in error.details[:6]]}
            return {**told, "stopped": isinstance(error.__context__, TimeUpError)}
        return {"traces": {id: _trace(trace) for id, trace in traces.items()}}

    def do_call(self, name: str, args: Sequence, options: Mapping[str, Any]) -> dict[str, Any]:
        """What a function gives."""
        return {"value": self.names[name](*args, **options)}

    def do_make(self, name: str, args: Sequence, options: Mapping[str, Any]) -> dict[str, int]:
        """Make an object of a class and keep it; its number."""
        self.made.append(self.names[name](*args, **options))
        return {"made": len(self.made) - 1}

    def do_map(self, name: str, calls: Sequence[Sequence]) -> dict[str, list]:
        """What a function gives for each of several tuples of arguments."""
        return {"values": [self.names[name](*args) for args in calls]}

    def do_method(self, made: int, method: str, args: Sequence, options: Mapping[str, Any]) -> dict[str, Any]:
        """What a method of an object gives."""
        return {"value": getattr(self.made[made], method)(*args, **options)}

    def do_get(self, made: int, name: str) -> dict[str, Any]:
        """A field of an object."""
        return {"value": getattr(self.made[made], name)}

    def do_replay(self, name: str, record: Any, options: Mapping[str, Any]) -> dict[str, np.ndarray]:
        """Run a filter over a log: x and x_prior (N, n), their covariances (N, n, n).  options: of `make_filter`."""
        run = history.replay(history.make_filter(self.names[name], record, **options), record)
        fields = ("x", "P", "x_prior", "P_prior")
        return {field: np.asarray(getattr(run, field), dtype=float) for field in fields}


class Sink(TextIOBase):
    """Takes what a student prints and keeps none of it."""

    def write(self, text: str) -> int:
        """As of any file."""
        return len(text)


def _trace(trace: Trace) -> dict[str, Any]:
    stop = trace.stop and [trace.stop.key, str(trace.stop.text)[:TEXT], str(trace.stop.line)[:LINE]]
    return {"steps": trace.steps, "stop": stop, "printed": trace.printed[-LINE:]}


def failure(error: BaseException) -> dict[str, Any]:
    """An exception as data: its type, where in the student's cells it was, and what it says."""
    root = error.__cause__ if isinstance(error, feedback.FilterError) and error.__cause__ else error
    place, tb = None, root.__traceback__
    while tb is not None:
        name = tb.tb_frame.f_code.co_filename
        place = [name, tb.tb_lineno] if feedback.is_cell(name) else place
        tb = tb.tb_next
    stopped = isinstance(error, TimeUpError)
    text = feedback.explain(error) if stopped or not isinstance(error, KeyboardInterrupt) else "It interrupted itself."
    return {"raised": type(root).__name__, "place": place, "text": text[:TEXT], "stopped": stopped}
