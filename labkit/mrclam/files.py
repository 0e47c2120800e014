"""The files of an MRCLAM data set: their names and columns, reading, writing and verifying them.

Source: K. Leung, Y. Halpern, T. Barfoot, H. Liu, "The UTIAS multi-robot cooperative localization
and mapping dataset", IJRR 30(8), 969-974, 2011.
"""

import re
from itertools import islice
from pathlib import Path

import numpy as np

from ..geometry import Array
from ..recorded import DataError, text_of

PUBLISHED = (
    "The UTIAS Multi-Robot Cooperative Localization and Mapping (MRCLAM) data sets are published at "
    "asrl.utias.utoronto.ca/datasets/mrclam (Leung, Halpern, Barfoot, Liu, IJRR 30(8), 2011)."
)
ROBOTS = range(1, 6)  # subjects 1..5 are the robots, 6..20 the landmarks
CLOCK = "time [s]"
FILES = {
    "Barcodes.dat": ("subject", "barcode"),
    "Landmark_Groundtruth.dat": ("subject", "x [m]", "y [m]", "std of x [m]", "std of y [m]"),
}
for _r in ROBOTS:
    FILES[f"Robot{_r}_Groundtruth.dat"] = (CLOCK, "x [m]", "y [m]", "orientation [rad]")
    FILES[f"Robot{_r}_Odometry.dat"] = (CLOCK, "forward velocity [m/s]", "turn rate [rad/s]")
    FILES[f"Robot{_r}_Measurement.dat"] = (CLOCK, "barcode", "range [m]", "bearing [rad]")
UNITS = {  # {unit: (what no robot in a hall reaches, the unit that such numbers may be in)}
    "[m]": (100.0, "millimetres"),
    "[m/s]": (10.0, "millimetres per second"),
    "[rad]": (2 * np.pi, "degrees"),
    "[rad/s]": (2 * np.pi, "degrees per second"),
}
BACK = 1.0  # [s] rows out of order by less than this are a logger's jitter and are sorted
COURSE = re.compile(  # names of courses' copies: 'Odometry.csv', 'ds1_Measurement.dat', 'Robot2_Groundtruth.csv'
    r"(?:[a-z0-9]+_)??(?:robot([1-5])_)?(odometry|control|measurement|groundtruth|landmark_groundtruth|barcodes)"
    r"\.(?:csv|dat|txt)",
    re.IGNORECASE,
)


def set_number(name: str | Path) -> int | None:
    """The number 1..9 that 'MRCLAM_Dataset7', 'mrclam dataset7 (1).zip' ... stand for, or None."""
    found = re.search(r"mrclam[ _-]*(?:data[ _-]*set)?[ _-]*([1-9])(?!\d)", str(name), re.IGNORECASE)
    return int(found[1]) if found else None


def standard(name: str) -> str | None:
    """The published name of a file of a course's copy: 'Robot1_Odometry.dat' for 'Odometry.csv'; None for another."""
    found = COURSE.fullmatch(name)
    if not found:
        return None
    kind = found[2].title().replace("Control", "Odometry")
    return f"{kind}.dat" if kind in ("Barcodes", "Landmark_Groundtruth") else f"Robot{found[1] or 1}_{kind}.dat"


def find_files(folder: Path) -> dict[str, Path]:
    """{published name: the file} of a data set, or of a course's copy; the published name, then the shortest, first."""
    paths = sorted((p for p in folder.glob("*.*") if p.is_file()), key=lambda p: (p.name not in FILES, len(p.name)))
    files: dict[str, Path] = {}
    for path in paths:
        if name := standard(path.name):
            files.setdefault(name, path)
    return files


