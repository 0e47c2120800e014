"""The log of Freiburg's robot-mapping course: world.dat (id x y), and sensor_data.dat with lines of two kinds.

ODOMETRY r1 t r2 is a step: the robot turns by r1 [rad], goes t [m], turns by r2 [rad].  SENSOR id range bearing, below
it, is what it then saw: [m], and [rad] from its heading.  There is no clock: a step counts as a second.
"""

from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from ..geometry import wrap
from . import DataError, text_of
from .plain import PLACES, SEEN, seen_in
from .tables import Table

FILES = ("world.dat", "sensor_data.dat")
NOTES = (
    "no clock in the log: each step counts as 1 s",
    "no ground truth in the log: where the robot starts is not in it either, (0, 0, 0) perhaps",
)


def fields(folder: Path) -> dict[str, Any]:
    """The fields of the Log, its odometry as of a robot with legs (ahead, left, turned), which is the same motion."""
    if lacking := [name for name in FILES if not (folder / name).is_file()]:
        raise DataError(f"{folder} lacks {', '.join(lacking)}: the course has both, world.dat is the map")
    world, log = (folder / name for name in FILES)
    places = [(n, int(i), p) for n, _, (i, *p) in _lines(world, {"": ("id", "x", "y")})]
    moves, seen = [], []
    for number, word, values in _lines(log, {"ODOMETRY": ("r1", "t", "r2"), "SENSOR": ("id", "range", "bearing")}):
        if word == "ODOMETRY":
            moves.append(values)
        elif moves:
            seen.append((number, int(values[0]), [len(moves), *values[1:]]))
        else:
            raise DataError(f"{log}, line {number}: a line SENSOR before the first ODOMETRY is of no step")
    if not moves:
        raise DataError(f"{log} has no line ODOMETRY")
    times, (r1, t, r2) = np.arange(len(moves) + 1.0), np.array(moves).T
    return {
        "times": times,
        "controls": np.column_stack([t * np.cos(r1), t * np.sin(r1), wrap(r1 + r2)]),
        **seen_in(_table(log, next(iter(SEEN)), seen), times, _table(world, PLACES, places)),
        "sensor": "rb",
        "frame": "robot",
        "name": folder.resolve().name,
        "notes": NOTES,
    }


def _table(path, columns, rows):
    numbers = np.array([values for _, _, values in rows], dtype=float).reshape(-1, len(columns) - 1)
    return Table(path, columns, [n for n, _, _ in rows], [i for _, i, _ in rows], numbers)


def _lines(path, kinds):
    """(line number, first word, its three numbers) of each line; kinds: {first word: what the numbers are}."""
    for number, line in enumerate(text_of(path).splitlines(), 1):
        words = line.split("#")[0].split()
        if not words:
            continue
        word = "" if "" in kinds else words.pop(0)
        try:
            values = [float(text) for text in words]
        except ValueError:
            values = []
        if word not in kinds or len(values) != 3 or not np.isfinite(values).all():
            due = " or ".join(" ".join((kind, *names)).strip() for kind, names in kinds.items())
            raise DataError(f"{path}, line {number}: it should be {due}, but it is {line.strip()[:60]!r}")
        for name, value in zip(kinds[word], values):
            if name in ("r1", "r2", "bearing") and abs(value) > 2 * pi:
                raise DataError(f"{path}, line {number}: {name} is {value:g}, more than a turn: it must be in radians")
            if name == "id" and value != int(value):
                raise DataError(f"{path}, line {number}: an id must be a whole number, but it is {value:g}")
        yield number, word, values
