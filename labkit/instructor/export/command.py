"""`labkit export`: write what another grader needs into a folder."""

import importlib
from argparse import Namespace
from pathlib import Path

from .. import files
from ..authoring.release import Kit
from ..records import CommandError
from ..report.texts import counted
from ..trouble import ended, why
from . import ALLOWED, KEPT, KINDS


def main(args: Namespace) -> int:
    """Run `labkit export` with parsed arguments; returns the exit status."""
    return ended("labkit export", lambda: export(args))


def export(args: Namespace) -> None:
    """Write what args.kind of grader needs for args.labs into args.out. Raises CommandError and OSError."""
    kind = importlib.import_module(f"{__package__}.{KINDS[args.kind]}")
    out = _folder(args.out)
    kit = kind.files(list(dict.fromkeys(args.labs)), [name for name in ALLOWED if getattr(args, name)])
    written = write(kit, out, args.force)
    print(f"{args.out}: {counted(len(written), 'file')}. docs/elsewhere.md tells under `Other graders` how it goes on.")


def _folder(name):
    if Path(name).exists() and not Path(name).is_dir():
        raise CommandError(f"{name} is a file: name a folder.")
    return Path(name)


def write(kit: Kit, out: Path, force: bool = False) -> list[Path]:
    """Write files into a folder, which may have others; the paths.

    force: write over what is there, but for what is to be kept. Raises CommandError before anything is written.
    """
    todo = {path: data for path, data in kit.items() if Path(path).name not in KEPT or not (out / path).exists()}
    taken = [path for path in todo if (out / path).exists()]
    if taken and not force:
        raise CommandError(f"{out / taken[0]} is there already: name another folder, or write over it with --force.")
    for path, (data, mode) in todo.items():
        target = out / path
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise CommandError(f"{target.parent} cannot be made: {why(error)}.") from None
        files.write(target, data)
        target.chmod(mode)
    return [out / path for path in todo]
