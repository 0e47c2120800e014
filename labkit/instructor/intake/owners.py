"""Whose a file is and which lab it may be of, from the names that an LMS or a person gave it.

An LMS puts the student's name and number before the name that the student chose, so the same text may look like two
LMSs' names. Which LMS it was is decided for the class as a whole; where that cannot be told, nobody is.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime

from .listing import UNLIKE, Member
from .names import readable

MAX_DEPTH = 4  # folders inside a student's folder
# The full name has no underscore of its own: Moodle makes spaces of them. The first match is Moodle's.
MOODLE = re.compile(r"(?P<name>.+?)_(?P<id>\d+)_assignsubmission_(?P<plugin>[a-z]+)(?:_(?P<file>.*))?$")
# Without an upload's number it is a text or a link that was typed in. The number never begins with 0,
# so 'group_3_01_cartesian_ekf' is not Canvas's.
# 'number-number - Ada Lovelace - Nov 20, 2026 1044 PM', a folder or the start of a file's name.
BRIGHTSPACE = re.compile(
    r"(?:(?P<id>\d+)-\d+ - )?(?P<name>.+?) - (?P<when>[A-Z][a-z]{2} \d{1,2}, \d{4} \d{3,4} ?[AP]M)(?: - (?P<file>.+))?$"
)
# 'Lab 1_alovelace_attempt_2026-11-20-22-44-10_file.ipynb', and a text of the same name without a file.
BLACKBOARD = re.compile(
    r".+?_(?P<name>[^_]+)_attempt_(?P<when>\d{4}(?:-\d\d){5})(?:_(?P<file>.+)|(?P<typed>\.txt))$", re.IGNORECASE
)
CANVAS = re.compile(
    r"(?:(?!LATE_|anon_[^_]+_\d)(?P<name>.+?)_)?(?P<late>LATE_)?(?P<id>\d+|anon_[^_]+)"
    r"_(?:(?P<upload>[1-9]\d*)_(?P<file>.+)|(?P<typed>(?:text|link)\.html))$"
)
OTHER = re.compile(r"(?<!\d)0\d[ _-][a-z]\w*", re.IGNORECASE)  # the name of any lab
MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
NOTEBOOK = re.compile(r"\.ipynb(\.txt|\.json)?$", re.IGNORECASE)  # systems and mail programs add an ending
COPY = re.compile(r"(?:[ _-]+copy ?\d*|[ _-]*\(\d+\)|[ _-]+\d+)$", re.IGNORECASE)


@dataclass
class Owner:
    """What a path says: whose it is, and the file's name as the student gave it ('' for a bare folder)."""

    student: str
    identifier: str = ""
    name: str = ""
    late: bool = False
    typed: bool = False
    upload: int = 0
    when: datetime | None = None  # by the LMS's own name for the attempt
    canvas: bool = False
    apart: bool = False  # in a folder of the student's own
    doubt: str = ""  # why it is nobody's, a sentence


def unwrapped(members: Sequence[Member], lab: str) -> list[tuple[tuple[str, ...], Member]]:
    """Pairs of a member's parts and itself, without the folders that hold the whole class."""
    pairs = [(_cut(member.parts), member) for member in members]
    for _ in range(MAX_DEPTH):
        tops = {parts[0] for parts, _ in pairs}
        inner = [(parts[1:], member) for parts, member in pairs if len(parts) > 1]
        if len(tops) != 1 or not inner or readings(*pairs[0]) or is_notebook(*tops):
            break
        # A notebook whose name is only the lab's needs the folder to tell whose it is.
        books = [pair for pair in inner if len(pair[0]) == 1 and is_notebook(pair[0][0])]
        if not all(owner_of(*pair, lab) for pair in books):
            break
        pairs = inner
    return _downloads_opened(pairs, lab)


def _downloads_opened(pairs, lab):
    """The pairs without the LMS's own zips, packed into a folder as they were downloaded.

    Such a zip holds nothing but Moodle's or Brightspace's folders, and has itself no student's name or the lab's.
    """
    inside: dict[str, list[bool]] = {}
    for parts, member in pairs:
        if parts[0].lower().endswith(".zip") and len(parts) > 1:
            theirs = bool(MOODLE.match(parts[1]) or BRIGHTSPACE.match(parts[1]))
            inside.setdefault(parts[0], []).append(theirs and not readings(parts, member) and not is_lab(parts[0], lab))
    downloads = {top for top, theirs in inside.items() if all(theirs)}
    return [(parts[1:] if parts[0] in downloads and len(parts) > 1 else parts, member) for parts, member in pairs]


def _cut(parts):
    """A folder that is named like a notebook counts as that notebook, to be refused."""
    for number, part in enumerate(parts, start=1):
        if is_notebook(part):
            return parts[:number]
    return parts


def system_of(pairs: Iterable[tuple[tuple[str, ...], Member]]) -> str:
    """The LMS whose names all have that look like any LMS's, '' if there is none or they may be two LMSs'."""
    known = [found for pair in pairs if (found := readings(*pair).keys())]
    every = set.intersection(*map(set, known)) if known else set()
    return every.pop() if len(every) == 1 else ""


