"""What a person filled in in grades.csv, taken into the gradebook, where others may have marked meanwhile."""

from pathlib import Path

from ..records import CommandError
from . import by_hand, hand_marks
from .gradebook import Gradebook
from .names import labels
from .texts import clean, plain


def take_hand_marks(book: Gradebook, path: Path) -> None:
    """Take the points that a person filled in in grades.csv into the gradebook. Raises CommandError for bad ones."""
    snapshots = book.written()
    if not path.exists() or not snapshots:
        return
    found, notes, before = _hand_marks(path, snapshots)
    now = {_of(result): result for lab in book.labs() for result in book.results(lab)}
    taken = 0
    with book:
        for (label, lab, check), (points, reason) in found.items():
            result = now.get(_of(before[label, lab]))
            if not result:
                continue
            told = _meanwhile(book, result, before[label, lab], check, points, reason)
            taken += told is None
            if told is None:
                book.hand(result, check, points, reason)
            elif told:
                notes.append(f"{path.name}: {label}, {check}: {told}")
    if taken:
        print(f"Took {taken} mark{'s' * (taken > 1)} from {path.name}.")
    for note in notes:
        print(f"Note: {clean(note)}")


def _of(result):
    return result.lab, result.student, result.identifier


def _labelled(results):
    return (((label, result.lab), result) for label, result in zip(labels(results), results))


def _meanwhile(book, now, before, check, points, reason):
    """None if a mark of the table counts. Else somebody gave one in the browser since the table was written, which
    stays: what is to be told of it, '' where the two agree; the table's is kept with those that do not count.
    """
    was, mark = (next((mark for mark in of.marks if mark.check == check), None) for of in (before, now))
    given = book.hands.all_of(now.lab, now.student, now.identifier, check)[-1:]
    if not (was and mark and given) or given[0].points is None or given[0].reader in ("", by_hand.TABLE):
        return None
    if (mark.points, mark.reason) == (was.points, was.reason):
        return None
    if abs(given[0].points - points) < hand_marks.SAME and reason in (was.reason, mark.reason):
        return ""
    book.hands.pass_by(now, check, points, reason)
    return (
        f"it says {plain(points)}, but {given[0].reader} gave {plain(given[0].points)} in the browser meanwhile, "
        f"which stays. To give {plain(points)} instead, write it into the table once more and run this again."
    )


def _hand_marks(path, snapshots):
    """(marks, notes, what was written) that differ least from what was written, or from what was written before."""
    readings, problems = [], []
    for written in snapshots:  # the newer one first; the file may still be the one before it
        notes = []
        try:
            found = hand_marks.read_hand_marks(path, written, notes)
            readings.append((found, notes, dict(_labelled(written))))
        except CommandError as error:
            problems.append(error)
    if not readings:
        raise problems[0]
    return min(readings, key=lambda reading: len(reading[0]))
