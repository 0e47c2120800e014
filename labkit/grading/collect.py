"""From the submissions of a class, as an LMS or a person packed them, to the notebooks of one lab.

Whatever is inside is taken for hostile: see `archive`. `survey` looks at names only, `read` at one notebook.
"""

import codecs
import hashlib
import re
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import partial
from itertools import groupby

from ..notebook import Unreadable, cells_of, parse
from .archive import Member, listed, open_archive, readable, several, shorten
from .records import Problem, Refused

MAX_DEPTH = 4  # folders inside a student's folder
MAX_PARTS = 1_000_000  # lists and tables in one notebook: 20 MB of '[[],[],' would fill 500 MB
MAX_CELLS = 2_000
ARCHIVES = (".zip", ".7z", ".rar", ".tar", ".gz", ".tgz", ".bz2", ".xz")

# The full name has no underscore of its own: Moodle makes spaces of them. The first match is Moodle's.
MOODLE = re.compile(r"(?P<name>.+?)_(?P<id>\d+)_assignsubmission_(?P<plugin>[a-z]+)(?:_(?P<file>.*))?$")
# Without an upload's number it is a text or a link that was typed in. The number never begins with 0,
# so 'group_3_01_cartesian_ekf' is not Canvas's.
CANVAS = re.compile(
    r"(?:(?!LATE_)(?P<name>.+?)_)?(?P<late>LATE_)?(?P<id>\d+|anon_[^_]+)"
    r"_(?:(?P<upload>[1-9]\d*)_(?P<file>.+)|(?P<typed>(?:text|link)\.html))$"
)
OTHER = re.compile(r"(?<!\d)0\d[ _-][a-z]\w*", re.IGNORECASE)  # the name of any lab
COPY = re.compile(r"(?:[ _-]+copy ?\d*|[ _-]*\(\d+\)|[ _-]+\d+)$", re.IGNORECASE)


@dataclass(frozen=True)
class Entry:
    """One notebook that may be a student's hand-in, not yet opened.

    student     display name;  identifier: the LMS's number, '' if there is none.
    source      archive and path, for reports;  name: the file's own name.
    when        time of the file, local, or None; None for Canvas, which writes the time of the download.
    late        the LMS itself says so.
    size        in bytes, as the archive says.
    named       its name is the lab's; else it is any notebook of a student who has none of that name.
    notes       sentences on what is odd.
    """

    student: str
    identifier: str
    source: str
    name: str
    when: datetime | None
    late: bool
    size: int
    named: bool
    notes: tuple
    member: Member


@dataclass(frozen=True)
class Unfit:
    """A student's hand-in that cannot be graded; the reason is a sentence that the student understands."""

    student: str
    identifier: str
    source: str
    when: datetime | None
    reason: str


@dataclass(frozen=True)
class HandIn:
    """A notebook that can be graded: the fields of its Entry, then

    cells   list of labkit.notebook.Cell, after `tidy`.
    digest  SHA-256 of the file, in hexadecimal.
    notes   sentences on what is odd.
    """

    student: str
    identifier: str
    source: str
    when: datetime | None
    late: bool
    cells: list
    digest: str
    notes: list


@dataclass
class _Owner:
    """What a path says: whose it is, and the file's name as the student gave it ('' for a bare folder)."""

    student: str
    identifier: str = ""
    name: str = ""
    late: bool = False
    typed: bool = False
    upload: int = 0
    canvas: bool = False


@dataclass
class _Student:
    """One student's files, as pairs of _Owner and Member."""

    top: str
    files: list = field(default_factory=list)
    typed: bool = False


