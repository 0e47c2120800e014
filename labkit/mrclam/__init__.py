"""Real robots: one run of the UTIAS MRCLAM data sets as a Log.

Five robots drove among 15 landmarks and measured ranges and bearings with a camera; a motion
capture system knew where they were.  Source: see `labkit.mrclam.files`, which knows the files.
"""

from dataclasses import replace
from math import radians
from pathlib import Path
from typing import Any

import numpy as np

from ..geometry import Array, Seed, wrap
from ..history import truth_of
from ..log import Log
from ..recorded import DataError
from ..recorded.plain import GAP, at_times
from ..validation import is_number
from ..world import Landmark, Map, places
from . import example, install
from .files import FILES, PUBLISHED, ROBOTS, find_files, first_stamp, overlap, read_table, set_number, some


def load(robot: int, dataset: int = 7, **options: Any) -> Log:
    """Robot 1..5 of a data set as a Log; a simulated one where the data set is not at hand.

    The Log's `name` always says which of the two it is.  Further arguments: see `read`.
    """
    if dataset not in range(1, 10):
        raise ValueError(f"dataset must be one of 1 to 9, the published ones, but it is {dataset!r}")
    folder = install.find(f"MRCLAM_Dataset{dataset}")
    if folder:
        return read(folder, robot, **options)
    log = read(example.folder(), robot, **options)
    note = f"simulated, as there is no MRCLAM_Dataset{dataset} here (`labkit data` says where it goes)"
    return replace(log, name=f"simulated log in MRCLAM format, robot {robot}", notes=(note, *log.notes))


def read(
    folder: str | Path,
    robot: int = 1,
    rate: float = 10.0,
    start: float | None = None,
    duration: float | None = None,
    robots: bool = False,
) -> Log:
    """The run of one robot of an MRCLAM data set, in steps of 1/`rate` seconds, as a Log.

    folder:   of the set's files, or of a course's copy of them, such as Odometry.csv.  robot: 1..5.
    rate: steps per second.
    start, duration: [s] an excerpt; default from the first to the last moment that has both odometry
              and ground truth.  The clock of a set starts with its ground truth, the same for its five
              robots (odometry starts 6 to 16 s later), so that their steps coincide.
    robots:   keep measurements of the other robots too (ids 1..5, which are not in the map).

    The Log has frame 'robot', sensor 'rb' ([m], [rad] from the heading), controls (N, 2) forward
    velocity [m/s] and turn rate [rad/s], truth (N+1, 3) (x, y, theta) [m, m, rad], NaN within gaps of
    the ground truth longer than `GAP`, a map of the landmarks with their subject numbers as ids, and
    notes on what was left out.  A measurement belongs to the step whose end is nearest to its stamp.
    Raises ValueError for an argument that makes no sense, DataError for files that do not.
    """
    folder = Path(folder)
    if robot not in ROBOTS:
        raise ValueError(f"robot must be one of 1, 2, 3, 4, 5, but it is {robot!r}")
    for name, value in (("rate", rate), ("start", start), ("duration", duration)):
        if value is None and name != "rate":
            continue
        if value is None or not is_number(value) or (name != "start" and value <= 0):
            what = {"rate": "steps per second", "start": "seconds"}.get(name, "seconds, more than 0")
            raise ValueError(f"{name} must be a number of {what}, but it is {value!r}")
    tables, notes = _tables(folder, robot)
    return _log(folder, robot, tables, notes, rate, start, duration, robots)


def _log(folder, robot, tables, notes, rate, start, duration, robots):
    truth, odometry, seen, barcodes, places = tables
    zero = first_stamp(folder, truth[0, 0])
    for table in (truth, odometry, seen):
        table[:, 0] -= zero
    begin, end = overlap(truth, odometry)
    times = _steps(begin, end, rate, start, duration, robot)
    elsewhen = (seen[:, 0] < begin - 1 / rate) | (seen[:, 0] > end + 1 / rate)
    if elsewhen.any():
        notes.append(
            f"{elsewhen.sum()} of {some(len(seen), 'measurement')} left out: from {seen[elsewhen, 0].min():.1f} s to "
            f"{seen[elsewhen, 0].max():.1f} s, but odometry and ground truth share {begin:.1f} s to {end:.1f} s"
        )
    if odometry[-1, 0] > truth[-1, 0] + 1 and duration is None:
        early = odometry[-1, 0] - truth[-1, 0]
        notes.append(f"the ground truth ends {early:.1f} s before the odometry, and the log with it")
    pose = _poses(times, truth, notes)
    step = np.rint((seen[:, 0] - times[0]) * rate).astype(int) - 1
    here = (step >= 0) & (step < len(times) - 1)
    step, seen = step[here], seen[here]
    seen[:, 3] = wrap(seen[:, 3])
    subject, kept = _subjects(seen, barcodes, places, robots, notes)
    number = set_number(folder.resolve().name)
    return Log(
        times,
        _mean_rates(times, odometry, notes),
        step[kept],
        subject[kept],
        seen[kept, 2:],
        Map(Landmark(p, int(i)) for i, *p in places[:, :3]),
        sensor="rb",
        frame="robot",
        truth=pose,
        notes=tuple(notes),
        name=f"MRCLAM set {number}, robot {robot}" if number else f"{folder.name}, robot {robot}",
    )


