"""The command line: `labkit check` and `labkit data`; the full kit adds what instructors run."""

import argparse
import importlib
import importlib.util
import io
import sys
from collections.abc import Sequence

from . import __version__

UNREADABLE = 2
FULL = ("build", "grade", "release", "sandbox")  # the commands of labkit/instructor


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
    return args.run(args)


def _check(args):
    try:
        from .notebook.check import check_all, expanded

        return check_all(expanded(args.notebooks), args.timeout)
    except KeyboardInterrupt:
        return 130


def _data(args):
    from .mrclam.install import main as data

    return data(args.paths)
