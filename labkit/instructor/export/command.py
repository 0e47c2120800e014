"""`labkit export`: write what another grader needs into a folder."""

import importlib
import sys
from argparse import Namespace
from pathlib import Path

from .. import files
from ..authoring.release import Kit
from ..records import CommandError
from ..report.texts import counted
from ..trouble import sentence, why
from . import ALLOWED, KEPT, KINDS


def main(args: Namespace) -> int:
    """Run `labkit export` with parsed arguments; returns the exit status."""
    try:
        kind = importlib.import_module(f"{__package__}.{KINDS[args.kind]}")
        out = _folder(args.out)
        kit = kind.files(list(dict.fromkeys(args.labs)), [name for name in ALLOWED if getattr(args, name)])
        written = write(kit, out, args.force)
    except CommandError as problem:
        print(f"labkit export: {problem}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"labkit export: {sentence(error)}", file=sys.stderr)
        return 2
    print(f"{args.out}: {counted(len(written), 'file')}. docs/elsewhere.md tells under `Other graders` how it goes on.")
    return 0


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
