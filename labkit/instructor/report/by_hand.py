"""Marks that people gave: all are kept, the newest counts, and none takes the place of one that its giver had not seen.

Whoever gives marks is a reader. What a reader gives at once, to one answer or to many alike, is an act; it has a name
of its own, so that an act that is told twice counts once.
"""

import json
import time
from collections import Counter
from collections.abc import Collection, Sequence
from datetime import datetime
from typing import TYPE_CHECKING, NamedTuple

from ..records import Check, Result
from .texts import cut

if TYPE_CHECKING:
    from .gradebook import Gradebook

TABLE = "grades.csv"  # the reader of what was filled in there
LONGEST = 2000  # characters of a comment
PATIENCE = 600  # [s] for which an answer is kept for who looks at it
Of = tuple[str, str, str]  # (student, identifier, check id)


class Slot(NamedTuple):
    """Where a mark is given: a check of a submission. seen: the number of the newest mark that its giver knows of."""

    result: Result
    check: str
    seen: int = 0


class Given(NamedTuple):
    """A mark that a person gave, points None if it was taken back. number: larger than those of all earlier ones;
    ticks: numbers of the rubric's lines that it is made of;  answer: the one that was marked.
    """

    number: int
    reader: str
    points: float | None
    reason: str
    ticks: tuple[int, ...]
    at: str
    answer: str | None


_GIVEN = "id, reader, points, reason, ticks, at, answer"
_SLOT = "lab = ? AND student = ? AND identifier = ? AND chk = ?"