def with_compass(log: Log, sigma: float = radians(2), rng: Seed = None) -> Log:
    """The same run for a filter that estimates the position only: the heading comes from a compass.

    The compass is the true heading (held or interpolated where unknown) plus white noise of standard
    deviation `sigma` [rad], read once a step, at its end; it turns both the step's velocity and its
    bearings into the world frame.  The Log has frame 'world', controls (vx, vy) [m/s], measurements
    (range [m], bearing in the world frame [rad]) and truth (N+1, 2) [m].
    rng: a numpy Generator, or a seed for one.
    """
    if log.frame != "robot" or log.truth is None or log.truth.shape[1] < 3:
        raise ValueError(f"a compass needs a log with a true heading; '{log.name}' has none")
    if not (is_number(sigma) and sigma >= 0):
        raise ValueError(f"sigma must be a number of radians, 0 or more, but it is {sigma!r}")
    known = np.isfinite(truth_of(log)[:, 2])
    theta = np.interp(log.times[1:], log.times[known], np.unwrap(log.truth[known, 2]))
    theta = theta + sigma * np.random.default_rng(rng).standard_normal(len(log))
    velocity = log.controls[:, :1] * np.column_stack([np.cos(theta), np.sin(theta)])
    seen = log.seen.copy()
    seen[:, 1] = wrap(seen[:, 1] + theta[log.seen_step])
    note = f"heading from a compass: ground truth with {np.rad2deg(sigma):.1f} degrees of noise"
    return replace(
        log, controls=velocity, seen=seen, frame="world", truth=log.truth[:, :2].copy(), notes=(*log.notes, note)
    )


def with_odometry(log: Log) -> Log:
    """The same run for a filter that is told how far the robot came in each step, not its velocity.

    The Log has controls (N, 3) as of a robot with legs: ahead [m], to the left [m], turned [rad]; a step is an arc
    of a circle, which here is a straight line in the direction halfway through the turn.
    """
    if log.frame != "robot" or log.controls.shape[1] != 2:
        raise ValueError(f"odometry comes from forward velocity and turn rate; '{log.name}' has others")
    v, turn = (log.controls * np.diff(log.times)[:, None]).T
    return replace(log, controls=np.column_stack([v * np.cos(turn / 2), v * np.sin(turn / 2), turn]))


def range_errors(log: Log) -> Array:
    """(M,) [m] by how much each range was too long; NaN where the truth is unknown, ValueError if it is throughout."""
    if log.sensor != "rb":
        raise ValueError(f"the log '{log.name}' has no ranges: its sensor is '{log.sensor}'")
    offset = places(log.map, log.seen_id) - truth_of(log)[log.seen_step + 1, :2]
    return log.seen[:, 0] - np.linalg.norm(offset, axis=1)


def _tables(folder, robot):
    names = [f"Robot{robot}_{kind}.dat" for kind in ("Groundtruth", "Odometry", "Measurement")]
    names += ["Barcodes.dat", "Landmark_Groundtruth.dat"]
    files = find_files(folder)
    missing = [name for name in names if name not in files]
    if missing:
        lacks = "lacks" if folder.is_dir() else "is no folder with"
        raise DataError(f"{folder} {lacks} {', '.join(missing)}. {PUBLISHED}")
    tables, notes = [], []
    for name in names:
        rows, said = read_table(files[name], name)
        notes += said
        if not len(rows) and "Measurement" in name:
            notes.append(f"{name} has no rows: robot {robot} saw nothing")
        elif not len(rows):
            raise DataError(f"{files[name]} has no rows. {PUBLISHED}")
        tables.append(rows)
    for name, rows, column in zip(names[3:], tables[3:], (1, 0)):
        values, count = np.unique(rows[:, column], return_counts=True)
        if (count > 1).any():
            twice = values[count > 1][0]
            raise DataError(f"{files[name]}: {FILES[name][column]} {twice:g} occurs twice")
    return tables, notes


