"""Which sandbox to use, and what to say about it; `labkit sandbox`."""

import argparse
import contextlib
import os
import sys
from collections.abc import Generator

from .. import folders
from ..records import CommandError
from . import levels, probe
from .launch import Sandbox, make_runtime

CLOSED = 3  # the level from which a sandbox is closed


def look() -> Generator[levels.Found, None, None]:
    """What levels.find finds on this machine, the best first. Raises CommandError on Windows."""
    if os.name == "nt":
        raise CommandError(
            "Grading runs students' code in a sandbox that Windows does not have: use Linux, or WSL on Windows."
        )
    with folders.temporary("sandbox") as folder:
        yield from levels.find(make_runtime(os.path.join(folder, "runtime")))


def choose(args: argparse.Namespace) -> Sandbox:
    """The best Sandbox of this machine that the options allow; says which. Raises CommandError if there is none."""
    most, found = 4 if args.level is None else args.level, []
    with contextlib.closing(look()) as ways:  # when Python itself closes it, a Ctrl-C in its last lines is lost
        for one in ways:
            found += [one.sandbox] if one.sandbox and one.sandbox.level <= most else []
            if found and found[-1].level >= min(most, CLOSED):  # no other way is more closed
                break
    if not found:
        raise CommandError("No sandbox can be used here: `labkit sandbox` tells why.")
    best = max(found, key=lambda sandbox: sandbox.level)
    if best.level == 0 and not args.trust_students:
        raise CommandError(
            "There is no sandbox here that holds, so students' code could read and change your files. Install "
            "bubblewrap (on Debian and Ubuntu: sudo apt install bubblewrap), or, if you trust every student with your "
            "account, give --trust-students. `labkit sandbox` tells more."
        )
    if best.level == 1 and not args.weak_sandbox:
        raise CommandError(
            "Only a weak sandbox can be used here (level 1): `labkit sandbox` tells what is open. Install bubblewrap, "
            "or give --weak-sandbox if that will do."
        )
    print(f"Sandbox level {best.level}: {levels.WORDS[best.level]}; 2 GiB, {args.total:g} s for each submission.")
    if best.level < 3:
        print("Warning: install bubblewrap for a closed sandbox; `labkit sandbox` tells what is open in this one.")
    return best


def table() -> int:
    """Print what each way of shutting code in keeps; exit status 0 if there is a level of 2 or more, else 1."""
    try:
        found = list(look())
    except CommandError as problem:
        print(f"labkit sandbox: {problem}", file=sys.stderr)
        return 2
    for one in found:
        print(f"{one.way}: {f'level {one.sandbox.level}' if one.sandbox else f'cannot be used: {one.why}'}")
    ways = [one for one in found if one.sandbox]
    if ways:
        print()
        width = max(len(words) for words, _ in probe.PROMISES.values())
        print(" " * (width + 9), *(f"{one.way} " for one in ways), "tried with")
        for name, (words, tried) in probe.PROMISES.items():
            cells = (("yes" if name in one.held else "NO").center(len(one.way)) for one in ways)
            print(f"A worker {words:{width}}", *(f"{cell} " for cell in cells), tried)
    best = max((one.sandbox.level for one in found if one.sandbox), default=0)
    print(f"\nlabkit grade uses level {best}: {levels.WORDS[best]}.")
    return 0 if best >= 2 else 1
