"""Which of a student's files may be the hand-in, and which students may be one."""

import re
from collections.abc import Sequence
from datetime import datetime

from .listing import Member
from .names import listed, shorten
from .owners import Owner, is_lab, is_notebook, is_other, may_be_notebook

ARCHIVES = (".zip", ".7z", ".rar", ".tar", ".gz", ".tgz", ".bz2", ".xz")


def choose(files: Sequence[tuple[Owner, Member]], lab: str) -> tuple[list, str, list[str]]:
    """(good, reason, odd): the pairs that may be the hand-in, or why there are none, and what to note."""
    wanted = f"hand in {lab}.ipynb."
    books = [pair for pair in files if is_notebook(pair[0].name)]
    books = books or [pair for pair in files if may_be_notebook(pair[0].name)]
    mine = [pair for pair in books if is_lab(pair[0].name, lab)]
    mine = mine or [pair for pair in books if not is_other(pair[0].name, lab)]
    wrong = [f"{shorten(owner.name)} {_wrong(member)}" for owner, member in mine if _wrong(member)]
    wrong = list(dict.fromkeys(wrong))
    good = [pair for pair in mine if not _wrong(pair[1])]
    good.sort(key=lambda pair: (_time(pair[0].when or pair[1].when), pair[0].upload, _time(pair[1].own)))
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


def alike(students: Sequence[str]) -> list[str]:
    """Notes on names that differ in numbers, dates or the word `attempt` only: one student may be behind them."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for student in students:
        words = re.findall(r"[^\W\d_]{2,}", student.lower())
        key = tuple(word for word in words if word not in ("attempt", "am", "pm", "late"))
        groups.setdefault(key, []).append(student)
    return [
        f"{listed(names)} look like hand-ins of one student, and count as {len(names)} students: if they are one, give "
        "the folder of that student only what is to count."
        for key, names in groups.items()
        if key and len(names) > 1
    ]


def _time(when):
    return when or datetime.min


def _wrong(member):
    folder = member.folder or any(map(is_notebook, member.parts[:-1]))
    return "is a folder" if folder else member.wrong
