"""The options of the instructors' commands, each with the function that runs it; `making` has the rest."""

import argparse
import math
import re
from datetime import date, datetime, time
from typing import Any

from . import making

LEAST, MOST = 0.1, 36_000  # seconds: below, no right answer has the time to be right


def add(commands: Any) -> None:
    """Add the instructors' commands to the subcommands of `labkit`, as argparse keeps them."""
    _add_grade(commands)
    _add_mark(commands)
    _add_term(commands)
    making.add(commands)


def _add_grade(commands):
    status = "Exit status: 0 all graded, 1 some submissions could not be graded, 2 the command could not run."
    one = commands.add_parser("grade", help="grade a class's submissions (instructors)", epilog=status)
    one.add_argument("submissions", metavar="SUBMISSIONS", help="a folder or zip: Moodle's, Canvas's, or your own")
    one.add_argument("--lab", required=True, metavar="NAME", help="such as 01_cartesian_ekf")
    one.add_argument("--out", required=True, metavar="DIR", help="where gradebook, tables and pages go")
    lms = one.add_argument_group("files of the LMS, filled in")
    lms.add_argument("--moodle", metavar="CSV", help="the grading worksheet that you downloaded")
    lms.add_argument("--canvas", metavar="CSV", help="the gradebook that you exported")
    lms.add_argument("--grade-column", metavar="NAME", help="of the worksheet, if it is not recognised")
    lms.add_argument("--feedback-column", metavar="NAME", help="the same for the comments")
    lms.add_argument("--column", metavar="TITLE", help="the assignment's column in Canvas's gradebook")
    lms.add_argument("--partial", action="store_true", help="also fill in students whose written answers are unread")
    one.add_argument(
        "--csv",
        choices=["plain", "excel"],
        help="how grades.csv and summary.csv are written: a,1.5 or, for the Excel of a language with decimal commas, "
        "a;1,5 (default: as the grades.csv that is there, else plain)",
    )
    one.add_argument(
        "--show-answers",
        action="store_true",
        help="on students' pages, show rubric and model answer of each written question to which all answers are read",
    )
    _add_rules(one)
    _add_machine(one)
    one.set_defaults(run=_grade)


def _add_term(commands):
    term = commands.add_parser("term", help="write one page over all labs of a class (instructors)")
    term.add_argument("out", metavar="OUT", help="the folder that labkit grade wrote into")
    term.set_defaults(run=_term)
    similar = commands.add_parser("similar", help="show whose code is alike, side by side (instructors)")
    similar.add_argument("out", metavar="OUT", help="the folder that labkit grade wrote into")
    similar.add_argument("--lab", required=True, metavar="NAME", help="such as 01_cartesian_ekf")
    similar.set_defaults(run=_similar)


def _add_mark(commands):
    one = commands.add_parser("mark", help="mark written answers in the browser (instructors)")
    one.add_argument("out", metavar="OUT", help="the folder that labkit grade wrote into")
    one.add_argument("--reader", metavar="NAME", help="who marks (default: the page asks)")
    one.add_argument("--port", type=_port, default=8599, metavar="N", help="default 8599; 0: any that is free")
    one.add_argument("--no-browser", action="store_true", help="only print the address")
    one.set_defaults(run=_mark)


def _add_rules(one):
    rules = one.add_argument_group("rules")
    rules.add_argument(
        "--attempts",
        choices=["newest", "first", "best"],
        help="which of several hand-ins counts (default: as DIR/course.toml says, else newest)",
    )
    rules.add_argument(
        "--due",
        type=_time,
        metavar="WHEN",
        help="such as 2026-11-20T23:59, local time, or a date; goes before DIR/course.toml",
    )
    rules.add_argument(
        "--late",
        choices=["count", "ignore"],
        help="late hand-ins count in full, or not at all (default: as DIR/course.toml says, else count)",
    )
    rules.add_argument("--regrade", nargs="+", metavar="STUDENT", help="grade these students anew, or: all")
    rules.add_argument(
        "--seed", type=_whole, metavar="N", help="what students' inputs are drawn from (default: random, recorded)"
    )


def _add_machine(one):
    machine = one.add_argument_group("machine")
    machine.add_argument("--jobs", type=_positive, metavar="N", help="processes (default: one for each core)")
    machine.add_argument("--scheduler", metavar="ADDRESS", help="grade on a Dask cluster, such as tcp://host:8786")
    machine.add_argument(
        "--call", type=_seconds, default=10.0, metavar="SECONDS", help="for each call of students' code (default 10)"
    )
    machine.add_argument(
        "--total", type=_seconds, default=60.0, metavar="SECONDS", help="for each submission (default 60)"
    )
    machine.add_argument("--level", type=int, choices=range(5), help="use no higher sandbox level than this")
    machine.add_argument("--weak-sandbox", action="store_true", help="go on at level 1")
    machine.add_argument(
        "--trust-students",
        action="store_true",
        help="go on without a sandbox: students' code can then do whatever you can",
    )


def _time(text):
    """`text` as local time without a zone, as the times of files are; a date alone means the end of that day."""
    try:
        if re.fullmatch(r"\d{4}-\d\d-\d\d", text.strip()):
            return datetime.combine(date.fromisoformat(text.strip()), time.max)
        when = datetime.fromisoformat(text.strip())
        return when.astimezone().replace(tzinfo=None) if when.tzinfo else when
    except (ValueError, OverflowError, OSError):
        known = "write 2026-11-20T23:59, or 2026-11-20 for the end of that day"
        raise argparse.ArgumentTypeError(f"{text!r} is no time: {known}") from None


def _whole(text):
    if not re.fullmatch(r"\d{1,18}", text, re.ASCII):
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number from 0 on")
    return int(text)


def _seconds(text):
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not LEAST <= seconds <= MOST:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of seconds from {LEAST:g} to {MOST:g}")
    return seconds


def _positive(text):
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of processes")
    return int(text)


def _port(text):
    if not re.fullmatch(r"\d{1,5}", text, re.ASCII) or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"{text!r} is no port from 0 to 65535")
    return int(text)


def _grade(args):
    from . import command

    args.jobs = args.jobs or command.cores()
    return command.main(args)


def _term(args):
    from . import command
    from .term.command import term

    return command.run("term", term, args)


def _mark(args):
    from .marking import command

    return command.main(args)


def _similar(args):
    from . import command
    from .term.command import similar

    return command.run("similar", similar, args)
