"""How many of the known mistakes each hidden check catches, the same whatever it draws.

A draw on which a known mistake stays out of sight would give points to a wrong answer that gets none from another
draw. So `labkit build` tries each hidden check on the known mistakes of its subject, with many draws, and keeps in
solutions/checks/bite.json those draws that catch what most of them catch, no more and no less: students get these.
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
from . import runs
from .mistakes import caught
from .paper import CheckCell, gives_points, read
from .record import FILE, recorded

DRAWS, MOST = 50, 200  # draws that are tried, and the most of them while few are good
ENOUGH = 20  # good draws: a class is to get different ones


def main(root: Path, labs: Collection[str] = (), check: bool = False) -> int:
    """Measure (or with `check` only look for) what has changed of these labs, by default all; exit status."""
    labs = labs or sorted(path.stem for path in (root / "solutions").glob("[0-9]*_*.ipynb"))
    try:
        labs = [lab for lab in labs if gives_points(lab)]
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
        print(f"trying {len(stale)} hidden checks on known mistakes, with {DRAWS} draws or more each ...", flush=True)
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
    """Of all that decides what a cell catches; of labkit's own code only how runs are compared."""
    exam = room(lab)["exam"]
    compared = Path(runs.__file__).read_text(encoding="utf-8")
    parts = [read_setup(lab), cell.source, exam.forms(cell.uses), compared, DRAWS, MOST, ENOUGH]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:16]


@cache
def read_setup(lab: str) -> str:
    """The code that runs before a lab's check cells."""
    return read(lab).setup


def measure(lab: str, id: str, draws: int = DRAWS, most: int = MOST, enough: int = ENOUGH) -> dict[str, Any]:
    """What a hidden check catches: {"known", "always": how many, "tried", "draws": the good ones, "chance"}.

    chance: {mistake: share of the tried draws that catch it}, for those that not all draws treat alike.
    """
    cell = next(cell for cell in _hidden(lab) if cell.id == id)
    exam = room(lab)["exam"]
    exam.current = id
    known = [mistake for subject in cell.uses for mistake in exam.wrong(subject)]
    found: list[set[str]] = []
    good: list[int] = []
    while len(good) < enough and len(found) < most:
        for exam.place in range(len(found), len(found) + draws):
            found.append(caught(exam, cell.source, room(lab), cell.uses))
        share = {mistake: sum(mistake in of for of in found) / len(found) for mistake in known}
        usual = {mistake for mistake in known if share[mistake] >= 0.5}
        good = [place for place, of in enumerate(found) if of == usual]
    chance = {mistake: round(one, 3) for mistake, one in share.items() if 0 < one < 1}
    return {"known": len(known), "always": len(usual), "tried": len(found), "draws": good, "chance": chance}


def _hidden(lab):
    return [cell for cell in read(lab).cells if cell.hidden and cell.points is not None]


def _told(lab: str, id: str, found: Mapping[str, Any]) -> Iterable[str]:
    """Print a check's line of the table; sentences about what is wrong with it."""
    good, tried = len(found["draws"]), found["tried"]
    few = f", on {good} of {tried} draws; no other is used" if good < tried else ""
    print(f"{lab}  {id:24} catches {found['always']:3} of {found['known']:3} known mistakes{few}")
    where = f"solutions/{lab}.py: the hidden check '{id}'"
    if found["known"] and not found["always"]:
        yield f"{where} catches none of the known mistakes. Let it draw what shows some, or leave it out."
    elif good < ENOUGH:
        worst = sorted(found["chance"], key=lambda mistake: abs(found["chance"][mistake] - 0.5))[:3]
        shown = ", ".join(f"'{mistake}' in {found['chance'][mistake]:.0%}" for mistake in worst)
        yield (
            f"{where} treats the same wrong answer differently from draw to draw: it catches {shown} of {tried} draws, "
            f"and only {good} catch what most do. Let it draw what always shows such a mistake (more steps, more "
            "landmarks, a case added by hand), or never does."
        )
