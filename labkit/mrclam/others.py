"""Taking in single runs: a course's copy of a robot's files, Freiburg's log, a run in the plain form."""

import shutil
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import IO

from ..log import Log
from ..recorded import DataError, folder, freiburg, plain
from .files import ROBOTS, find_files, set_number, some, standard

FORMS = {"the log of Freiburg's course": freiburg.FILES, "a run in the plain form": plain.NEEDED}
FURTHER = ("truth.csv", "about.json")


def wanted(name: str) -> bool:
    """Whether a file may be one of those that are read here."""
    return standard(name) is not None or any(name in files for files in (*FORMS.values(), FURTHER))


def known(names: Iterable[str]) -> bool:
    """Whether files of these names are a run, or what is left of one."""
    marks = ["Odometry.dat", *(name for files in FORMS.values() for name in files)]
    return any((standard(name) or name).endswith(mark) for name in names for mark in marks)


def runs(place: Path) -> dict[str, tuple[str, Log]]:
    """{name: (what it is, Log)} of the runs in a folder; DataError for what is spoilt."""
    from . import read  # which itself needs what takes data in

    name = f"{place.name} run" if set_number(place.name) else place.name  # such a name is kept for the whole set
    for what, files in FORMS.items():
        if any((place / file).is_file() for file in files):
            return {name: (what, Log.load(place))}
    robots = [r for r in ROBOTS if f"Robot{r}_Odometry.dat" in find_files(place)]
    names = [name] if len(robots) == 1 else [f"{name} robot {r}" for r in robots]
    return {own: ("a course's copy of MRCLAM", read(place, r)) for own, r in zip(names, robots)}


def take(name: str, files: dict[str, Callable[[], IO[bytes]]]) -> list[str]:
    """Read a folder's files, {name: function that opens it}, and save their runs as folders of the data folder.

    A sentence for each: what it is and how it is loaded.  One that is there already stays.
    """
    said = []
    with tempfile.TemporaryDirectory(prefix="labkit-data-") as incoming:
        place = Path(incoming, name)
        place.mkdir()
        for file, opened in files.items():
            with opened() as source, open(place / file, "wb") as copy:
                shutil.copyfileobj(source, copy)
        try:
            found = runs(place)
        except (DataError, ValueError) as error:
            raise DataError(str(error).replace(str(place), name)) from None
    for own, (what, log) in found.items():
        target = folder() / own
        there = target.exists()
        if not there:
            log.save(target)
        where = f"it was already in {target} and stays as it is" if there else f"now in {target}"
        said += [
            f"{own}: {what}, {some(len(log), 'step')} in {log.times[-1] - log.times[0]:.4g} s, "
            f"{some(len(log.map), 'landmark')}, {some(len(log.seen), 'measurement')}; {where}",
            *(f"  note: {note}" for note in log.notes),
            f"  in a notebook: log = Log.load({own!r})   (from labkit import Log)",
        ]
    return said