class Submissions:
    """A folder or zip of submissions; closed at the end of a `with` block."""

    def __init__(self, path):
        """Raises Problem if `path` is no folder and no zip that can be read."""
        self._path = path
        self._archive = open_archive(path)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self._archive.close()

    def survey(self, lab):
        """(entries, unfits, notes) of a lab, say '01_cartesian_ekf', without opening any notebook.

        Entries of one student follow each other, the latest attempt last. notes: sentences for the
        instructor. Raises Problem if nothing was handed in at all.
        """
        students, notes = self._students(lab)
        entries, unfits = [], []
        for (student, identifier), found in students.items():
            good, reason, odd = _choose(found.files, lab)
            notes += [f"{student}: {text}" for text in odd]
            if reason:
                unfits.append(Unfit(student, identifier, self._source(found.top), None, reason))
            twice = len({member.path for _, member in good}) < len(good)
            entries += [self._entry(student, identifier, *pair, lab, twice) for pair in good]
            if len({member.parts[:-1] for _, member in good if len(member.parts) > 1}) > 1:
                notes.append(f"{student}: notebooks in several folders count as attempts of one student.")
        if not entries and not unfits:
            raise Problem(" ".join([
                f"{self._path} holds no hand-ins: give a download of Moodle or Canvas, a folder of notebooks",
                "with their students' names, or one with a folder for each student.", *notes,
            ]))  # fmt: skip
        return entries, unfits, notes

    def read(self, entry):
        """(cells, digest) of an entry; the cells still need `tidy`. Raises Refused, naming the file."""
        raw = self._archive.read(entry.member)
        return _cells(raw, entry.name), hashlib.sha256(raw).hexdigest()

    def hand_ins(self, lab, ids):
        """Yield each attempt at a lab as HandIn or Unfit, one student after the other; ids: see `tidy`."""
        entries, unfits, _ = self.survey(lab)
        for _, attempts in groupby(entries, key=lambda entry: (entry.student, entry.identifier)):
            results = [self._hand_in(entry, ids) for entry in attempts]
            if any(isinstance(result, HandIn) for result, named in results):
                # A notebook that is the lab's neither by name nor by its cells was only a guess.
                results = [pair for pair in results if isinstance(pair[0], HandIn) or pair[1]]
            yield from (result for result, named in results)
        yield from unfits

    def _hand_in(self, entry, ids):
        about = entry.student, entry.identifier, entry.source, entry.when
        try:
            cells, digest = self.read(entry)
            cells, notes = tidy(cells, ids)
        except Refused as error:
            return Unfit(*about, str(error)), entry.named
        return HandIn(*about, entry.late, cells, digest, [*entry.notes, *notes]), entry.named

    def _entry(self, student, identifier, owner, member, lab, twice):
        named = _is_lab(owner.name, lab)
        notes = [] if named else [f"The notebook is named {shorten(owner.name)}, not {lab}.ipynb."]
        if twice:
            notes.append("The archive holds a file of this name twice; each counts as an attempt.")
        return Entry(
            student, identifier, self._source(member.path), shorten(owner.name),
            None if owner.canvas else member.when, owner.late, member.size, named, tuple(notes), member,
        )  # fmt: skip

    def _source(self, path):
        return f"{self._archive.name}: {path}"

    def _students(self, lab):
        """{(student, identifier): _Student}, and notes on files that are nobody's."""
        students, strays, deep = {}, [], []
        for parts, member in _unwrapped(self._archive.members, lab):
            owner = _owner(parts, member.folder, lab)
            if not owner:
                strays.append(member.path)
                continue
            own = students.setdefault((owner.student, owner.identifier), _Student(member.path))
            own.top = "/".join(member.parts[: len(member.parts) - len(parts) + 1])
            if len(parts) > 1 + MAX_DEPTH:
                deep.append(member.path)
            elif owner.typed:
                own.typed = True
            elif owner.name and (not member.folder or _notebook(owner.name)):
                own.files.append((owner, member))
        notes = list(self._archive.notes)
        if strays:
            notes.append(f"Left aside {several(strays, 'file')}: no notebook with a student's name.")
        if deep:
            notes.append(f"Left aside {several(deep, 'file')} nested deeper than {MAX_DEPTH} folders.")
        typed = sum(own.typed for own in students.values())
        if typed:
            notes.append(f"Left aside what {typed} student{'s' * (typed > 1)} typed into the LMS as text.")
        others = sum(not _notebook(owner.name) for own in students.values() for owner, _ in own.files)
        if others:
            what = "files that are not notebooks" if others > 1 else "file that is not a notebook"
            notes.append(f"Left aside {others} {what}.")
        return students, notes


def open_submissions(path):
    """The Submissions at `path`, a folder or a zip; raises Problem if it is neither or cannot be read."""
    return Submissions(path)


