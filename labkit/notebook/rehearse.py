"""Run the checks of a lab on what a notebook leaves, as grading does."""

import json
import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from ..checks import DATA, CheckError, judge, stored
from ..checks.feedback import explain
from .limits import CALL, PATIENCE, TimeUpError, cpu_limit
from .read import Cell
from .session import Call, Session

GIVEN = Path(__file__).parent / "given.json"


@dataclass
class Rehearsal:
    """The checks of one notebook, whose session has run.

    slow: answers that have used up their time in a check before;  until: when all time is used up, by this process's.
    """

    session: Session
    slow: set[str] = field(default_factory=set)
    until: float = float("inf")

    def judge(self, check: str) -> list[str]:
        """What a check says of what the notebook leaves: lines for the student, none if it passes."""
        try:
            data = stored(check)
        except CheckError as error:
            return error.lines
        name = data["subject"]
        if name not in self.session.names:
            return self._missing(name)
        try:
            allowed = PATIENCE if name in self.slow else CALL
            with cpu_limit(min(allowed, max(self.until - time.process_time(), 0.1))) as limit:
                judge(data, self.session.names[name])
        except CheckError as error:
            return error.lines
        except TimeUpError as error:  # outside of what the check itself runs
            return explain(error).splitlines()
        finally:
            self.slow |= {name} if limit.reached else set()
        return []

    def _missing(self, name):
        problems = [*self.session.broken, *self.session.stopped.values()]
        told = [f"{problem.where}: {line}" for problem in problems[:3] for line in problem.lines[:3]]
        return [f"`{name}` is not there after your notebook has run.", *told]


def checks_of(path: Path | str, calls: Iterable[Call]) -> dict[str, str]:
    """{check: the cell that calls it} of a notebook: those that it calls, then those of its lab that it does not ('').

    The lab is the one whose checks it calls most, else the one that its file is named for.
    """
    labs = {head["name"]: head["lab"] for head in _heads()}
    called: dict[str, str] = {}
    for call in calls:
        called.setdefault(call.check, call.where)
    count = Counter(labs[check] for check in called if check in labs)
    lab = count.most_common(1)[0][0] if count else Path(path).stem
    return called | {check: "" for check in labs if labs[check] == lab and check not in called}


def given(checks: Iterable[str]) -> list[Cell]:
    """The code, but for answers, that the lab of these checks gives its students."""
    labs = {head["lab"] for head in _heads() if head["name"] in set(checks)}
    stored_cells = json.loads(GIVEN.read_text(encoding="utf-8")) if GIVEN.is_file() else {}
    return [Cell(number, id, role, True, text) for lab in labs for number, id, role, text in stored_cells.get(lab, [])]


def subjects(checks: Iterable[str]) -> set[str]:
    """The names that these checks look at."""
    return {head["subject"] for head in _heads() if head["name"] in set(checks)}


@cache
def _heads():
    """What stands before the scenarios in each check's file."""
    texts = [path.read_text(encoding="utf-8") for path in sorted(DATA.glob("*.json"))]
    return [json.loads(text.partition(',\n"scenarios"')[0] + "}") for text in texts]
