"""The plain form of a recorded run, a folder of CSV files with units in their headers: `help(Log.save)` says which."""

import json
import shutil
import tempfile
from numbers import Integral
from pathlib import Path
from typing import Any

import numpy as np

from ..geometry import Array, wrap
from ..validation import as_numbers, is_number
from ..world import Landmark, Map
from . import DataError, text_of
from .tables import Table, as_id, read, write

STEPS: dict[tuple[str, ...], str] = {  # {columns: the frame that bearings are in, unless about.json says it}
    ("start [s]", "end [s]", "ahead [m]", "left [m]", "turned [rad]"): "robot",
    ("start [s]", "end [s]", "forward [m/s]", "turn rate [rad/s]"): "robot",
    ("start [s]", "end [s]", "vx [m/s]", "vy [m/s]"): "world",
}
SEEN: dict[tuple[str, ...], str] = {
    ("time [s]", "id", "range [m]", "bearing [rad]"): "rb",
    ("time [s]", "id", "dx [m]", "dy [m]"): "xy",
}
PLACES = ("id", "x [m]", "y [m]")
TRUTH: list[tuple[str, ...]] = [("time [s]", "x [m]", "y [m]", "heading [rad]"), ("time [s]", "x [m]", "y [m]")]
ABOUT = {  # {key: (what it must be, whether a value is that)}; others are ids that are seen though no landmarks
    "name": ("a text", lambda value: isinstance(value, str)),
    "frame": ("'world' or 'robot'", lambda value: value in ("world", "robot")),
    "range": ("a number of metres above 0", lambda value: (is_number(value) or value == np.inf) and value > 0),
    "Q": ("rows of numbers", lambda value: as_numbers(value, "Q").ndim == 2),
    "R": ("rows of numbers", lambda value: as_numbers(value, "R").ndim == 2),
    "notes": ("a list of texts", lambda value: all(isinstance(note, str) for note in [*value])),
    "others": ("a list of ids", lambda value: all(isinstance(i, int | str) for i in [*value])),
}
GAP = 0.5  # [s] the truth is interpolated across shorter gaps, and unknown (NaN) in longer ones
MANY = 15  # times as much turning as the truth has no wheels slip, but degrees taken for radians are 57 times as much
NEEDED = ("steps.csv", "measurements.csv", "landmarks.csv")


def save(log: Any, folder: str | Path) -> Path:
    """Write a Log into a new folder, whose path is given back; ValueError for what the plain form does not hold."""
    folder = Path(folder).expanduser()
    ways = {(3, "robot"): 0, (3, "world"): 0, (2, "robot"): 1, (2, "world"): 2}
    way = ways.get((log.controls.shape[1], log.frame))
    if way is None or not len(log) or (log.truth is not None and log.truth.shape[1] not in (2, 3)):
        raise ValueError("the plain form has steps, their controls two or three numbers, and as truth (x, y) or a pose")
    ids, seen = log.map.ids, log.seen_id.tolist()
    if strange := [
        i for i in (*ids, *seen) if not isinstance(i, Integral | str) or as_id(" ".join(str(i).split())) != i
    ]:
        raise ValueError(f"an id must be a whole number or a name to be saved, but one is {strange[0]!r}")
    if folder.exists():
        raise ValueError(f"there is a {folder} already: name a new folder, so that nothing is lost")
    folder.parent.mkdir(parents=True, exist_ok=True)
    others = sorted({*seen} - {*ids}, key=str)
    about = {name: getattr(log, name) for name in ABOUT if name != "others"} | {"others": others}
    about |= {name: np.asarray(about[name]).tolist() for name in "QR" if about[name] is not None}
    with tempfile.TemporaryDirectory(prefix=".incoming-", dir=folder.parent) as incoming:
        new = Path(incoming, folder.name)  # renamed at the end, so that half a run is never found
        new.mkdir()
        rows = np.column_stack([log.times[:-1], log.times[1:], log.controls]).tolist()
        write(new / "steps.csv", list(STEPS)[way], rows)
        times = log.times[log.seen_step + 1].tolist()
        columns = next(c for c, sensor in SEEN.items() if sensor == log.sensor)
        write(new / "measurements.csv", columns, [(t, i, *z) for t, i, z in zip(times, seen, log.seen.tolist())])
        write(new / "landmarks.csv", PLACES, [(lm.id, *lm.p.tolist()) for lm in log.map])
        if log.truth is not None:
            write(new / "truth.csv", TRUTH[3 - log.truth.shape[1]], np.column_stack([log.times, log.truth]).tolist())
        (new / "about.json").write_text(json.dumps(about, indent=1), encoding="utf-8")
        try:
            fields(new)
        except DataError as error:  # say, a heading that counts on from turn to turn
            raise ValueError(f"such a run is not saved: {str(error).replace(str(new), folder.name)}") from None
        shutil.move(new, folder)
    return folder