def iter_collect(path, lab, ids):
    """Yield a HandIn or Unfit for each attempt at a lab, holding one student's notebooks at a time."""
    with open_submissions(path) as submissions:
        yield from submissions.hand_ins(lab, ids)


def collect(path, lab, ids):
    """(hand_ins, unfits, notes) of a lab, all at once. Raises Problem; see Submissions and `tidy`."""
    with open_submissions(path) as submissions:
        notes = submissions.survey(lab)[2]
        results = list(submissions.hand_ins(lab, ids))
    hand_ins = [result for result in results if isinstance(result, HandIn)]
    return hand_ins, [result for result in results if isinstance(result, Unfit)], notes


def tidy(cells, ids):
    """(cells, notes): each answer cell of the lab at most once, whatever the student did to it.

    ids: those of the released lab's answer cells, as a set or as {id: whether it is a code cell}.
    Of several cells with one id the first with the role 'answer' counts; the others, and answer cells
    of unknown ids, become the student's own. Raises Refused if no answer cell is left.
    """
    kinds = ids if isinstance(ids, dict) else {}
    notes, chosen = [], {}
    for id in sorted(ids):
        found = [cell for cell in cells if cell.id == id]
        if not found:
            notes.append(f"The answer cell '{id}' is missing.")
            continue
        best = chosen[id] = min(
            found, key=lambda c: (c.role != "answer", c.code is not kinds.get(id, c.code), c.number)
        )
        if len({cell.source for cell in found}) > 1:
            notes.append(f"{len(found)} cells have the id '{id}': cell {best.number} counts as the answer.")
        if best.code is not kinds.get(id, best.code):
            kind = "a code cell" if kinds[id] else "a text cell"
            notes.append(f"The answer cell '{id}' is no longer {kind}.")
    if not chosen:
        raise Refused("It holds no answer cell of this lab: fill in the notebook that was given out.")
    return [_tidied(cell, chosen) for cell in cells], notes


def _tidied(cell, chosen):
    if chosen.get(cell.id) is cell:
        return replace(cell, role="answer")
    if cell.id in chosen or cell.role == "answer":
        return replace(cell, id="", role="own")
    return cell


def _unwrapped(members, lab):
    """Pairs of a member's parts and itself, without the folders that hold the whole class."""
    pairs = [(_cut(member.parts), member) for member in members]
    for _ in range(MAX_DEPTH):
        tops = {parts[0] for parts, _ in pairs}
        inner = [(parts[1:], member) for parts, member in pairs if len(parts) > 1]
        if len(tops) != 1 or not inner or MOODLE.match(*tops) or _notebook(*tops):
            return pairs
        # A notebook whose name is only the lab's needs the folder to tell whose it is.
        books = [parts for parts, member in inner if len(parts) == 1 and _notebook(parts[0])]
        if not all(_owner(parts, False, lab) for parts in books):
            return pairs
        pairs = inner
    return pairs


def _cut(parts):
    """A folder that is named like a notebook counts as that notebook, to be refused."""
    for number, part in enumerate(parts, start=1):
        if _notebook(part):
            return parts[:number]
    return parts


def _owner(parts, folder, lab):
    """The _Owner of a path, None if it names no student."""
    top = parts[0]
    name = parts[-1] if len(parts) > 1 else ""
    if match := MOODLE.match(top):
        student, number = readable(match["name"].replace("_", " ")) or "?", match["id"]
        if student.lower() == "participant":  # marked blind
            student = f"{student} {number}"
        return _Owner(student, number, name or match["file"] or "", typed=match["plugin"] != "file")
    if match := re.fullmatch(r"(Participant)[_ ](\d+)", top, re.IGNORECASE):
        return _Owner(f"{match[1]} {match[2]}", match[2], name)
    if len(parts) > 1 or folder and not _notebook(top):
        return _Owner(readable(top), "", name)
    match = CANVAS.match(top)
    if match and (match["name"] or not match["id"].isdigit()):
        number = match["id"].removeprefix("anon_")
        return _Owner(
            readable(match["name"] or f"Anonymous {number}"), number, match["file"] or match["typed"],
            bool(match["late"]), bool(match["typed"]), int(match["upload"] or 0), canvas=True,
        )  # fmt: skip
    student = _student(top[: -len(".ipynb")], lab) if _notebook(top) else ""
    return _Owner(student, "", top) if student else None


