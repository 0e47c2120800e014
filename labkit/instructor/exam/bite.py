"""How many of the known mistakes each hidden check catches, and whether it does so whatever it draws.

`labkit build` tries each hidden check on the known mistakes of its subject, with what is drawn for many students, and
keeps what came in solutions/checks/bite.json. A mistake that is missed now and then is to be seen before a draw
counts (`must`); one that is seen now and then only is a fault of the check.
"""

import hashlib
import json
import os
from collections.abc import Collection, Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

from .. import files
from ..records import CommandError
from .paper import CheckCell, read
from .record import FILE, recorded
from .rehearsal import TRIES, caught

DRAWS = 50
CHANCE = 0.02  # of the draws may give a known mistake another mark than the others
ENOUGH = 1 / 3  # of the draws must do, or each student waits for many


def main(root: Path, labs: Collection[str] = (), check: bool = False) -> int:
    """Measure (or with `check` only look for) what has changed of these labs, by default all; exit status."""
    labs = labs or sorted(path.stem for path in (root / "solutions").glob("[0-9]*_*.ipynb"))
    try:
        cells = {(lab, cell.id): digest(lab, cell) for lab in labs for cell in _hidden(lab)}
    except CommandError as error:
        print(error)
        return 1
    known = recorded(root)
    stale = [key for key, of in cells.items() if known.get(key[0], {}).get(key[1], {}).get("digest") != of]
    if check:
        for lab, id in stale:
            print(f"solutions/checks/{FILE} does not know the check '{id}' of {lab} as it is now: run `labkit build`.")
        return 1 if stale else 0
    if stale:
        print(f"trying {len(stale)} hidden checks on known mistakes, with {DRAWS} draws each ...", flush=True)
    with ProcessPoolExecutor(min(len(stale), os.cpu_count() or 1) or 1) as here:
        for (lab, id), found in zip(stale, here.map(measure, *zip(*stale)) if stale else ()):
            known.setdefault(lab, {})[id] = {"digest": cells[lab, id], **found}
    for lab in labs:
        known[lab] = {id: known[lab][id] for one, id in cells if one == lab}
    files.write(root / "solutions" / "checks" / FILE, json.dumps(known, indent=1, ensure_ascii=False) + "\n")
    problems = [problem for key in cells for problem in _told(*key, known[key[0]][key[1]])]
    print("\n".join(problems), end="\n" if problems else "")
    return 1 if problems else 0


@cache
def room(lab: str) -> dict[str, Any]:
    """The names that a lab's check cells start with."""
    names: dict[str, Any] = {}
    exec(read(lab).setup, names)
    return names


def digest(lab: str, cell: CheckCell) -> str:
    """Of all that decides what a cell catches, but for labkit's own code."""
    exam = room(lab)["exam"]
    parts = [read_setup(lab), cell.source, exam.forms(cell.uses), DRAWS, CHANCE, ENOUGH]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:16]


@cache
def read_setup(lab: str) -> str:
    """The code that runs before a lab's check cells."""
    return read(lab).setup


def measure(lab: str, id: str, draws: int = DRAWS) -> dict[str, Any]:
    """What a hidden check catches: {"known", "always", "never", "must", "enough", "chance": {mistake: share}}."""
    cell = next(cell for cell in _hidden(lab) if cell.id == id)
    exam = room(lab)["exam"]
    exam.current = id
    known = [mistake for subject in cell.uses for mistake in exam.wrong(subject)]

    @cache
    def look(student, attempt, only):
        return caught(exam, cell.source, room(lab), cell.uses, only)

    def draw(student, must):
        """What is caught on the first draw that counts, and which that is."""
        exam.student = f"student {student}"
        for exam.attempt in range(TRIES):
            if look(student, exam.attempt, tuple(must)).issuperset(must):
                break
        return look(student, exam.attempt, None), exam.attempt + 1

    must: list[str] = []
    while True:
        found = [draw(student, must) for student in range(draws)]
        share = {mistake: sum(mistake in of for of, _ in found) / draws for mistake in known}
        chance = {mistake: one for mistake, one in share.items() if CHANCE < one < 1 - CHANCE}
        enough = draws / sum(tries for _, tries in found)
        missed = [mistake for mistake, one in chance.items() if one >= ENOUGH and mistake not in must]
        if not missed or enough < ENOUGH:
            break
        must.append(min(missed, key=lambda mistake: share[mistake]))
    always, never = (sum(test(one) for one in share.values()) for test in (_is_all, _is_none))
    return {
        "known": len(known),
        "always": always,
        "never": never,
        "must": must,
        "enough": round(enough, 3),
        "chance": chance,
    }


def _is_all(share):
    return share >= 1 - CHANCE


def _is_none(share):
    return share <= CHANCE


def _hidden(lab):
    return [cell for cell in read(lab).cells if cell.hidden and cell.points is not None]


def _told(lab: str, id: str, found: Mapping[str, Any]) -> Iterable[str]:
    """Print a check's line of the table; sentences about what is wrong with it."""
    again = f", draws again for {len(found['must'])} of them ({found['enough']:.0%} of the draws will do)"
    print(
        f"{lab}  {id:24} catches {found['always']:3} of {found['known']:3} known mistakes{again * bool(found['must'])}"
    )
    where = f"solutions/{lab}.py: the hidden check '{id}'"
    for mistake, share in found["chance"].items():
        yield (
            f"{where} catches the known mistake '{mistake}' in {share:.0%} of what it draws: the same wrong answer "
            "would get different marks. Let it draw what always shows this mistake (more steps, more landmarks, a case "
            "added by hand), or never does."
        )
    if found["enough"] < ENOUGH:
        yield (
            f"{where} shows its known mistakes ({', '.join(found['must'])}) in {found['enough']:.0%} of what it draws "
            "only, so that it would draw again and again. Let it draw what shows them more often."
        )
    if found["known"] and not found["always"]:
        yield f"{where} catches none of the known mistakes. Let it draw what shows some, or leave it out."
