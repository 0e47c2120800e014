"""`labkit new`: a small lab of one's own, from which its author goes on."""

import re
import sys
from pathlib import Path

from .. import files
from ..records import CommandError

ROOT = Path(__file__).resolve().parents[3]
TEMPLATE = Path(__file__).with_name("template")


def write(root: Path, name: str) -> list[Path]:
    """Write the sources of a new lab under `root`: the lab's and its checks'; the paths.

    name: such as '09_my_lab'. Raises CommandError for a name that will not do, or a lab that is there.
    """
    number, title = _parts(name)
    taken = [path.stem for path in (root / "solutions").glob("[0-9]*_*.py") if path.name.startswith(f"{number}_")]
    if taken:
        raise CommandError(f"Lab {int(number)} is there already, {taken[0]}: take another number.")
    # A module of Python cannot begin with a digit.
    targets = {"lab": root / "solutions" / f"{name}.py", "checks": root / "solutions" / "checks" / f"{title}.py"}
    if targets["checks"].exists():
        raise CommandError(f"solutions/checks/{title}.py is there already: give the lab another name.")
    words = {"NUMBER": str(int(number)), "NAME": name, "TITLE": _spoken(title), "CHECK": title.replace("_", "-")}
    for part, target in targets.items():
        text = (TEMPLATE / f"{part}.txt").read_text(encoding="utf-8")
        files.write(target, re.sub(r"\b(NUMBER|NAME|TITLE|CHECK)\b", lambda word: words[word[0]], text))
    return list(targets.values())


def _parts(name):
    """('09', 'my_lab') of '09_my_lab'."""
    found = re.fullmatch(r"(\d\d)_([a-z][a-z0-9_]*)", name)
    if not found:
        raise CommandError(f"{name!r} is no name of a lab: two digits, '_' and small letters, such as 09_my_lab.")
    return found.groups()


def _spoken(title):
    return title.replace("_", " ").strip().capitalize()


def main(name: str) -> int:
    """Write the sources of a lab and say what comes next; exit status."""
    try:
        paths = write(ROOT, name)
    except CommandError as error:
        print(error, file=sys.stderr)
        return 2
    print("\n".join(f"{path.relative_to(ROOT).as_posix()} is written." for path in paths))
    print(f"Change them as you like, then: python3 lab.py build {name}   (docs/own-lab.md says how)")
    return 0
