"""The pages under the names by which Moodle or Canvas takes them back, each to its student."""

import re
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import BinaryIO

from .. import files
from ..intake.owners import CANVAS, MOODLE
from ..records import Result
from .lms import Row, digits, match
from .names import labels
from .texts import clean

FOLDER = "assignsubmission_file_"
_LEAD = re.compile(rb'<nav [^<>]* id="instructor">.*?</nav>', re.DOTALL)  # it leads nowhere from where a student reads


def send_back(
    path: Path, folder: Path, results: Sequence[Result], pages: Mapping[str, str], rows: Mapping[int, Row]
) -> None:
    """Pack the pages into the zip `path`, or remove it where no file came from Moodle or Canvas.

    Moodle takes it as "Upload multiple feedback files in a zip", Canvas as "Upload Submissions".
    folder: of the pages;  pages: {label: file name};  rows: those of Moodle's worksheet, for the members of groups.
    """
    found: dict[str, Path] = {}
    groups = _members(rows, results)
    ours = {digits(results[at].identifier) for at in groups}
    for at, (label, result) in enumerate(zip(labels(results), results)):
        name = _name(result, pages[label])
        names = [name] if name else []
        # Newer Moodle knows groups by their own number, older one members by theirs: never one taken for the other.
        others = [row for row in groups.get(at, ()) if name and digits(row.identifier) not in ours]
        names += [f"{_plain(row.name)}_{digits(row.identifier)}_{FOLDER}/{pages[label]}" for row in others]
        found.update(dict.fromkeys(names, folder / pages[label]))
    if not found:
        path.unlink(missing_ok=True)
        return

    def pack(file: BinaryIO) -> None:
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, page in found.items():
                kept = _LEAD.sub(b"", page.read_bytes(), 1)
                archive.writestr(zipfile.ZipInfo.from_file(page, name), kept, zipfile.ZIP_DEFLATED)

    files.write(path, pack)


def _members(rows: Mapping[int, Row], results: Sequence[Result]) -> dict[int, list[Row]]:
    """{index of a result that a group handed in: the rows of its members}."""
    found: dict[int, list[Row]] = {}
    for place, at in match(rows, results)[0].items():
        row = rows[place]
        if digits(row.identifier) and digits(row.identifier) != digits(results[at].identifier):
            found.setdefault(at, []).append(row)
    return found


def _name(result: Result, page: str) -> str:
    """The page's name in the zip, by that of the file that was handed in; '' if it came from neither.

    The student's number must stand in it: a student may call a file as an LMS calls those of another student.
    """
    parts = [_safe(part) for part in re.split(r"/|: ", result.source)]
    if result.ruling.by and result.identifier.isdigit() and any(map(MOODLE.match, parts)):
        return f"{_plain(result.student)}_{result.identifier}_{FOLDER}/{page}"
    for part in parts:
        of = MOODLE.match(part)
        if of and of["plugin"] == "file" and of["id"] == result.identifier:
            return f"{part[: of.start('file')]}{page}" if of["file"] else f"{part}/{page}"
    of = CANVAS.match(parts[-1])
    if of and of["name"] and of["upload"] and of["id"] == result.identifier:
        # Its numbers are what Canvas goes by; a page must end as one.
        return f"{parts[-1].rsplit('.', 1)[0]}.html"
    return ""


def _plain(name: str) -> str:
    """A member's name as Moodle has it in a folder's: its underscores stand for spaces."""
    return _safe(name).replace("_", " ").replace("/", " ")


def _safe(name: str) -> str:
    """A name that leads nowhere else on any system."""
    return re.sub(r'[\\:*?"<>|\x00-\x1f]', "-", clean(name))
