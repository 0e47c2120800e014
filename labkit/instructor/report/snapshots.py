"""What grades.csv held when it was written, so that a person's changes in it can be told from ours.

One is added before the file is written, and the older ones go when it is: whatever fails or is killed in between, that
of the file which is there is kept.
"""

import json
import sqlite3
from collections.abc import Iterable

from ..records import Mark, Result

MOST = 9  # runs that failed one after the other


def add(db: sqlite3.Connection, results: Iterable[Result]) -> None:
    """Remember what grades.csv is going to hold."""
    new = json.dumps(
        [
            [*(r.student, r.identifier, r.lab, r.source)]
            + [[[m.check, m.points, m.max_points, m.status, m.reason] for m in r.marks]]
            for r in results
        ]
    )
    kept = [new, *(old for old in _stored(db) if old != new)]
    # The oldest is of the file that is there, if none of the newer ones was written.
    kept = kept[: MOST - 1] + kept[-1:] if len(kept) > MOST else kept
    db.execute("DELETE FROM meta WHERE key LIKE 'written%'")
    db.executemany("INSERT INTO meta VALUES (?, ?)", [(f"written-{n}", one) for n, one in enumerate(kept, 1)])


def settle(db: sqlite3.Connection) -> None:
    """The file holds what was added last."""
    db.execute("DELETE FROM meta WHERE key LIKE 'written%' AND key > 'written-1'")


def read(db: sqlite3.Connection) -> list[list[Result]]:
    """Results as grades.csv may hold them, the newest first."""
    return [
        [
            Result(name, number, lab, source, marks=[Mark(*mark) for mark in marks])
            for name, number, lab, source, marks in json.loads(snapshot)
        ]
        for snapshot in _stored(db)
    ]


def _stored(db):
    return [value for (value,) in db.execute("SELECT value FROM meta WHERE key LIKE 'written%' ORDER BY key")]
