"""The options of the commands that make what others get: labs, a release, an export, a site."""

from pathlib import Path
from typing import Any

from .export import KINDS


def add(commands: Any) -> None:
    """Add these commands to the subcommands of `labkit`, as argparse keeps them."""
    make = commands.add_parser("release", help="make what students get (instructors)")
    make.add_argument("out", metavar="OUT", help="a new folder, or a file that ends in .zip")
    make.add_argument("--force", action="store_true", help="write over an older zip")
    make.add_argument("--variants", metavar="COURSE", help="numbers of students' own, by the course's name and theirs")
    make.add_argument("--class", dest="roster", metavar="CSV", help="with it: a zip for each student of this table")
    make.set_defaults(run=_release)

    paper = commands.add_parser("handout", help="print labs as PDF, with room to write answers (instructors)")
    paper.add_argument("labs", nargs="*", metavar="LAB", help="such as 01_cartesian_ekf (default: all)")
    paper.add_argument("out", metavar="OUT", help="the folder for them")
    paper.set_defaults(run=_handout)

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


def _release(args):
    from .authoring import release

    if not args.roster:
        return release.main(args.out, args.force, args.variants or "")
    from .policy import variants

    return variants.main(Path(args.out), args.force, args.variants or "", args.roster)


def _handout(args):
    from .handout import command

    return command.main(args.labs, args.out)


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
