"""What `labkit grade` was told of a lab the last time, and with which marks its pages were written.

So `labkit mark` can write them anew, and knows where that is needed.
"""

import hashlib
import json
from argparse import Namespace
from collections.abc import Iterable
from datetime import datetime
from pathlib import Path

from ..records import Result
from .gradebook import Gradebook

_FILES = ("submissions", "moodle", "canvas")


def remember(book: Gradebook, lab: str, args: Namespace, results: Iterable[Result]) -> None:
    """These `results` of a lab are written out, with these options."""
    kept: dict[str, object] = {}
    for name, value in vars(args).items():
        if isinstance(value, datetime):
            kept[name] = {"time": value.isoformat()}
        elif value and name in _FILES:
            kept[name] = str(Path(value).resolve())
        elif isinstance(value, str | int | float | list | None):
            kept[name] = value
    stored = json.dumps({"options": kept, "marks": _digest(results)})
    book.db.execute("INSERT OR REPLACE INTO meta VALUES (?, ?)", (f"told {lab}", stored))


def recall(book: Gradebook, lab: str) -> Namespace:
    """The options of the last time, those that say nothing where there was none."""
    options = _told(book, lab).get("options", {})
    times = {name: datetime.fromisoformat(value["time"]) for name, value in options.items() if isinstance(value, dict)}
    nothing = dict.fromkeys(("csv", "moodle", "canvas", "grade_column", "feedback_column", "column", "due", "partial"))
    return Namespace(**{**nothing, **options, **times})


def outdated(book: Gradebook) -> list[str]:
    """The labs of which marks have changed since all was written out."""
    return [lab for lab in book.labs() if _told(book, lab).get("marks") != _digest(book.results(lab))]


def _told(book, lab):
    rows = book.db.execute("SELECT value FROM meta WHERE key = ?", (f"told {lab}",)).fetchall()
    return json.loads(rows[0][0]) if rows else {}


def _digest(results):
    marks = [(result.id, mark.check, mark.points, mark.reason) for result in results for mark in result.marks]
    return hashlib.sha256(json.dumps(marks).encode()).hexdigest()
