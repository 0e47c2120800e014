"""The command line: `labkit check` and `labkit data`; the full kit adds what instructors run."""

import argparse
import importlib
import importlib.util
import io
import os
import sys
from collections.abc import Sequence

from . import __version__

UNREADABLE, STOPPED = 2, 130
# The commands of labkit/instructor.
FULL = ("build", "export", "grade", "handout", "mark", "new", "release", "sandbox", "similar", "site", "term")


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return the exit status."""
    parser = argparse.ArgumentParser(prog="labkit", description="The robot localization labs.")
    parser.add_argument("--version", action="version", version=f"labkit {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    status = "Exit status: 0 all passed, 1 something failed, 2 a file cannot be read."
    test = commands.add_parser("check", help="run the checks of notebooks", description=status)
    test.add_argument("notebooks", nargs="+", metavar="NOTEBOOK", help="files, patterns such as '*.ipynb', or folders")
    test.add_argument(
        "--timeout", type=float, default=60.0, metavar="SECONDS", help="of computing for each notebook (default 60)"
    )
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
    _streams()
    return _run(args)


def _run(args):
    """The exit status of a command; what the computer itself cannot do is told with its cure."""
    if sys.stdout is None:
        if sys.stderr:
            print("labkit: there is nowhere to print to: let its output go to a file or a terminal.", file=sys.stderr)
        return UNREADABLE
    try:
        status = args.run(args)
        sys.stdout.flush()
        return status
    except KeyboardInterrupt:
        return STOPPED
    except OSError as error:
        what = "nobody reads what it prints any more" if isinstance(error, BrokenPipeError) else error.strerror or error
        print(f"labkit: {f'{error.filename}: ' if error.filename else ''}{what}.", file=sys.stderr)
        return UNREADABLE
    finally:
        _let_go()


def _streams():
    """What is closed of input, output and errors leads nowhere: else the next file opened would take its place."""
    while (file := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(file)


def _let_go():
    """Print what is left, or nothing more where that cannot be done: Python itself would try again at its end."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _check(args):
    from .notebook.check import check_all, expanded

    return check_all(expanded(args.notebooks), args.timeout)


def _data(args):
    from .mrclam.install import main as data

    return data(args.paths)