def read_table(path: str | Path, name: str = "") -> tuple[Array, list[str]]:
    """One file of a set, or of a course's copy: its rows (n, columns) as numbers, and notes on what was put right.

    Comments (#), a byte order mark and Windows line ends are fine, and so is a file without rows.  So are commas or
    semicolons between the numbers, and a line of words above them.
    Put right, with a note: a last line cut off in the middle is dropped, rows with NaN or infinity
    are dropped, rows less than `BACK` out of order are sorted by time.  Noted and left as they are: numbers
    too large for their unit.  DataError names the file and
    the line for anything else: unreadable, no text, words, a wrong number of columns, times running
    backwards by more (a clock that was set during the run: nothing tells what came first).
    """
    path, notes = Path(path), []
    columns = FILES[name or path.name]
    *lines, rest = _without_commas(text_of(path).split("\n"), columns, path)
    if _is_row(rest, columns):
        lines.append(rest)
    elif rest.strip():
        notes.append(f"{path.name} ends in the middle of a line, which is left out")
    rows = _numbers(lines, columns, path)
    good = np.isfinite(rows).all(axis=1)
    if not good.all():
        where = " or ".join(name for name, bad in zip(columns, ~np.isfinite(rows).all(axis=0)) if bad)
        rows = rows[good]
        notes.append(f"{some(int((~good).sum()), 'row')} of {path.name} left out: {where} is NaN or infinite")
    notes += _doubts(rows, columns, path)
    if columns[0] == CLOCK and len(rows) > 1:
        step = np.diff(rows[:, 0])
        if step.min() < -BACK:
            raise DataError(
                f"{path}: the times run backwards by {-step.min():.1f} s after the row that starts "
                f"with {rows[step.argmin(), 0]:.3f}: two recordings in one file, or a clock that was set?"
            )
        if step.min() < 0:
            rows = rows[np.argsort(rows[:, 0], kind="stable")]
            notes.append(f"{some(int((step < 0).sum()), 'row')} of {path.name} out of order: sorted by time")
    return rows, notes


def _without_commas(lines, columns, path):
    """The lines of a course's CSV as those of the published files: spaces for commas, its line of words left empty."""
    top = "".join(line.split("#")[0] for line in lines[:20])
    if path.suffix == ".dat" and not {",", ";"} & set(top):
        return lines
    if top.startswith((",", '"",')):  # pandas' numbers of the rows
        lines = [line.partition(",")[2] for line in lines]
    marks = str.maketrans({",": ".", ";": " "} if ";" in top else {",": " "})
    lines = [line.translate(marks) for line in lines]
    first = next((k for k, line in enumerate(lines) if line.split("#")[0].strip()), None)
    if first is not None and not _is_row(lines[first], columns) and re.match(r"\s*[\"'A-Za-z]", lines[first]):
        if unit := re.search(r"(?<![A-Za-z])(mm|cm|ms|deg|degrees)(?![A-Za-z])", lines[first]):
            due = ", ".join(columns)
            raise DataError(f"{path}: line {first + 1} has a column in {unit[1]}; those of MRCLAM are {due}")
        lines[first] = ""
    if columns[0] == "subject" and len(columns) == 5:  # a copy may leave out the last two, which nothing uses
        lines = [line + " 0 0" if len(line.split()) == 3 and "#" not in line else line for line in lines]
    return lines


def _doubts(rows, columns, path):
    """A note on each column whose numbers are too large for its unit."""
    for name, most in zip(columns, abs(rows).max(axis=0, initial=0.0)):
        unit = name[name.find("[") :]
        limit, other = UNITS.get(unit, (np.inf, ""))
        if most > limit:
            yield f"{name} of {path.name} goes up to {most:.4g}: are these {other}? It was taken in {unit}"


def _numbers(lines, columns, path):
    if not any(line.split("#")[0].strip() for line in lines):
        return np.empty((0, len(columns)))
    try:
        rows = np.loadtxt(lines, ndmin=2)
        if rows.shape[1] == len(columns):
            return rows
        reason = ""
    except ValueError as error:
        reason = str(error)
    for number, line in enumerate(lines, 1):  # the slow way, to tell which line it is
        if line.split("#")[0].strip() and not _is_row(line, columns):
            reason = f"line {number} should be {len(columns)} numbers ({', '.join(columns)}), but it is {line[:60]!r}"
            break
    raise DataError(f"{path}: {reason}")


