"""In the worker of a probe: keep as much in files as one can get, wherever a file can be made at all."""

import os
from contextlib import suppress
from pathlib import Path

HELD: list[int] = []  # files that stay open, so that who looks from outside sees what they keep


def fill(what: str, places: list[str], most: int) -> dict[str, int]:
    """How much it got, in all file systems together, and keeps: {"kept": number}. It may be stopped before.

    what: 'bytes' in open files that are deleted, or empty 'files';  places: folders to try beside those that it
    finds;  most: how much to try for.
    """
    while HELD:
        os.close(HELD.pop())
    kept = 0
    for place in _writable(places):
        with suppress(OSError):  # no more here
            while kept < most:
                path = os.path.join(place, f"labkit-probe-{kept}")
                file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
                if what == "files":
                    os.close(file)
                    kept += 1
                    continue
                os.remove(path)
                HELD.append(file)
                for _ in range(32):
                    kept += os.write(file, bytes(2**20))
    return {"kept": kept}


def _writable(places):
    """Folders in which a file can be made, one of each file system."""
    found: dict[int, str] = {}
    for place in dict.fromkeys([os.getcwd(), *places, *around()]):
        path = os.path.join(place, "labkit-probe")
        with suppress(OSError):
            os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
            os.remove(path)
            found.setdefault(os.stat(place).st_dev, place)
    return found.values()


def around() -> list[str]:
    """Folders up to two steps below the root, and those where file systems are mounted."""
    first = ["/", *_inside("/")]
    found = first + [below for path in first[1:] for below in _inside(path)]
    with suppress(OSError):
        found += [line.split()[4] for line in Path("/proc/self/mountinfo").read_text().splitlines()]
    return found


def _inside(folder):
    with suppress(OSError), os.scandir(folder) as entries:
        return [entry.path for entry in entries if entry.is_dir(follow_symlinks=False)]
    return []
