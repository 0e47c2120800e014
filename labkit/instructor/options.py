"""The options of the instructors' commands, each with the function that runs it."""

import argparse
import math
import re
from datetime import date, datetime, time
from pathlib import Path
from typing import Any

from .export import KINDS

LEAST, MOST = 0.1, 36_000  # seconds: below, no right answer has the time to be right


def add(commands: Any) -> None:
    """Add the instructors' commands to the subcommands of `labkit`, as argparse keeps them."""
    _add_grade(commands)
    _add_mark(commands)
    _add_term(commands)
    make = commands.add_parser("release", help="make what students get (instructors)")
    make.add_argument("out", metavar="OUT", help="a new folder, or a file that ends in .zip")
    make.add_argument("--force", action="store_true", help="write over an older zip")
    make.add_argument("--variants", metavar="COURSE", help="numbers of students' own, by the course's name and theirs")
    make.add_argument("--class", dest="roster", metavar="CSV", help="with it: a zip for each student of this table")
    make.set_defaults(run=_release)

    show = commands.add_parser("sandbox", help="show what this machine's sandboxes keep students' code from")
    show.set_defaults(run=_sandbox)

    build = commands.add_parser("build", help="make notebooks and check numbers from the solutions (maintainers)")
    build.add_argument("names", nargs="*", metavar="NAME", help="labs to build (default: all)")
    build.add_argument("--check", action="store_true", help="write nothing; fail if something is out of date")
    build.add_argument("--no-run", action="store_true", help="do not run the solutions")
    build.set_defaults(run=_build)

    show = commands.add_parser("site", help="make the course's site, which needs no server (instructors)")
    show.add_argument("out", metavar="OUT", help="a new folder")
    show.add_argument("--lite", action="store_true", help="with the students' kit in the browser (JupyterLite)")
    show.set_defaults(run=_site)

    new = commands.add_parser("new", help="begin a lab of your own (instructors)")
    new.add_argument("name", metavar="NAME", help="two digits and a name, such as 09_my_lab")
    new.set_defaults(run=_new)
    _add_export(commands)


def _add_export(commands):
    one = commands.add_parser("export", help="make labs for nbgrader, Gradescope or GitHub Classroom (instructors)")
    one.add_argument("kind", choices=KINDS, help="for which of them")
    one.add_argument("labs", nargs="+", metavar="LAB", help="such as 01_cartesian_ekf")
    one.add_argument("out", metavar="OUT", help="the folder to write into")
    one.add_argument("--force", action="store_true", help="write over an older export")
    one.add_argument("--weak-sandbox", action="store_true", help="as for labkit grade, where that grader runs")
    one.add_argument("--trust-students", action="store_true", help="the same")
    one.set_defaults(run=_export)


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


def _release(args):
    from .authoring import release

    if not args.roster:
        return release.main(args.out, args.force, args.variants or "")
    from .policy import variants

    return variants.main(Path(args.out), args.force, args.variants or "", args.roster)


def _export(args):
    from .export import command

    return command.main(args)


def _sandbox(args):
    from .sandbox import choose

    return choose.table()


def _site(args):
    from .site import command

    return command.main(args.out, args.lite)


def _build(args):
    from .authoring import build
    from .exam import bite

    status = build.main(args.names, check=args.check, run=not args.no_run)
    if status or args.no_run:
        return status
    return bite.main(build.ROOT, args.names, check=args.check)


def _new(args):
    from .authoring import new

    return new.main(args.name)