def fields(folder: Path) -> dict[str, Any]:
    """The fields of the Log in a folder of the plain form; DataError names the file and the line of what is wrong."""
    if lacking := [name for name in NEEDED if not (folder / name).is_file()]:
        raise DataError(
            f"{folder} lacks {', '.join(lacking)}: `help(Log.save)` says what is in them (MRCLAM's: mrclam.read)"
        )
    about = _about(folder / "about.json")
    steps = read(folder / "steps.csv", STEPS)
    seen, landmarks = read(folder / "measurements.csv", SEEN), read(folder / "landmarks.csv", [PLACES])
    frame = about.get("frame", STEPS[steps.columns])
    if len(steps.columns) == 4 and frame != STEPS[steps.columns]:
        raise DataError(f"{folder / 'about.json'}: with such steps frame is '{STEPS[steps.columns]}', not '{frame}'")
    times, notes = _clock(steps), list(about.get("notes", ()))
    truth = None
    if (folder / "truth.csv").exists():
        truth = _truth(read(folder / "truth.csv", TRUTH), times, notes)
    _see_to_turns(steps, truth)
    known = {"frame": frame, "name": about.get("name", folder.resolve().name)}
    known |= {name: np.array(about[name], dtype=float) for name in "QR" if name in about}
    fields = seen_in(seen, times, landmarks, about.get("others", []))
    if len(times) > 3 and len(fields["seen_step"]) > 2 and not fields["seen_step"].any():
        notes.append("all measurements lie in the first step: is their time in the unit that the header says?")
    return known | {
        "times": times,
        "controls": steps.rows[:, 2:],
        **fields,
        "notes": tuple(notes),
        "sensor": SEEN[seen.columns],
        "truth": truth,
        "range": about.get("range"),
    }


def seen_in(seen: Table, times: Array, landmarks: Table, others: list | None = None) -> dict[str, Any]:
    """The map of a Log and its measurements: the step of each is that of `times` (N+1,) [s] whose end is nearest.

    others: ids that are seen though they are no landmarks, or None where the form has no such list.
    """
    for k, i in enumerate(landmarks.ids):
        if i == "" or i in landmarks.ids[:k]:
            raise landmarks.wrong(k, f"the id {i} is here for the second time" if i != "" else "the id is missing")
    landmarks.check(np.isnan(landmarks.rows[:, 0] + landmarks.rows[:, 1]), "a landmark's place must be known")
    known = {*landmarks.ids, *(others or ())}
    for k, i in enumerate(seen.ids):
        if i not in known:
            what = f"there is no landmark {i!r} in {landmarks.path.name}: add it there, or delete what was seen of it"
            robot = "" if others is None else f'; another robot is named in about.json: "others": [{json.dumps(i)}]'
            raise seen.wrong(k, what + robot)
    when, end = seen.rows[:, 0], times[-1] + (times[-1] - times[-2]) / 2
    run = f"the run lasts from {times[0]:.12g} s to {times[-1]:.12g} s"
    seen.check((when < times[0]) | (when > end), f"time [s] is {{0:.12g}}, but {run}: is it of another clock?")
    seen.check(np.append(False, np.diff(when) < 0), "time [s] is {0:.12g}, which is before that of the line above")
    if seen.columns[2].startswith("range"):
        none = np.isin(seen.rows[:, 1], (0, -1))  # other negative ones are noise, where a landmark is near
        seen.check(none, "range [m] is {1:g}: does the sensor say so that it saw nothing? Then delete the line")
    reach, spread = abs(seen.rows[:, 1]), np.ptp(landmarks.rows, axis=0).max() if len(landmarks.rows) else 0.0
    if spread and len(reach):  # a thousandth or a thousandfold is no robot's, but another unit
        far = f"{landmarks.path.name} has landmarks up to {spread:.4g} m apart"
        seen.check(reach / 100 > spread, f"{seen.columns[2]} is {{1:.6g}}, but {far}: is one of the two in [mm]?")
        small = np.full(1, reach.max() < spread / 500)
        seen.check(small, f"nothing is farther away than {reach.max():.4g} m, but {far}: in [mm]?")
    kinds = " ".join({type(i).__name__ for i in seen.ids}) or "int"
    return {
        "seen_step": np.searchsorted((times[1:-1] + times[2:]) / 2, when, side="right"),
        "seen_id": np.array(seen.ids, dtype={"int": int, "str": str}.get(kinds, object)),
        "seen": seen.rows[:, 1:],
        "map": Map(Landmark(p, i) for i, p in zip(landmarks.ids, landmarks.rows)),
    }


