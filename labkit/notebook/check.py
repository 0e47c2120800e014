"""`labkit check`: each notebook's checks in a process of its own, and a line for each of them."""

import json
import os
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

PASSED, FAILED, UNREADABLE = 0, 1, 2
FAR = 10  # times as long as a notebook may compute a process may live, on a busy machine
ENDED = "Python itself ended here."


@dataclass
class Report:
    """What came of one notebook. checks: all that are to run;  verdicts: {check: lines}, none where it passed;
    notes: what else the student should know;  problem: why nothing could be done."""

    checks: list[str] = field(default_factory=list)
    verdicts: dict[str, list[str]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    slow: list[str] = field(default_factory=list)
    problem: str = ""


def check_all(paths: Iterable[str], seconds: float) -> int:
    """Check notebooks one after the other; print a line for each check; return the worst exit status."""
    worst, passed, total = PASSED, 0, 0
    for path in paths:
        report = check_one(path, seconds)
        show(Path(path).stem, report)
        good = sum(not lines for lines in report.verdicts.values())
        status = UNREADABLE if report.problem else PASSED if good == len(report.checks) else FAILED
        worst, passed, total = max(worst, status), passed + good, total + len(report.checks)
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

    A check that ends its process, or hangs where nothing can stop it, has failed, and the others run in a new process.
    """
    report = Report()
    while True:
        before, running = len(report.verdicts), None
        for item in _listen(path, seconds, list(report.verdicts), report.slow):
            running = item["check"] if item["kind"] == "begin" else running
            _take(report, item)
        if report.problem:
            return report
        if not report.checks:
            report.problem = f"{path} holds no check: is it one of the lab notebooks?"
            return report
        rest = [check for check in report.checks if check not in report.verdicts]
        if not rest:
            return report
        if len(report.verdicts) == before or not running:  # it ended in the middle, before or in a check
            for check in [running] if running else rest:
                report.verdicts[check] = [ENDED]


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
        _note(report, f"{item['where']} stopped: " + "\n      ".join(item["lines"]))
    elif kind == "beside":
        for name in item["names"]:
            _note(report, f"It uses the file {name} beside it: hand that in too.")
    elif kind == "verdict":
        names = [item["check"]] if item["check"] else report.checks
        for check in names:
            report.verdicts.setdefault(check, item["lines"])
        report.slow = item["slow"]


def _note(report, text):
    if text not in report.notes:
        report.notes.append(text)


def _listen(path, seconds, done, slow):
    """The news of a child process that runs the notebook."""
    kit = Path(__file__).resolve().parents[2]
    start = f"import sys; sys.path[0] = {str(kit)!r}; from labkit.notebook.worker import main; "
    start += f"main({str(path)!r}, {seconds!r}, {done!r}, {slow!r})"
    child = subprocess.Popen(
        [sys.executable, "-X", "utf8", "-c", start],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"},
    )
    try:
        out, _ = child.communicate(timeout=FAR * seconds)
    except subprocess.TimeoutExpired:  # it waits for something that never comes
        child.kill()
        out, _ = child.communicate()
    return [json.loads(line) for line in out.decode("utf-8", "replace").splitlines() if line.endswith("}")]