class Hands:
    """What people gave of what is in `book`."""

    def __init__(self, book: "Gradebook") -> None:
        self.book, self.db = book, book.db

    def questions(self, lab: str) -> list[Check]:
        """The written questions that a lab has asked, each as it was asked last; twice, if its points have changed."""
        papers = self.db.execute("SELECT checks FROM paper WHERE lab = ? ORDER BY rowid", (lab,))
        every = [Check(**check) for (checks,) in papers for check in json.loads(checks)]
        return [*{(check.id, check.points): check for check in every if check.hand}.values()]

    def readers(self, lab: str) -> dict[str, int]:
        """How many marks of each reader count in a lab."""
        return dict(Counter(given.reader for given in self.newest(lab).values() if given.points is not None))

    def give(
        self, act: str, reader: str, slots: Sequence[Slot], points: float, reason: str, ticks: Sequence[int] = ()
    ) -> list[Slot]:
        """Give the same mark in all slots, or, if anything is new in some of them, in none: returns these."""
        with self.book:
            if self._known(act):
                return []
            if moved := [slot for slot in slots if self._moved(slot)]:
                return moved
            for slot in slots:
                self._mark(slot.result, slot.check, points, reason, ticks, reader, act)
        return []

    def fill_in(self, result: Result, check: str, points: float, reason: str) -> None:
        """Take in a mark of grades.csv, whatever there was before."""
        self._mark(result, check, points, reason, (), TABLE, "")

    def pass_by(self, result: Result, check: str, points: float, reason: str) -> None:
        """Keep a mark of grades.csv that does not count: the newest one goes on to do so."""
        of = (result.lab, result.student, result.identifier, check)
        with self.book:
            self.fill_in(result, check, points, reason)
            self._restore("", self.all_of(*of)[-1].number, *of)

    def undo(self, act: str, reader: str) -> list[tuple[str, *Of, bool]]:
        """Take back a reader's last act that still stands somewhere; what was there before counts again.

        Returns (lab, student, identifier, check id, whether it was taken back) of all that it had marked: not where
        somebody has given another mark since.
        """
        newest = "SELECT max(id) FROM hand GROUP BY lab, student, identifier, chk"
        last = (
            "SELECT h.act FROM hand h JOIN hand n ON h.id = ifnull(n.stands, n.id) "
            f"WHERE n.id IN ({newest}) AND h.reader = ? AND h.act <> '' ORDER BY h.id DESC LIMIT 1"
        )
        with self.book:
            if self._known(act):
                again = "SELECT lab, student, identifier, chk FROM hand WHERE act = ?"
                return [(*of, True) for of in self.db.execute(again, (act,)).fetchall()]
            found = self.db.execute(last, (reader,)).fetchall()
            if not found:
                return []
            rows = self.db.execute(
                "SELECT id, lab, student, identifier, chk FROM hand WHERE act = ? AND stands IS NULL", found[0]
            ).fetchall()
            return [(*of, self._restore(act, number, *of)) for number, *of in rows]

    def _restore(self, act: str, number: int, *of: str) -> bool:
        """Let what was there before the mark `number` count again, if that one still counts."""
        now = f"SELECT ifnull(stands, id) FROM hand WHERE {_SLOT} ORDER BY id DESC LIMIT 1"
        if self.db.execute(now, of).fetchone() != (number,):
            return False
        before = (
            "SELECT points, reason, ticks, reader, ifnull(stands, id), at, answer FROM hand "
            f"WHERE {_SLOT} AND id < ? ORDER BY id DESC LIMIT 1"
        )
        none = (None, "", "[]", "", 0, _now(), None)
        points, reason, ticks, reader, stands, at, answer = self.db.execute(before, (*of, number)).fetchone() or none
        self._add(*of, points, reason, ticks, reader, act, stands, at, answer)
        return True

    def _mark(self, result, check, points, reason, ticks, reader, act):
        of = (result.lab, result.student, result.identifier, check)
        told = (cut(reason, LONGEST), json.dumps([*ticks]))
        self._add(*of, points, *told, reader, act, None, _now(), result.answers.get(check))

    def _add(self, *row: object) -> None:
        columns = "lab, student, identifier, chk, points, reason, ticks, reader, act, stands, at, answer"
        self.db.execute(f"INSERT INTO hand ({columns}) VALUES ({', '.join('?' * len(row))})", row)

    def _known(self, act: str) -> bool:
        return bool(act) and bool(self.db.execute("SELECT 1 FROM hand WHERE act = ?", (act,)).fetchall())

    def _moved(self, slot: Slot) -> bool:
        """Whether there is another mark than the one that was seen, or another hand-in."""
        of = (slot.result.lab, slot.result.student, slot.result.identifier, slot.check)
        newest = self.db.execute(f"SELECT ifnull(max(id), 0) FROM hand WHERE {_SLOT}", of).fetchone()
        counts = self.db.execute("SELECT current FROM submission WHERE id = ?", (slot.result.id,)).fetchone()
        return newest != (slot.seen,) or counts != (1,)

    def newest(self, lab: str) -> dict[Of, Given]:
        """The newest mark of each check of each student, also where it was taken back."""
        query = (
            "SELECT student, identifier, chk, max(id), reader, points, reason, ticks, at, answer FROM hand "
            "WHERE lab = ? GROUP BY student, identifier, chk"
        )  # SQLite takes the other columns from the row with the largest id
        return {(*of,): _given(rest) for *of, rest in ((*r[:3], r[3:]) for r in self.db.execute(query, (lab,)))}

    def all_of(self, lab: str, student: str, identifier: str, check: str) -> list[Given]:
        """All marks that people gave for one check of one student, the first one first."""
        query = f"SELECT {_GIVEN} FROM hand WHERE {_SLOT} ORDER BY id"
        return [_given(row) for row in self.db.execute(query, (lab, student, identifier, check))]

    def counting(self, lab: str, student: str, identifier: str) -> dict[str, tuple]:
        """{check id: (points, reason, answer that was marked)} of one student."""
        query = (
            "SELECT chk, max(id), points, reason, answer FROM hand WHERE lab = ? AND student = ? AND identifier = ? "
            "GROUP BY chk"
        )
        rows = self.db.execute(query, (lab, student, identifier))
        return {check: mark for check, _, *mark in rows if mark[0] is not None}

    def comments(self, lab: str, check: str) -> list[str]:
        """The lines of all comments that were given to answers to one question, those in most use first."""
        query = "SELECT max(id), points, reason FROM hand WHERE lab = ? AND chk = ? GROUP BY student, identifier"
        used: Counter[str] = Counter()
        for (reason,) in self.db.execute("SELECT DISTINCT reason FROM hand WHERE lab = ? AND chk = ?", (lab, check)):
            used.update({line.strip(): 0 for line in reason.splitlines() if line.strip()})
        for _, points, reason in self.db.execute(query, (lab, check)):
            used.update(line.strip() for line in reason.splitlines() if line.strip() and points is not None)
        return [line for line, _ in used.most_common()]

    def deal(self, reader: str, check: str, groups: Sequence[Collection[int]]) -> int | None:
        """The place of the first of `groups`, of submissions' ids, at which nobody else looks; kept for this reader
        for a while, who gives up what was kept before. None if there is none.
        """
        with self.book:
            self.db.execute("DELETE FROM held WHERE reader = ? OR until < ?", (reader, time.time()))
            taken = {id for (id,) in self.db.execute("SELECT submission FROM held WHERE chk = ?", (check,))}
            for place, group in enumerate(groups):
                if taken.isdisjoint(group):
                    self.hold(reader, check, group)
                    return place
        return None

    def hold(self, reader: str, check: str, ids: Collection[int]) -> None:
        """Keep answers for a reader, but for those that somebody else looks at."""
        until = time.time() + PATIENCE
        with self.book:
            self.db.execute("DELETE FROM held WHERE reader = ? OR until < ?", (reader, time.time()))
            self.db.executemany(
                "INSERT OR IGNORE INTO held VALUES (?, ?, ?, ?)", [(i, check, reader, until) for i in ids]
            )

    def held(self, check: str) -> dict[int, str]:
        """{id of a submission: who looks at its answer}."""
        query = "SELECT submission, reader FROM held WHERE chk = ? AND until >= ?"
        return dict(self.db.execute(query, (check, time.time())))


def _given(row: Sequence) -> Given:
    number, reader, points, reason, ticks, *rest = row
    return Given(number, reader, points, reason, tuple(json.loads(ticks)), *rest)


def _now() -> str:
    return datetime.now().isoformat(timespec="seconds")