def _is_row(line, columns):
    try:
        return len([float(word) for word in line.split("#")[0].split()]) == len(columns)
    except ValueError:
        return False


def some(count: int, thing: str) -> str:
    """'1 row', '2 rows'."""
    return f"{count} {thing}{'' if count == 1 else 's'}"


def write_set(folder: str | Path, tables: dict[str, Array]) -> None:
    """Write `tables`, {file name: rows (n, columns)}, into `folder` in the format of the data set."""
    styles = {CLOCK: "%.3f", "subject": "%d", "barcode": "%d"}
    for name, rows in tables.items():
        columns = FILES[name]
        style = [styles.get(column, "%.6f") for column in columns]
        header = "Written by labkit in the format of the UTIAS MRCLAM data sets\n" + "    ".join(columns)
        np.savetxt(Path(folder) / name, np.reshape(rows, (-1, len(columns))), style, "\t", header=header)


def verify(folder: str | Path) -> str:
    """What a data set holds, in a sentence; DataError lists all that is wrong with it.

    Checked: all 17 files are there, whole, with the right columns, times in order and enough rows,
    and each robot's odometry and ground truth overlap.
    """
    folder, wrong, rows = Path(folder), [], {}
    missing = [name for name in FILES if not (folder / name).is_file()]
    if missing:
        wrong.append(f"missing: {', '.join(missing)}")
    for name in FILES.keys() - missing:
        try:
            rows[name], notes = read_table(folder / name)
        except DataError as error:
            wrong.append(str(error).replace(str(folder / name), name))
            continue
        wrong += [note for note in notes if "middle" in note]
        if len(rows[name]) < 2 and not name.endswith("Measurement.dat"):
            wrong.append(f"{name} has no rows")
    if wrong:
        raise DataError(f"{folder.name} is not whole.\n" + "\n".join(f"  {w}" for w in sorted(wrong)))
    spans = []
    for r in ROBOTS:
        begin, end = overlap(rows[f"Robot{r}_Odometry.dat"], rows[f"Robot{r}_Groundtruth.dat"])
        if not end > begin:
            raise DataError(f"{folder.name}: odometry and ground truth of robot {r} share no time")
        spans.append(end - begin)
    seen = sum(len(rows[f"Robot{r}_Measurement.dat"]) for r in ROBOTS)
    early = [f"robot {r} {(max(spans) - s) / 60:.1f}" for r, s in zip(ROBOTS, spans) if s < max(spans) - 30]
    return (
        f"{folder.name}: {len(ROBOTS)} robots, {len(rows['Landmark_Groundtruth.dat'])} landmarks, "
        f"{max(spans) / 60:.1f} minutes, {seen} measurements, verified"
        + (f" (shorter, by minutes: {', '.join(early)})" if early else "")
    )


def overlap(*tables: Array) -> tuple[float, float]:
    """(begin, end) [s] of the time in which all `tables` (n, columns), with the time in front, have rows."""
    return max(table[0, 0] for table in tables), min(table[-1, 0] for table in tables)


def first_stamp(folder: str | Path, own: float) -> float:
    """Stamp [s] of the first ground truth of any robot of the set; `own` is that of one robot."""
    stamps = [own]
    for name, path in [pair for pair in find_files(Path(folder)).items() if re.match("Robot._Ground", pair[0])]:
        try:
            with open(path, encoding="utf-8-sig") as file:
                lines = _without_commas(list(islice(file, 20)), FILES[name], path)
            stamps.append(float(next(line for line in lines if line.strip() and line[0] != "#").split()[0]))
        except (OSError, ValueError, StopIteration, DataError):
            continue  # another robot's spoilt file: told when that robot is read
    return np.nanmin(stamps)
