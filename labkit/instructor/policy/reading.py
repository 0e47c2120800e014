"""`course.toml`, read and validated: every error is a sentence that says what, where, and what to do."""

import re
import tomllib
from collections.abc import Collection
from datetime import datetime, timedelta, tzinfo
from pathlib import Path
from zoneinfo import ZoneInfo, available_timezones

from ..records import CommandError
from ..report.texts import SHOWN, clean, cut, squash
from ..trouble import why
from . import moments
from .course import BEST, FIRST, NEWEST, OWN, Course, Extension, Group, Lab, Late
from .fields import Table, kind, meant

ROOT = Path(__file__).resolve().parents[3]
ATTEMPTS = (NEWEST, FIRST, BEST)
TOP = ("zone", "attempts", "partial_credit", "students", "late", "labs", "extensions", "groups", "variants")
MOST_DAYS = 60 * 24 * 7  # [min] of grace: more is another due date


def labs_of(root: Path = ROOT) -> tuple[str, ...]:
    """The names of the labs that there are."""
    return tuple(sorted(path.stem for path in (root / "solutions").glob("[0-9]*_*.py")))


def read(path: Path, known: Collection[str] = ()) -> Course:
    """The Course that a file says; that of no file is the default one. known: labs that there are beside the kit's.

    Raises CommandError with all that is wrong in it.
    """
    labs = tuple(dict.fromkeys((*labs_of(), *known)))
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        return Course(known=labs)
    except OSError as error:
        raise CommandError(f"{path} cannot be read: {why(error)}.") from None
    except UnicodeDecodeError:
        raise CommandError(f"{path} is no text in UTF-8: save it as UTF-8.") from None
    try:
        values = tomllib.loads(_HOURS.sub(r"\1:00", text))
    except (ValueError, RecursionError) as error:  # not only its own: a number may have too many digits
        raise CommandError(f"{path}, {_broken(str(error), text)}{UNTOUCHED}") from None
    wrong: list[str] = []
    course = _course(Table(values, "", wrong), labs)
    refuse(path, wrong)
    return course


LONG = 120  # characters of a line that are shown
UNTOUCHED = "Nothing was graded or changed."
_HOURS = re.compile(r"^(\s*due\s*=\s*\d{4}-\d\d-\d\d[Tt ]\d\d:\d\d)(?![:\d])", re.M)  # TOML asks for seconds too


def refuse(path: Path | str, wrong: Collection[str]) -> None:
    """Raise CommandError if there is anything wrong."""
    if wrong:
        told = [*wrong][:SHOWN] + ([f"and {len(wrong) - SHOWN} more"] if len(wrong) > SHOWN else [])
        raise CommandError(
            "\n".join([f"{path}: there is something to put right. {UNTOUCHED}", *(f"  {one}" for one in told)])
        )


def _broken(said: str, text: str) -> str:
    """'line 3: ...' of what the parser says of a text."""
    place = re.search(r"\s*\(at (?:line (\d+), column \d+|end of document)\)$", said)
    lines = text.splitlines()
    number = int(place[1]) if place and place[1] else len(lines)
    line = clean(lines[number - 1]) if place and 0 < number <= len(lines) else ""
    told = f"line {number}: this is no TOML: {clean(said[: place.start()] if place else said)}{_hint(line)}."
    return f"{told}\n  {cut(line, LONG)}\n" if line else f"{told} "


def _hint(line: str) -> str:
    """What a line that is no TOML may have been meant to be: a date in another order, or a text with an open quote."""
    date = re.match(r"""[^#"']*=\s*(\d+)([./-])(\d\d?)\2(\d+)(?:[T ,]+(\d\d?):(\d\d))?""", line)
    if date:
        day, dot, month, year, hour, minute = date.groups()
        if dot == "." and len(year) == 4 and int(month) <= 12:
            return f"; write {year}-{int(month):02}-{int(day):02}T{int(hour or 12):02}:{minute or '00'}"
        return f"; {moments.HINT}"
    if line.count('"') % 2 or '"' not in line and line.count("'") % 2:
        return "; perhaps a quote is open"
    return ""


def _course(top: Table, known: tuple[str, ...]) -> Course:
    top.keys(TOP)
    zone = _zone(top)
    labs = {}
    for name, values in top.get("labs", dict, {}, "tables such as [labs.01_cartesian_ekf]").items():
        if name not in known:
            top.tell(f"[labs.{name}]", f"there is no lab {name!r}{meant(name, known)}")
        elif not isinstance(values, dict):
            top.tell(f"[labs] {name}", f"this is {kind(values)}, and should be a table: [labs.{name}]")
        else:
            labs[name] = _lab(Table(values, f"[labs.{name}]", top.wrong), zone)
    if len(labs) == len(known) and labs and not any(lab.weight for lab in labs.values()):
        top.tell("[labs]", "all weights are 0, so that there is no total")
    return Course(
        zone,
        top.choice("attempts", ATTEMPTS, ""),
        top.get("partial_credit", bool, True),
        _late(Table(top.get("late", dict, {}), "[late]", top.wrong)),
        labs,
        _extensions(top, labs, known, zone),
        tuple(filter(None, (_group(table, known) for table in top.tables("groups")))),
        _names(top, "students"),
        known,
        *_variants(Table(top.get("variants", dict, {}), "[variants]", top.wrong)),
    )


