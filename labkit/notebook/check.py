"""`labkit check`: each notebook's checks in a process of its own, and a line for each of them."""

import json
import os
import queue
import subprocess
import sys
import threading
from collections.abc import Iterable
from dataclasses import dataclass, field
from glob import glob
from pathlib import Path
from typing import Any

from ..checks.feedback import STOPPED
from .usage import LOOK, Deadline, Usage

PASSED, FAILED, UNREADABLE = 0, 1, 2
ENDED = "Python itself ended here."


@dataclass
class Report:
    """What came of one notebook. checks: those that are to run, None while unknown;
    verdicts: {check: lines}, [] if passed;
    notes: what else the student should know;  problem: why nothing could be done.
    """

    checks: list[str] | None = None
    verdicts: dict[str, list[str]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    slow: list[str] = field(default_factory=list)
    problem: str = ""


def expanded(paths: Iterable[str]) -> list[str]:
    """The notebooks that paths, patterns (which Windows' shells leave alone) and folders stand for."""
    found: list[str] = []
    for path in paths:
        if os.path.isdir(path):
            found += sorted(map(str, Path(path).glob("*.ipynb"))) or [path]
        else:
            found += [path] if os.path.exists(path) else sorted(glob(path, recursive=True)) or [path]
    return found


def check_all(paths: Iterable[str], seconds: float) -> int:
    """Check notebooks one after the other; print a line for each check; return the worst exit status."""
    worst, passed, total = PASSED, 0, 0
    for path in paths:
        report = check_one(path, seconds)
        show(Path(path).stem, report)
        good = sum(not lines for lines in report.verdicts.values())
        status = UNREADABLE if report.problem else PASSED if good == len(report.verdicts) else FAILED
        worst, passed, total = max(worst, status), passed + good, total + len(report.verdicts)
    if total:
        print(f"{passed} of {total} checks passed.")
    return worst


def show(lab: str, report: Report) -> None:
    """Print a report."""
    if report.problem:
        print(f"ERROR  {report.problem}", file=sys.stderr)
    for check, lines in report.verdicts.items():
        print("  ".join(["FAIL" if lines else "PASS", lab, check, *lines[:1]]))
        for line in lines[1:]:
            print(f"      {line}")
    for note in report.notes:
        print(f"NOTE  {lab}  {note}")


def check_one(path: str, seconds: float) -> Report:
    """The Report of one notebook, whose code may compute for so many seconds in all.

    A check that ends its process, or hangs where nothing inside can stop it, has failed: the others run in a new one.
    """
    report = Report()
    while True:
        running, why = _run(path, seconds, report)
        rest = [check for check in report.checks or () if check not in report.verdicts]
        if not report.checks:
            none = f"{path} holds no check: is it one of the lab notebooks?"
            report.problem = report.problem or (none if report.checks is not None else f"{path}: {why}")
        if not rest:
            return report
        for check in [running] if running in rest else rest:
            report.verdicts[check] = [why]


def _run(path: str, seconds: float, report: Report) -> tuple[str, str]:
    """Let a child process add to the report; the check that ran last, '' before there was one, and why it ended."""
    child, news = _child(path, seconds, list(report.verdicts), report.slow)
    usage, running = Usage(child.pid), ""
    limit = Deadline(usage, seconds)
    while True:
        try:
            item = news.get(timeout=LOOK)
        except queue.Empty:
            if limit.over() or usage.seconds > 1.2 * seconds + 0.5:
                child.kill()
                return running, STOPPED
            continue
        if item is None:
            child.wait()
            return running, ENDED
        if item["kind"] == "begin":
            running, limit = item["check"], Deadline(usage, min(item["seconds"], seconds))
        _take(report, item)


def _take(report: Report, item: dict[str, Any]) -> None:
    """Put a piece of news into the report."""
    kind = item["kind"]
    if kind == "unreadable":
        report.problem = item["text"]
    elif kind == "checks":
        report.checks = item["names"]
        for check in item["missing"]:
            _note(report, f'No cell calls `check("{check}", ...)` any more. It ran all the same: put its cell back.')
    elif kind == "problem":
        _note(report, f"{item['where']}: " + "\n      ".join(item["lines"]))
    elif kind == "beside":
        for name in item["names"]:
            _note(report, f"It uses the file {name} beside it: hand that in too.")
    elif kind == "verdict":
        report.verdicts[item["check"]] = item["lines"]
        report.slow = item["slow"]


def _note(report, text):
    if text not in report.notes:
        report.notes.append(text)


def _child(path, seconds, done, slow):
    """(a process that runs the notebook, a queue of its news, which ends with None)."""
    kit = Path(__file__).resolve().parents[2]
    start = f"import sys; sys.path[0] = {str(kit)!r}; from labkit.notebook.worker import main; "
    start += f"main({str(path)!r}, {seconds!r}, {done!r}, {slow!r})"
    one = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    child = subprocess.Popen(
        [sys.executable, "-X", "utf8", "-c", start],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, **one},
    )
    news: queue.SimpleQueue = queue.SimpleQueue()

    def listen():
        for line in child.stdout:
            if line.endswith(b"}\n"):
                news.put(json.loads(line))
        news.put(None)

    threading.Thread(target=listen, daemon=True).start()
    return child, news
