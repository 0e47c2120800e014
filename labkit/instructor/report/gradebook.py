"""The gradebook: one SQLite file that knows every submission, every mark and what came before it.

Each mark is committed when it comes, so that a grader that is killed has lost nothing and doubles nothing.
"""

import io
import json
import secrets
import sqlite3
from datetime import datetime

import numpy as np

from .. import records
from ..records import Check, CommandError, Mark, Result

VERSION = 1
TABLES = """
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT);
CREATE TABLE paper (lab TEXT, digest TEXT, checks TEXT, PRIMARY KEY (lab, digest));
CREATE TABLE submission (
    id INTEGER PRIMARY KEY, lab TEXT, student TEXT, identifier TEXT, source TEXT, digest TEXT, paper TEXT,
    handed_in TEXT, late INTEGER, notes TEXT, answers TEXT, level INTEGER, problem TEXT, done INTEGER, current INTEGER, added TEXT);
CREATE INDEX by_student ON submission (lab, student, identifier);
CREATE TABLE mark (
    submission INTEGER REFERENCES submission, chk TEXT, points REAL, status TEXT, reason TEXT, lines TEXT,
    mistake TEXT, at TEXT, PRIMARY KEY (submission, chk));
CREATE TABLE hand (
    lab TEXT, student TEXT, identifier TEXT, chk TEXT, points REAL, reason TEXT, answer TEXT, at TEXT,
    PRIMARY KEY (lab, student, identifier, chk));
CREATE TABLE figure (submission INTEGER PRIMARY KEY, data BLOB);
"""