def _about(path):
    """What about.json says, {} if there is none."""
    try:
        about = json.loads(text_of(path)) if path.exists() else {}
    except (ValueError, RecursionError) as error:
        raise DataError(f"{path}, line {getattr(error, 'lineno', 1)}: this is no JSON: {error}") from None
    if not isinstance(about, dict):
        raise DataError(f'{path} must have its keys in braces, such as {{"name": "our hall"}}')
    if strange := set(about) - set(ABOUT):
        raise DataError(f"{path} has {', '.join(map(repr, sorted(strange)))}, but it may have {', '.join(ABOUT)} only")
    about = {key: value for key, value in about.items() if value is not None}
    for key, value in about.items():
        what, good = ABOUT[key]
        try:
            sound = good(value)
        except (TypeError, ValueError):
            sound = False
        if not sound:
            raise DataError(f"{path}: {key} must be {what}, but it is {value!r}")
    return about


def _clock(steps):
    """The times (N+1,) [s] of a run; DataError unless each step starts where the one before ends."""
    if not len(steps.rows):
        raise DataError(f"{steps.path} has no steps")
    start, end = steps.rows[:, :2].T
    steps.check(end <= start, "end [s] is {1:.12g}, which is not after start [s], {0:.12g}")
    apart = np.append(False, abs(start[1:] - end[:-1]) > 1e-3 * (end - start)[1:])
    steps.check(apart, "start [s] is {0:.12g}, but a step must start when the one of the line above ends")
    return np.append(start[0], end)


def _see_to_turns(steps, truth):
    """DataError where turns cannot be in radians: more than half a turn in a step, or many times what the truth has."""
    column, way = steps.columns[-1], STEPS[steps.columns]
    if way != "robot":
        return
    turns = abs(steps.rows[:, -1])
    if column.startswith("turned"):
        steps.check(
            turns > np.pi, f"{column} is {{{steps.rows.shape[1] - 1}:.6g}} in one step, half a turn is 3.14: in [deg]?"
        )
    else:
        turns = turns * (steps.rows[:, 1] - steps.rows[:, 0])
    if truth is not None and truth.shape[1] == 3:
        moved = abs(wrap(np.diff(truth[:, 2])))
        known = np.isfinite(moved)
        if turns[known].sum() > 1 + MANY * moved[known].sum():
            told = (
                f"the robot turns by {turns[known].sum():.3g} rad in all, but in truth.csv by {moved[known].sum():.3g}"
            )
            raise DataError(f"{steps.path}, line 1: by {column} {told}: is it in degrees?")


def _truth(table, times, notes):
    """The truth (N+1, d) at `times` (N+1,): as it stands if its times are these, else interpolated."""
    when, truth = table.rows[:, 0], table.rows[:, 1:]
    table.check(np.append(False, np.diff(when) <= 0), "time [s] is {0:.12g}, which is not after that of the line above")
    if np.array_equal(when, times):
        return truth
    truth, unknown = at_times(times, when, truth)
    if unknown.all():
        run = f"from {times[0]:.12g} s to {times[-1]:.12g} s"
        raise DataError(f"{table.path} knows nothing of the run, which lasts {run}: is it of another clock?")
    lost = f"unknown at {unknown.sum()} of {len(times)} times (gaps longer than {GAP} s)"
    notes.append(f"truth.csv has times of its own: interpolated, {lost}")
    return truth


def at_times(times: Array, when: Array, poses: Array) -> tuple[Array, Array]:
    """Poses (n, d) of the times `when` (n,) interpolated at `times` (N+1,): (N+1, d), and where unknown (N+1,).

    They are so, NaN, within gaps longer than `GAP` and outside of `when`; headings go the short way round.
    """
    known = np.isfinite(poses).all(axis=1)
    when, poses = when[known], poses[known]
    if not len(when):
        return np.full((len(times), poses.shape[1]), np.nan), np.ones(len(times), dtype=bool)
    columns = [*poses[:, :2].T, *np.unwrap(poses[:, 2:], axis=0).T]
    result = np.column_stack([np.interp(times, when, column) for column in columns])
    result[:, 2:] = wrap(result[:, 2:])
    after = np.clip(np.searchsorted(when, times), 1, max(len(when) - 1, 1)).clip(max=len(when) - 1)
    gap = (when[after] - when[after - 1] > GAP) & (times > when[after - 1]) & (times < when[after])
    unknown = gap | (times < when[0]) | (times > when[-1])
    result[unknown] = np.nan
    return result, unknown