def _steps(begin, end, rate, start, duration, robot):
    """The log's times (N+1,) [s]: from `start`, or else multiples of 1/rate, so that robots' steps coincide."""
    first = np.ceil(begin * rate) / rate if start is None or start < begin else float(start)
    last = end if duration is None else min(end, first + duration)
    n = int((last - first) * rate + 1e-6)
    if n >= 1:
        return first + np.arange(n + 1) / rate
    if not end - begin > 1 / rate:
        raise DataError(f"odometry and ground truth of robot {robot} share no time: are they of the same run?")
    raise ValueError(
        f"robot {robot} drives from {begin:.1f} s to {end:.1f} s: there is no step of {1 / rate:g} s "
        f"in the excerpt with start = {start} and duration = {duration}"
    )


def _mean_rates(times, odometry, notes):
    """Mean velocities (N, 2) of each step by the trapezoid rule.

    A gap of the odometry so counts with the mean of the commands before and after it.  Holding the
    last one makes lab 3's filter a fifth worse on robot 4 of set 7, which has most gaps, and helps none.
    """
    t, rates = odometry[:, 0], odometry[:, 1:]
    area = np.vstack([np.zeros(2), np.cumsum((rates[1:] + rates[:-1]) / 2 * np.diff(t)[:, None], axis=0)])
    gaps = np.diff(t)[(t[1:] > times[0]) & (t[:-1] < times[-1])]
    if (gaps > GAP).any():
        found = some(int((gaps > GAP).sum()), "gap")
        notes.append(f"odometry has {found} longer than {GAP} s, the longest {gaps.max():.1f} s: bridged")
    return np.diff(np.column_stack([np.interp(times, t, a) for a in area.T]), axis=0) / np.diff(times)[:, None]


def _poses(times, truth, notes):
    """True poses (N+1, 3), interpolated; the heading without jumps from pi to -pi in between."""
    poses, unknown = at_times(times, truth[:, 0], truth[:, 1:])
    if unknown.any():
        notes.append(f"ground truth unknown at {unknown.sum()} of {len(times)} times (gaps longer than {GAP} s)")
    return poses


def _subjects(seen, barcodes, places, robots, notes):
    """Which subject (M,) each measurement is of, and which of them to keep (M,); notes on the others."""
    order = np.argsort(barcodes[:, 1], kind="stable")
    subjects, codes = barcodes[order].T
    at = np.searchsorted(codes, seen[:, 1]).clip(max=len(codes) - 1)
    subject = np.where(codes[at] == seen[:, 1], subjects[at], 0).astype(int)
    if len(seen) and (subject > 0).mean() < 0.5 < np.isin(seen[:, 1], subjects).mean():
        subject = seen[:, 1].astype(int)
        notes.append("the measurements have subjects in place of barcodes")
    other = np.isin(subject, ROBOTS)
    unknown = ~other & ~np.isin(subject, places[:, 0])
    impossible = seen[:, 2] <= 0
    mapless = unknown & (subject > 0)
    unknown = unknown & (subject == 0)
    lost = ", ".join(map(str, np.unique(subject[mapless])))
    codes = np.unique(seen[unknown, 1])
    which = f"unknown barcode{'s' if len(codes) > 1 else ''} {', '.join(f'{code:g}' for code in codes)}"
    for left_out, what in [
        (unknown, f"with {which}"),
        (mapless, f"of landmark {lost}, which Landmark_Groundtruth.dat lacks,"),
        (other & (not robots), "of other robots"),
        (impossible, "with a range that is not positive"),
    ]:
        if left_out.any():
            notes.append(f"{some(int(left_out.sum()), 'measurement')} {what} left out")
    nameless = [f"{i:g}" for i in places[:, 0] if i not in subjects]
    if nameless:
        notes.append(f"no barcode in the table for landmark {', '.join(nameless)}: never recognised")
    return subject, ~unknown & ~mapless & ~impossible & (~other | bool(robots))
