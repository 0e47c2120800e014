"""The gradebook: one SQLite file that knows every submission, every mark and what came before it.

Each mark is committed when it comes, so that a grader that is killed has lost nothing and doubles nothing.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from ..records import ERROR, Check, Result
from . import snapshots
from .by_hand import Hands
from .kept import SENTENCE, fit, pack, unpack
from .marks import mark_of
from .schema import connect
from .texts import cut


class Gradebook:
    """path: of the file; made if it is not there. seed: of the random inputs, drawn if not given.

    Raises CommandError if the file is none, or was begun with another seed.
    """

    def __init__(self, path: Path, seed: int | None = None):
        self.path, self._depth = path, 0
        self.db, self.seed = connect(path, seed)
        self.hands = Hands(self)

    def __enter__(self) -> "Gradebook":
        """All or nothing; inside another one it is part of that."""
        self._depth += 1
        if self._depth == 1:
            self.db.execute("BEGIN IMMEDIATE")
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        self._depth -= 1
        if self._depth == 0:
            if not kind:
                self.db.execute("COMMIT")
            elif self.db.in_transaction:  # what broke it may have ended it
                self.db.execute("ROLLBACK")

    def _all(self, query: str, *values: object) -> list[Any]:
        return self.db.execute(query, values).fetchall()

    def close(self) -> None:
        """Close the file; the gradebook is of no use after that."""
        self.db.close()

    def set_paper(self, lab: str, digest: str, checks: Iterable[Check]) -> None:
        """Remember what a lab asks for."""
        stored = json.dumps([vars(check) for check in checks])
        self.db.execute("INSERT OR REPLACE INTO paper VALUES (?, ?, ?)", (lab, digest, stored))

    def checks(self, lab: str, digest: str) -> list[Check]:
        """What a lab asked for, by the digest of its paper."""
        ((stored,),) = self._all("SELECT checks FROM paper WHERE lab = ? AND digest = ?", lab, digest)
        return [Check(**check) for check in json.loads(stored)]

    def counting(self) -> dict[int, tuple[str, ...]]:
        """{id: (lab, student, identifier)} of the submissions that count for anybody, by name."""
        passed = "SELECT value FROM json_each((SELECT value FROM meta WHERE key = 'passed over'))"
        query = (
            "SELECT id, lab, student, identifier FROM submission "
            f"WHERE current = 1 AND id NOT IN ({passed}) ORDER BY student, identifier"
        )
        return {id: (*of,) for id, *of in self._all(query)}

    def pass_over(self, ids: Iterable[int]) -> None:
        """Remember whose newest submissions count for nobody, since the course's rules let another one count."""
        self.db.execute("INSERT OR REPLACE INTO meta VALUES ('passed over', ?)", (json.dumps([*ids]),))

    def version(self) -> int:
        """A number that changes whenever somebody else has written into the file."""
        return self._all("PRAGMA data_version")[0][0]

    def find(self, lab: str, student: str, identifier: str, digest: str) -> tuple[int, bool, str] | None:
        """(id, done, paper) of the newest row for this very submission, or None."""
        query = (
            "SELECT id, done, paper FROM submission WHERE lab = ? AND student = ? AND identifier = ? AND digest = ? "
            "ORDER BY id DESC LIMIT 1"
        )
        return next(iter(self._all(query, lab, student, identifier, digest)), None)

    def add(
        self,
        lab: str,
        student: str,
        identifier: str,
        source: str,
        digest: str,
        paper: str,
        when: datetime | None,
        late: bool,
        notes: Sequence[str],
        answers: Mapping[str, str],
        problem: str = "",
    ) -> int:
        """A new submission; returns its id. One that cannot be graded is done at once."""
        columns = (
            "lab, student, identifier, source, digest, paper, handed_in, late, notes, answers, level, problem, "
            "done, current, added"
        )
        problem, notes = cut(problem, SENTENCE), [cut(note, SENTENCE) for note in notes]
        known = (lab, student, identifier, source, digest, paper, when and when.isoformat(), int(late))
        row = (*known, json.dumps(notes), json.dumps(answers), 0, problem, int(bool(problem)), 0, _now())
        marks = ", ".join("?" * len(row))
        return self.db.execute(f"INSERT INTO submission ({columns}) VALUES ({marks})", row).lastrowid or 0

    def set_level(self, ids: Iterable[int], level: int) -> None:
        """The sandbox level that these submissions are graded at."""
        with self:
            self.db.executemany("UPDATE submission SET level = ? WHERE id = ?", [(level, id) for id in ids])

    def choose(self, id: int, notes: Sequence[str], late: bool, when: datetime | None = None) -> None:
        """Let this submission be the one that counts for its student and lab; the others are history."""
        with self:
            self.db.execute(
                "UPDATE submission SET current = 0 WHERE EXISTS (SELECT 1 FROM submission n WHERE n.id = ? AND "
                "n.lab = submission.lab AND n.student = submission.student AND n.identifier = submission.identifier)",
                (id,),
            )
            now = (
                "UPDATE submission SET current = 1, notes = ?, late = ?, handed_in = ifnull(?, handed_in) WHERE id = ?"
            )
            self.db.execute(now, (json.dumps(notes), int(late), when and when.isoformat(), id))

    def attempts(self, lab: str) -> list[list[int]]:
        """The ids of each student's submissions of a lab that could be graded."""
        query = "SELECT student, identifier, id FROM submission WHERE lab = ? AND problem = '' ORDER BY id"
        found: dict[tuple[str, str], list[int]] = {}
        for student, identifier, id in self._all(query, lab):
            found.setdefault((student, identifier), []).append(id)
        return list(found.values())

    def called(self, names: Mapping[tuple[str, str], str]) -> dict[tuple[str, str], str]:
        """{(student, identifier): name} of whoever is to be called otherwise, those told in runs before too."""
        stored = self._all("SELECT value FROM meta WHERE key = 'names'")
        known = {(student, number): name for student, number, name in json.loads(stored[0][0] if stored else "[]")}
        known.update(names)
        rows = [(name, student, number) for (student, number), name in known.items()]
        with self:
            for table in ("submission", "hand"):
                query = f"UPDATE OR REPLACE {table} SET student = ? WHERE student = ? AND identifier = ?"
                self.db.executemany(query, rows)
            kept = json.dumps([[*of, name] for of, name in known.items()])
            self.db.execute("INSERT OR REPLACE INTO meta VALUES ('names', ?)", (kept,))
        return known

    def retry(self, lab: str) -> None:
        """Forget the checks that could not be run through no fault of their students, so that they run now."""
        failed = "SELECT id FROM submission JOIN mark ON submission = id WHERE lab = ? AND status = ?"
        with self:
            self.db.execute(f"UPDATE submission SET done = 0 WHERE id IN ({failed})", (lab, ERROR))
            self.db.execute(f"DELETE FROM mark WHERE status = ? AND submission IN ({failed})", (ERROR, lab, ERROR))

    def unfinished(self, lab: str) -> bool:
        """Whether there are submissions that were not graded to the end."""
        return bool(self._all("SELECT 1 FROM submission WHERE lab = ? AND done = 0 LIMIT 1", lab))

    def mark(
        self,
        id: int,
        check: str,
        points: float,
        status: str,
        reason: str = "",
        lines: Iterable[str] = (),
        mistake: str = "",
        parts: Iterable[str] = (),
    ) -> None:
        """Commit one mark, its texts cut; the first one counts, should it come twice."""
        row = (id, check, points, status, *fit(reason, lines, mistake), _now(), json.dumps([*parts]))
        self.db.execute("INSERT OR IGNORE INTO mark VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", row)

    def marked(self, id: int) -> set[str]:
        """The checks of a submission that have a mark."""
        return {chk for (chk,) in self._all("SELECT chk FROM mark WHERE submission = ?", id)}

    def finish(self, id: int, figure: Mapping[str, Any] | None = None) -> None:
        """All checks of a submission are marked. figure: that of `Result`, or None."""
        with self:
            if packed := pack(figure):
                self.db.execute("INSERT OR REPLACE INTO figure VALUES (?, ?)", (id, packed))
            self.db.execute("UPDATE submission SET done = 1 WHERE id = ?", (id,))

    def hand(self, result: Result, check: str, points: float, reason: str) -> None:
        """A mark that a person gave in grades.csv; it stays until a person gives another."""
        self.hands.fill_in(result, check, points, reason)

    def written(self) -> list[list[Result]]:
        """Results as grades.csv may hold them, see `snapshots`."""
        return snapshots.read(self.db)

    def wrote(self, results: Iterable[Result]) -> None:
        """Remember what grades.csv is going to hold."""
        with self:
            snapshots.add(self.db, results)

    def settled(self) -> None:
        """Grades.csv was written as it was going to be."""
        snapshots.settle(self.db)

    def labs(self) -> list[str]:
        """All labs of which there are submissions."""
        return [lab for (lab,) in self._all("SELECT DISTINCT lab FROM submission ORDER BY lab")]

    def results(self, lab: str) -> Iterator[Result]:
        """Each student's result, by name: of the submission that counts. Figures are left in the file."""
        query = "SELECT id FROM submission WHERE lab = ? AND current = 1 ORDER BY student COLLATE NOCASE, identifier"
        for (id,) in self._all(query, lab):
            yield self.result(id)

    def result(self, id: int) -> Result:
        """The result of one submission, without its figure."""
        query = (
            "SELECT lab, student, identifier, source, paper, handed_in, late, notes, answers, level, problem "
            "FROM submission WHERE id = ?"
        )
        ((lab, student, identifier, source, paper, when, late, notes, answers, level, problem),) = self._all(query, id)
        when = datetime.fromisoformat(when) if when else None
        result = Result(student, identifier, lab, source, when, bool(late), json.loads(notes), level, problem, id=id)
        answers = json.loads(answers)  # SQLite keeps no halves of characters, and marks are kept with their answers
        result.answers = {check: text.encode("utf-8", "replace").decode() for check, text in answers.items()}
        if not problem:
            given, hand = self._given(id), self.hands.counting(lab, student, identifier)
            result.marks = [mark_of(check, given, hand, result) for check in self.checks(lab, paper)]
        return result

    def _given(self, id: int) -> dict[str, tuple]:
        """{check id: (points, status, reason, lines, mistake, parts)} of what was run."""
        query = "SELECT chk, points, status, reason, lines, mistake, parts FROM mark WHERE submission = ?"
        rows = self._all(query, id)
        return {check: mark for check, *mark in rows}

    def figure(self, id: int) -> dict[str, Any]:
        """The figure of a submission's `Result`, {} if there is none."""
        rows = self._all("SELECT data FROM figure WHERE submission = ?", id)
        return unpack(rows[0][0]) if rows else {}


def _now() -> str:
    return datetime.now().isoformat(timespec="seconds")
