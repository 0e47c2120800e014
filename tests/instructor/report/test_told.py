"""What `labkit grade` was told is known when marks are given later, and that something is to be written anew."""

from argparse import Namespace
from contextlib import closing
from datetime import datetime

from labkit.instructor.marking import command
from labkit.instructor.report import told
from labkit.instructor.report.gradebook import Gradebook

from helpers.marking import LAB, Q1, graded


def test_options_come_back_as_they_were_and_changed_marks_are_known(tmp_path, monkeypatch, capsys):
    out = graded(tmp_path / "out", {"Ada": "So.", "Bo": "Or so."})
    (tmp_path / "sheet.csv").write_text("")
    monkeypatch.chdir(tmp_path)
    due = datetime(2026, 11, 20, 23, 59)
    args = Namespace(submissions="class", moodle="sheet.csv", canvas=None, due=due, partial=True, call=10.0, run=print)
    with closing(Gradebook(out / "gradebook.db")) as book:
        assert told.outdated(book) == [LAB] and told.recall(book, LAB).moodle is None
        results = list(book.results(LAB))
        book.hand(results[0], Q1, 1, "")
        told.remember(book, LAB, args, results)
        assert told.outdated(book) == [LAB]  # what was given while all was written is not in it
        told.remember(book, LAB, args, book.results(LAB))
        assert told.outdated(book) == []
        book.hand(results[1], Q1, 2, "")
        assert told.outdated(book) == [LAB]
    written = []
    monkeypatch.setattr(command, "write_out", lambda book, paper, out, args: written.append((paper.lab, args)) or 1)
    assert command.finish(out) == 1
    ((lab, again),) = written
    assert (lab, again.due, again.partial, again.moodle) == (LAB, due, True, str(tmp_path / "sheet.csv"))
    assert again.submissions == str(tmp_path / "class") and again.column is None and not hasattr(again, "run")
    (tmp_path / "sheet.csv").unlink()
    command.finish(out)
    assert written[1][1].moodle is None and "sheet.csv is not there any more" in capsys.readouterr().out
