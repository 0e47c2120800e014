"""The worker: runs one student's cells inside the sandbox and answers calls, data in and data out.

It starts with everything imported, waits for its limits, then for the cells. Nothing that it says is
believed: the grader compares numbers, and a worker that answers nonsense has only lost its check.
"""

import os
import sys
import warnings
from contextlib import redirect_stderr, redirect_stdout

import numpy as np

from ... import checks, log, metrics, team, world  # noqa: F401 - warm for the student
from ...checks import feedback
from ...legged.robot import FieldLog
from ...notebook import read as notebook
from ...notebook.session import Session
from . import probe, wire
from .confine import confine, load

TEXT = 2000  # characters of anything that is only for reading


def main(*packages):
    """Serve the grader until it hangs up. packages: what confining will need, loaded before anyone waits."""
    load(*packages)
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
    """What the grader can ask for; each method gets the request's fields."""

    def __init__(self):
        self.names, self.made = {}, []

    def answer(self, request):
        request = dict(request)
        with redirect_stdout(Sink()), redirect_stderr(Sink()), np.errstate(all="ignore"):
            return getattr(self, f"do_{request.pop('do')}")(**request)

    def do_confine(self, **limits):
        confine(**limits)
        os.chdir(limits["scratch"])
        sys.path[:] = [p for p in sys.path if p]
        return {"ready": True}

    def do_probe(self, **targets):
        return probe.inside(**targets)

    def do_load(self, cells, wanted):
        """Run the cells; tell which of the wanted names are there now and what each is."""
        session = Session([notebook.Cell(**cell) for cell in cells], wanted=wanted)
        self.names = session.names
        problems = [
            {"place": event.where, "lines": [str(line)[:TEXT] for line in event.lines[:6]]}
            for event in session.run()
            if event.error and not event.check
        ]
        kinds = {name: type(self.names[name]).__name__ for name in wanted if name in self.names}
        return {"kinds": kinds, "problems": problems[:20]}

    def do_observe(self, name, data):
        """What `checks.observe` sees of the object: a list of traces, or why there are none."""
        try:
            traces = checks.observe(data, self.names[name])
        except checks.CheckError as error:
            return {"told": error.summary[:TEXT], "lines": [str(line)[:TEXT] for line in error.details[:6]]}
        return {"traces": {id: _trace(trace) for id, trace in traces.items()}}

    def do_call(self, name, args, options):
        return {"value": self.names[name](*args, **options)}

    def do_make(self, name, args, options):
        self.made.append(self.names[name](*args, **options))
        return {"made": len(self.made) - 1}

    def do_map(self, name, calls):
        return {"values": [self.names[name](*args) for args in calls]}

    def do_method(self, made, method, args, options):
        return {"value": getattr(self.made[made], method)(*args, **options)}

    def do_get(self, made, name):
        return {"value": getattr(self.made[made], name)}

    def do_replay(self, name, log_fields, x0, P0, Q=None, R=None, noise=None, complete=None):
        fields = {**log_fields, "seen_id": np.asarray(log_fields["seen_id"])}
        record = log.Log(**fields) if complete is None else FieldLog(**fields, complete=complete)
        history = log.replay(log.make_filter(self.names[name], record, Q, R, x0, P0, noise), record)
        return _believed(history)

    def do_replay_team(self, name, members, ids, x0, P0, noise, options):
        logs = [log.Log(**fields, map=world.Map(), sensor="rb", frame="robot") for fields in members]
        kf = self.names[name](x0, P0, noise, **options)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", team.FrameWarning)
            return _believed(log.replay(kf, team.TeamLog(tuple(logs), tuple(ids))))


class Sink:
    """Takes what a student prints and keeps none of it."""

    def write(self, text):
        return len(text)

    def flush(self):
        pass


def _believed(history):
    return {field: getattr(history, field) for field in ("x", "P", "x_prior", "P_prior")}


def _trace(trace):
    stop = trace.stop and [trace.stop.key, str(trace.stop.text)[:TEXT], str(trace.stop.line)[:TEXT]]
    return {"steps": trace.steps, "stop": stop, "printed": trace.printed[-TEXT:]}


def failure(error):
    """An exception as data: its type, where in the student's cells it was, and what it says."""
    root = error.__cause__ if isinstance(error, feedback.FilterError) and error.__cause__ else error
    place, tb = None, root.__traceback__
    while tb is not None:
        name = tb.tb_frame.f_code.co_filename
        place = [name, tb.tb_lineno] if feedback.is_cell(name) else place
        tb = tb.tb_next
    text = feedback.explain(error) if not isinstance(error, KeyboardInterrupt) else "It interrupted itself."
    return {"raised": type(root).__name__, "place": place, "text": text[:TEXT]}