def _student(stem, lab):
    """'lovelace' of 'lovelace_01_cartesian_ekf', '01_cartesian_ekf-lovelace (1)' and 'lovelace-Copy1'."""
    match = _pattern(lab).search(stem) or OTHER.search(stem)
    before, after = (stem[: match.start()], stem[match.end() :]) if match else (stem, "")
    before = re.sub(r"^copy of ", "", before, flags=re.IGNORECASE)
    if not match:
        before = re.sub(r"\s*\(\d+\)$|-copy\d*$", "", before, flags=re.IGNORECASE)
    return readable(before.strip(" _-.()") or COPY.sub("", COPY.sub("", after)).strip(" _-.()"))


def _choose(files, lab):
    """(good, reason, odd): the pairs that may be the hand-in, or why there are none, and what to note."""
    wanted = f"hand in {lab}.ipynb."
    books = [pair for pair in files if _notebook(pair[0].name)]
    mine = [pair for pair in books if _is_lab(pair[0].name, lab)]
    mine = mine or [pair for pair in books if not _is_other(pair[0].name, lab)]
    wrong = [f"{shorten(owner.name)} {_wrong(member)}" for owner, member in mine if _wrong(member)]
    wrong = list(dict.fromkeys(wrong))
    good = [pair for pair in mine if not _wrong(pair[1])]
    good.sort(key=lambda pair: (pair[1].when or datetime.min, pair[0].upload))
    if good:
        return good, "", [f"{text}; it was left aside." for text in wrong]
    if wrong:
        return [], f"{wrong[0]}: hand in the notebook file itself.", []
    names = [owner.name for owner, _ in books or files]
    packed = [name for name in names if name.lower().endswith(ARCHIVES)]
    if books:
        reason = f"There is no notebook of lab {lab}, only {listed(names)}: {wanted}"
    elif packed:
        reason = f"There is no notebook beside {shorten(packed[0])}: take it out of there and {wanted}"
    elif names:
        reason = f"There is no notebook, only {listed(names)}: {wanted}"
    else:
        reason = f"There is no file: {wanted}"
    return [], reason, []


def _wrong(member):
    folder = member.folder or any(map(_notebook, member.parts[:-1]))
    return "is a folder" if folder else member.wrong


def _notebook(name):
    return name.lower().endswith(".ipynb")


def _pattern(lab):
    """Finds a lab's name, also with spaces or hyphens for its underscores."""
    return re.compile(r"(?<!\d)" + "[ _-]".join(map(re.escape, lab.split("_"))), re.IGNORECASE)


def _is_lab(name, lab):
    return bool(_pattern(lab).search(name))


def _is_other(name, lab):
    match = OTHER.search(name)
    return bool(match) and match[0][:2] != lab[:2]


def _cells(raw, name):
    """The cells of a notebook's bytes, strictly read; raises Refused."""
    raw = raw.removeprefix(codecs.BOM_UTF8)  # some editors of Windows write one
    if raw.count(b"[") + raw.count(b"{") > MAX_PARTS:
        raise Refused(f"{name} holds too much data: clear the outputs, save it and hand it in again.")
    try:
        cells = cells_of(parse(raw, name, pairs=partial(_once, name)), name)
    except Unreadable as error:
        raise Refused(shorten(str(error), 400)) from None
    if len(cells) > MAX_CELLS:
        raise Refused(f"{name} has {len(cells)} cells, and {MAX_CELLS} is the most: merge or delete some.")
    return [_plain(cell) for cell in cells]


def _once(name, pairs):
    """The table of a JSON object whose keys are all different; raises Unreadable."""
    table = dict(pairs)
    if len(table) == len(pairs):
        return table
    seen = set()
    key = next(key for key, _ in pairs if key in seen or seen.add(key))
    key = shorten(readable(key))
    raise Unreadable(f'{name} says "{key}" twice in one place: save it again in Jupyter.')


def _plain(cell):
    """The cell with text that can be written as UTF-8, unlike half an emoji, and with an id that is one."""
    id = cell.id if re.fullmatch(r"[A-Za-z0-9_-]{1,64}", cell.id) else ""
    source = cell.source.encode("utf-8", "replace").decode("utf-8")
    return replace(cell, id=id, source=source)