class Gradebook:
    """path: of the file; made if it is not there. Raises CommandError if the file is none."""

    def __init__(self, path, seed=None):
        self.path, self._depth = path, 0
        try:
            self.db = sqlite3.connect(path, timeout=5, isolation_level=None)
            self.db.execute("PRAGMA journal_mode=WAL")
            self.db.execute("PRAGMA synchronous=NORMAL")
            with self:
                if not self._all("SELECT name FROM sqlite_master WHERE name = 'meta'"):
                    for statement in TABLES.split(";"):
                        self.db.execute(statement)
                    first = {"version": VERSION, "seed": secrets.randbits(62) if seed is None else seed}
                    self.db.executemany("INSERT INTO meta VALUES (?, ?)", [(k, str(v)) for k, v in first.items()])
            meta = dict(self._all("SELECT key, value FROM meta"))
        except sqlite3.Error as error:
            raise CommandError(
                f"{path} cannot be used as a gradebook ({error}): move it away, or choose another --out."
            ) from None
        if meta.get("version") != str(VERSION):
            raise CommandError(
                f"{path} was made by another version of this kit: finish with that one, or choose another --out."
            )
        self.seed = int(meta["seed"])
        if seed is not None and seed != self.seed:
            raise CommandError(
                f"{path} was begun with --seed {self.seed}: leave the option out, or choose another --out."
            )

    def __enter__(self):
        """All or nothing; inside another one it is part of that."""
        self._depth += 1
        if self._depth == 1:
            self.db.execute("BEGIN IMMEDIATE")
        return self

    def __exit__(self, kind, *_):
        self._depth -= 1
        if self._depth == 0:
            self.db.execute("ROLLBACK" if kind else "COMMIT")

    def _all(self, query, *values):
        return self.db.execute(query, values).fetchall()

    def close(self):
        self.db.close()

    def set_paper(self, lab, digest, checks):
        """Remember what a lab asks for."""
        stored = json.dumps([vars(check) for check in checks])
        self.db.execute("INSERT OR REPLACE INTO paper VALUES (?, ?, ?)", (lab, digest, stored))

    def checks(self, lab, digest):
        ((stored,),) = self._all("SELECT checks FROM paper WHERE lab = ? AND digest = ?", lab, digest)
        return [Check(**check) for check in json.loads(stored)]

    def find(self, lab, student, identifier, digest):
        """(id, done, paper) of the newest row for this very submission, or None."""
        rows = self._all(
            "SELECT id, done, paper FROM submission WHERE lab = ? AND student = ? AND identifier = ? AND digest = ? "
            "ORDER BY id DESC LIMIT 1",
            lab,
            student,
            identifier,
            digest,
        )
        return rows[0] if rows else None

    def add(self, lab, student, identifier, source, digest, paper, when, late, notes, answers, problem=""):
        """A new submission; returns its id. One that cannot be graded is done at once."""
        row = (
            lab,
            student,
            identifier,
            source,
            digest,
            paper,
            when and when.isoformat(),
            int(late),
            json.dumps(notes),
            json.dumps(answers),
            0,
            problem,
            int(bool(problem)),
            0,
            _now(),
        )
        columns = (
            "lab, student, identifier, source, digest, paper, handed_in, late, notes, answers, level, problem, "
            "done, current, added"
        )
        marks = ", ".join("?" * len(row))
        return self.db.execute(f"INSERT INTO submission ({columns}) VALUES ({marks})", row).lastrowid

    def set_level(self, ids, level):
        """The sandbox level that these submissions are graded at."""
        with self:
            self.db.executemany("UPDATE submission SET level = ? WHERE id = ?", [(level, id) for id in ids])

    def choose(self, id, notes, late):
        """Let this submission be the one that counts for its student and lab; the others are history."""
        with self:
            self.db.execute(
                "UPDATE submission SET current = 0 WHERE EXISTS (SELECT 1 FROM submission n WHERE n.id = ? AND "
                "n.lab = submission.lab AND n.student = submission.student AND n.identifier = submission.identifier)",
                (id,),
            )
            self.db.execute(
                "UPDATE submission SET current = 1, notes = ?, late = ? WHERE id = ?",
                (json.dumps(notes), int(late), id),
            )

    def choose_best(self, lab):
        """Let each student's submission with the most points count, of those that could be graded."""
        rows = self._all(
            "SELECT id, student, identifier, (SELECT sum(points) FROM mark WHERE submission = s.id) FROM submission s "
            "WHERE lab = ? AND problem = '' ORDER BY 4, id",
            lab,
        )
        best = {(student, identifier): id for id, student, identifier, _ in rows}
        with self:
            for id in best.values():
                ((notes, late),) = self._all("SELECT notes, late FROM submission WHERE id = ?", id)
                self.choose(id, json.loads(notes), late)

    def retry(self, lab):
        """Forget the checks that could not be run through no fault of their students, so that they run now."""
        failed = "SELECT id FROM submission JOIN mark ON submission = id WHERE lab = ? AND status = ?"
        with self:
            self.db.execute(f"UPDATE submission SET done = 0 WHERE id IN ({failed})", (lab, records.ERROR))
            self.db.execute(
                f"DELETE FROM mark WHERE status = ? AND submission IN ({failed})", (records.ERROR, lab, records.ERROR)
            )

    def unfinished(self, lab):
        """Whether there are submissions that were not graded to the end."""
        return bool(self._all("SELECT 1 FROM submission WHERE lab = ? AND done = 0 LIMIT 1", lab))

    def mark(self, id, check, points, status, reason="", lines=(), mistake=""):
        """Commit one mark; the first one counts, should it come twice."""
        row = (id, check, points, status, reason, json.dumps(list(lines)), mistake, _now())
        self.db.execute("INSERT OR IGNORE INTO mark VALUES (?, ?, ?, ?, ?, ?, ?, ?)", row)

    def marked(self, id):
        """The checks of a submission that have a mark."""
        return {chk for (chk,) in self._all("SELECT chk FROM mark WHERE submission = ?", id)}

    def finish(self, id, figure=None):
        """All checks of a submission are marked. figure: {name: array} or None."""
        with self:
            if figure:
                packed = io.BytesIO()
                np.savez_compressed(packed, **figure)
                self.db.execute("INSERT OR REPLACE INTO figure VALUES (?, ?)", (id, packed.getvalue()))
            self.db.execute("UPDATE submission SET done = 1 WHERE id = ?", (id,))

    def hand(self, result, check, points, reason):
        """A mark that a person gave; it stays until a person gives another."""
        row = (result.lab, result.student, result.identifier, check, points, reason, result.answers.get(check), _now())
        self.db.execute("INSERT OR REPLACE INTO hand VALUES (?, ?, ?, ?, ?, ?, ?, ?)", row)

    def written(self):
        """Lists of results as grades.csv held them when it was last written, and the time before: see `wrote`."""
        stored = [
            json.loads(value) for (value,) in self._all("SELECT value FROM meta WHERE key LIKE 'written%' ORDER BY key")
        ]
        return [
            [Result(*about, marks=[Mark(*mark) for mark in marks]) for *about, marks in snapshot] for snapshot in stored
        ]

    def wrote(self, results):
        """Remember what grades.csv is going to hold, so that a person's changes in it can be told from ours.

        Two are kept, since a grader may be killed between this and the writing.
        """
        snapshot = [
            [
                r.student,
                r.identifier,
                r.lab,
                r.source,
                [[m.check, m.points, m.max_points, m.status, m.reason] for m in r.marks],
            ]
            for r in results
        ]
        with self:
            self.db.execute("DELETE FROM meta WHERE key = 'written-2'")
            self.db.execute("UPDATE meta SET key = 'written-2' WHERE key = 'written-1'")
            self.db.execute("INSERT INTO meta VALUES ('written-1', ?)", (json.dumps(snapshot),))

    def labs(self):
        return [lab for (lab,) in self._all("SELECT DISTINCT lab FROM submission ORDER BY lab")]

    def results(self, lab, figures=False):
        """A generator of Result, one for each student, by name: of the submission that counts."""
        ids = self._all(
            "SELECT id FROM submission WHERE lab = ? AND current = 1 ORDER BY student COLLATE NOCASE, identifier", lab
        )
        for (id,) in ids:
            yield self.result(id, figures)

    def result(self, id, figure=False):
        """The Result of one submission."""
        ((lab, student, identifier, source, paper, when, late, notes, answers, level, problem),) = self._all(
            "SELECT lab, student, identifier, source, paper, handed_in, late, notes, answers, level, problem "
            "FROM submission WHERE id = ?",
            id,
        )
        when = datetime.fromisoformat(when) if when else None
        result = Result(
            student,
            identifier,
            lab,
            source,
            when,
            bool(late),
            json.loads(notes),
            level,
            problem,
            answers=json.loads(answers),
            id=id,
        )
        if problem:
            return result
        given = {
            row[0]: row[1:]
            for row in self._all(
                "SELECT chk, points, status, reason, lines, mistake FROM mark WHERE submission = ?", id
            )
        }
        hand = {
            row[0]: row[1:]
            for row in self._all(
                "SELECT chk, points, reason, answer FROM hand WHERE lab = ? AND student = ? AND identifier = ?",
                lab,
                student,
                identifier,
            )
        }
        for check in self.checks(lab, paper):
            if check.id in hand:
                points, reason, answer = hand[check.id]
                if answer != result.answers.get(check.id):
                    reason = f"{reason} (The answer has changed since it was marked.)".strip()
                mark = Mark(check.id, points, check.points, records.BY_HAND, reason)
            elif check.hand:
                mark = Mark(check.id, None, check.points, records.OPEN)
            elif check.id in given:
                points, status, reason, lines, mistake = given[check.id]
                if level == 0:
                    reason = f"{reason} (Marked without a sandbox.)".strip()
                mark = Mark(check.id, points, check.points, status, reason, tuple(json.loads(lines)), mistake)
            else:
                mark = Mark(check.id, 0.0, check.points, records.NOT_RUN, "Not graded yet.")
            result.marks.append(mark)
        if figure:
            result.figure = self.figure(id)
        return result

    def figure(self, id):
        rows = self._all("SELECT data FROM figure WHERE submission = ?", id)
        if not rows:
            return {}
        with np.load(io.BytesIO(rows[0][0]), allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}

    def history(self, lab):
        """[(student, identifier, source, points, added)] of all done submissions, the oldest first."""
        return self._all(
            "SELECT student, identifier, source, (SELECT sum(points) FROM mark WHERE submission = s.id), added "
            "FROM submission s WHERE lab = ? AND done = 1 ORDER BY id",
            lab,
        )


def _now():
    return datetime.now().isoformat(timespec="seconds")