def _variants(table: Table) -> tuple[str, str]:
    table.keys(("course", "roster"))
    course, roster = (squash(table.get(key, str, "")) for key in ("course", "roster"))
    for key, value in (("course", course), ("roster", roster)):
        if table.values and not value and isinstance(table.values.get(key, ""), str):
            table.tell(key, "it is missing: variants need the course's name, as it was released, and a roster")
    return course, roster


def _zone(top: Table) -> tzinfo | None:
    name = top.get("zone", str, "")
    if not name:
        return None
    try:
        return ZoneInfo(name)
    except (ValueError, OSError, LookupError):
        top.tell("zone", f"there is no zone {name!r}{_near_zone(name)}")
        return None


def _near_zone(name: str) -> str:
    known = sorted(zone for zone in available_timezones() if "/" in zone)
    said = meant(name, known, 0.8)
    return said if "did you mean" in said else "; write one such as 'Europe/Madrid'"


def _lab(table: Table, zone: tzinfo | None) -> Lab:
    table.keys(("due", "attempts", "weight"))
    return Lab(_due(table, zone), table.choice("attempts", ATTEMPTS, ""), table.number("weight", 1.0, 1000))


def _due(table: Table, zone: tzinfo | None) -> datetime | None:
    if "due" not in table.values:
        return None
    try:
        return moments.moment(table.values["due"], zone)
    except (ValueError, OverflowError, OSError) as error:
        table.tell("due", str(error) if isinstance(error, ValueError) else f"this is no date; {moments.HINT}")
        return None


def _late(table: Table) -> Late:
    table.keys(("points_a_day", "percent_a_day", "of", "grace_minutes", "cap", "ignore"))
    points, percent = table.number("points_a_day"), table.number("percent_a_day", most=100)
    ignore = table.get("ignore", bool, False)
    if points and percent:
        table.tell("points_a_day", "there is percent_a_day too; keep one of them")
    if ignore and (points or percent):
        table.tell("ignore", "late hand-ins cannot be left out and cost points too; keep one of them")
    for key in ("cap", "of"):
        rates = ("percent_a_day", "points_a_day")[: 1 + (key == "cap")]
        if key in table.values and not any(rate in table.values for rate in rates):
            table.tell(key, f"there is no {'points_a_day or ' * (key == 'cap')}percent_a_day that it could be for")
    cap = table.number("cap", None, 100 if percent else 1e6)
    possible = table.choice("of", ("reached", "possible"), "reached") == "possible"
    return Late(points, percent, possible, timedelta(minutes=table.number("grace_minutes", 0, MOST_DAYS)), cap, ignore)


def _extensions(top: Table, labs: dict[str, Lab], known: Collection[str], zone: tzinfo | None) -> tuple[Extension, ...]:
    found: dict[tuple[str, str], Extension] = {}
    for table in top.tables("extensions"):
        table.keys(("student", "lab", "due"))
        student, lab, due = _name(table, "student"), table.get("lab", str, ""), _due(table, zone)
        for key in ("student", "lab", "due"):
            if key not in table.values or key == "lab" and table.values[key] == "":
                table.tell(key, "it is missing: an extension has student, lab and due")
        if lab and lab not in known:
            table.tell("lab", f"there is no lab {lab!r}{meant(lab, known)}")
        first = labs[lab].due if lab in labs else None
        if due and first and due < first:
            table.tell("due", f"this is before the lab is due, {moments.shown(first, zone)}")
        if not (student and lab and due):
            continue
        if (student, lab) in found:
            before = found[student, lab].where.rstrip(",")
            table.tell("student", f"{student!r} has an extension for {lab} already, in {before}; keep one of them")
        found.setdefault((student, lab), Extension(student, lab, due, table.where))
    return tuple(found.values())


def _group(table: Table, known: Collection[str]) -> Group | None:
    table.keys(("members", "labs", "counts"))
    members, labs = _names(table, "members"), _names(table, "labs")
    for lab in labs:
        if lab not in known:
            table.tell("labs", f"there is no lab {lab!r}{meant(lab, known)}")
    if table.values.get("labs") == []:
        table.tell("labs", "it is empty; leave it out, and the group is one in all labs")
    if "" in members:
        table.tell("members", "one of them is empty; write the name or the number of a student")
    if isinstance(table.values.get("members", []), list) and len(set(members)) < 2:
        table.tell("members", "a group has two members or more")
    if twice := next((name for name in members if members.count(name) > 1), None):
        table.tell("members", f"{twice!r} stands there twice")
    return Group(members, labs, table.choice("counts", (*ATTEMPTS, OWN), ""), table.where) if members else None


def _names(table: Table, key: str) -> tuple[str, ...]:
    found = []
    for value in table.get(key, list, [], "a list of texts in quotes"):
        if type(value) not in (str, int):
            table.tell(key, f"there is {kind(value)} in the list, which should hold texts in quotes")
        else:
            found.append(squash(str(value)))
    return tuple(found)


def _name(table: Table, key: str) -> str:
    """A student's name, or a number, with or without quotes."""
    value = table.values.get(key, "")
    name = squash(str(value)) if type(value) is int else squash(table.get(key, str, ""))
    if isinstance(value, str) and key in table.values and not name:
        table.tell(key, "it is empty; write the name or the number of a student")
    return name