def owner_of(parts: Sequence[str], member: Member, lab: str, system: str = "") -> Owner | None:
    """The Owner of a path, None if it names no student. system: the LMS, where the class as a whole tells it."""
    found, top = readings(parts, member), parts[0]
    if system in found or len(found) == 1:
        return found[system] if system in found else next(iter(found.values()))
    if found:
        whose = " or ".join(f"{owner.student}'s by {name}" for name, owner in found.items())
        return Owner(readable(top), doubt=f"Its name may be {whose}: put it into a folder with its student's name.")
    name = parts[-1] if len(parts) > 1 else ""
    if not _packed(parts) and (len(parts) > 1 or member.folder and not is_notebook(top)):
        return Owner(readable(top), "", name)
    file = f"{top[:-4]}.ipynb" if _packed(parts) else top
    named = is_notebook(file) or may_be_notebook(file) and is_lab(file, lab)
    student = _student(re.sub(r"(?i)\.json$", "", NOTEBOOK.sub("", file)), lab) if named else ""
    if _packed(parts):
        return Owner(student or readable(top), "", name)
    return Owner(student, "", top) if student else None


def readings(parts: Sequence[str], member: Member) -> dict[str, Owner]:
    """{LMS: Owner} of a path, for each LMS that may have given its first name."""
    top, name = parts[0], parts[-1] if len(parts) > 1 else ""
    found = {"Moodle": _moodle(top, name), "Brightspace": _brightspace(top, name), "Blackboard": _blackboard(top, name)}
    if len(parts) == 1 and (not member.folder or is_notebook(top)) or _packed(parts):
        found["Canvas"] = _canvas(top, name)
    return {lms: owner for lms, owner in found.items() if owner}


def _packed(parts):
    """Whether the path leads into a zip of one student."""
    return len(parts) > 1 and parts[0].lower().endswith(".zip")


def _moodle(top, name):
    if match := re.fullmatch(r"(Participant)[_ ](\d+)", top, re.IGNORECASE):
        return Owner(f"{match[1]} {match[2]}", match[2], name)
    if not (match := MOODLE.match(top)):
        return None
    student, number = readable(match["name"].replace("_", " ")) or "?", match["id"]
    if student.lower() == "participant":  # marked blind
        student = f"{student} {number}"
    return Owner(student, number, name or match["file"] or "", typed=match["plugin"] != "file")


def _brightspace(top, name):
    if not (match := BRIGHTSPACE.match(top)):
        return None
    when = _moment(match["when"].replace(" AM", "AM").replace(" PM", "PM"), "%b %d, %Y %I%M%p")
    return Owner(readable(match["name"]), match["id"] or "", name or match["file"] or "", when=when)


def _blackboard(top, name):
    if not (match := BLACKBOARD.match(top)):
        return None
    when = _moment(match["when"], "%Y-%m-%d-%H-%M-%S")
    return Owner(readable(match["name"]), "", name or match["file"] or "", when=when)  # its texts say no more than that


def _canvas(top, name):
    match = CANVAS.match(top)
    if not match or not match["name"] and match["id"].isdigit():
        return None
    number = match["id"].removeprefix("anon_")
    return Owner(
        readable(match["name"] or f"Anonymous {number}"),
        number,
        name or match["file"] or match["typed"],
        bool(match["late"]),
        bool(match["typed"]),
        int(match["upload"] or 0),
        canvas=True,
    )


def _student(stem, lab):
    """'lovelace' of 'lovelace_01_cartesian_ekf', '01_cartesian_ekf-lovelace (1)' and 'lovelace-Copy1'."""
    stem, *mark = re.split(rf" (?={UNLIKE}[0-9a-f]{{6}}$)", stem)
    match = pattern_of(lab).search(stem) or OTHER.search(stem)
    before, after = (stem[: match.start()], stem[match.end() :]) if match else (stem, "")
    before = re.sub(r"^copy of ", "", before, flags=re.IGNORECASE)
    if not match:
        before = re.sub(r"\s*\(\d+\)$|-copy\d*$", "", before, flags=re.IGNORECASE)
    student = before.strip(" _-.()") or COPY.sub("", COPY.sub("", after)).strip(" _-.()")
    return readable(" ".join([student, *mark])) if student else ""


def is_notebook(name: str) -> bool:
    """Whether the name ends as a notebook's does."""
    return NOTEBOOK.search(name) is not None


def may_be_notebook(name: str) -> bool:
    """Whether the name leaves it to the content."""
    return name.lower().endswith(".json")


def _moment(text, form):
    """The time that a name tells, in the form of `strptime`; 'Nov' is the LMS's English whatever the locale."""
    month = next((n for n, word in enumerate(MONTHS, 1) if text.startswith(word)), None)
    if month:
        text, form = f"{month:02}{text[3:]}", form.replace("%b", "%m")
    hour = re.search(r" (\d{3})[AP]M$", text)
    if hour:
        text = text.replace(f" {hour[1]}", f" 0{hour[1]}")
    try:
        return datetime.strptime(text, form)
    except ValueError:
        return None


def pattern_of(lab: str) -> re.Pattern[str]:
    """Finds a lab's name, also with spaces or hyphens for its underscores."""
    return re.compile(r"(?<!\d)" + "[ _-]".join(map(re.escape, lab.split("_"))), re.IGNORECASE)


def is_lab(name: str, lab: str) -> bool:
    """Whether the lab's name stands in the name."""
    return bool(pattern_of(lab).search(name))


def is_other(name: str, lab: str) -> bool:
    """Whether the name of another lab stands in the name."""
    match = OTHER.search(name)
    return match is not None and match[0][:2] != lab[:2]
