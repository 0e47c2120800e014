"""The command line: `labkit check` and `labkit data`; the full kit adds what instructors run."""

import argparse
import importlib
import importlib.util
import io
import json
import os
import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from . import __version__

PASSED, FAILED, UNREADABLE = 0, 1, 2
FULL = ("build", "grade", "release", "sandbox")  # the commands of labkit/instructor


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return the exit status."""
    parser = argparse.ArgumentParser(prog="labkit", description="The robot localization labs.")
    parser.add_argument("--version", action="version", version=f"labkit {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    status = "Exit status: 0 all passed, 1 something failed, 2 a file cannot be read."
    test = commands.add_parser("check", help="run the checks of notebooks", description=status)
    test.add_argument("notebooks", nargs="+", metavar="NOTEBOOK")
    test.add_argument("--timeout", type=float, default=60.0, metavar="SECONDS", help="for each notebook (default 60)")
    test.set_defaults(run=_check)

    take = commands.add_parser("data", help="take in recorded robot data that was downloaded")
    take.add_argument("paths", nargs="*", metavar="PATH", help="a folder or a zip (none: say what is there)")
    take.set_defaults(run=_data)

    if importlib.util.find_spec("labkit.instructor"):
        importlib.import_module("labkit.instructor.options").add(commands)
    elif any(word in FULL for word in (sys.argv[1:] if argv is None else argv)[:1]):
        print("labkit: this is the students' kit; that command is in the full one.", file=sys.stderr)
        return UNREADABLE

    args = parser.parse_args(argv)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal that lacks a letter shows '?'
    return args.run(args)


def _check(args):
    try:
        return check_all(args.notebooks, args.timeout)
    except KeyboardInterrupt:
        return 130


def _data(args):
    from .mrclam.install import main as data

    return data(args.paths)


def check_all(paths: Iterable[str], seconds: float) -> int:
    """Check notebooks one after the other; print a line for each check; return the worst exit status."""
    worst, passed, total = PASSED, 0, 0
    for path in paths:
        status, good, count = check_one(path, seconds)
        worst, passed, total = max(worst, status), passed + good, total + count
    if total:
        print(f"{passed} of {total} checks passed.")
    return worst


def check_one(path: str, seconds: float) -> tuple[int, int, int]:
    """(exit status, checks passed, checks in all) of one notebook; prints a line for each check."""
    news, cause = _listen(path, seconds)
    lab = Path(path).stem
    checks: list[str] = next((item["names"] for item in news if item["kind"] == "checks"), [])
    problem = next((item["text"] for item in news if item["kind"] == "unreadable"), "")
    if not checks:
        problem = problem or cause or f"{path} holds no check: is it one of the lab notebooks?"
        print(f"ERROR  {problem}", file=sys.stderr)
        return UNREADABLE, 0, 0
    events = [item for item in news if item["kind"] == "event"]
    for event in events:
        name = event["check"] or event["where"]
        print("  ".join(["PASS" if event["passed"] else "FAIL", lab, name, *event["lines"][:1]]))
        for line in event["lines"][1:]:
            print(f"      {line}")
    for name in checks[sum(bool(event["check"]) for event in events) :]:
        print(f"FAIL  {lab}  {name}  {cause or 'It did not run.'}")
        cause = ""
    good = sum(event["passed"] for event in events)
    return (PASSED if good == len(events) == len(checks) else FAILED), good, len(checks)


def _listen(path, seconds):
    """The news of a child process that runs the notebook; and why it ended early, or ''."""
    kit = Path(__file__).resolve().parent.parent
    start = f"import sys; sys.path[0] = {str(kit)!r}; from labkit.notebook.worker import main; "
    start += f"main({str(path)!r}, {seconds!r})"
    child = subprocess.Popen(
        [sys.executable, "-X", "utf8", "-c", start],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, "MPLBACKEND": "Agg"},
    )
    cause = "Python itself ended here, before the checks did."
    try:
        out, _ = child.communicate(timeout=seconds + 5)
    except subprocess.TimeoutExpired:  # stuck where not even the child's own watchdog could act
        child.kill()
        out, _ = child.communicate()
        cause = f"It was still running after {seconds:g} s, inside a library."
    news = [json.loads(line) for line in out.decode("utf-8", "replace").splitlines() if line.endswith("}")]
    return news, "" if news and news[-1]["kind"] in ("end", "unreadable") else cause
