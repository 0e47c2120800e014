"""Marks that several people give at once: all are kept, none twice, and none replaces one that was not seen."""

import sqlite3
from contextlib import closing

import pytest

from labkit.instructor.records import BY_HAND, OPEN, Check
from labkit.instructor.report import by_hand, schema
from labkit.instructor.report.by_hand import Slot
from labkit.instructor.report.gradebook import Gradebook
from labkit.instructor.report.tables import write_grades
from labkit.instructor.report.taken import take_hand_marks

CHECKS = [Check("q1", "Why?", 3, hand=True)]


@pytest.fixture
def book(tmp_path):
    with closing(Gradebook(tmp_path / "gradebook.db", seed=7)) as book:
        book.set_paper("lab", "paper", CHECKS)
        for name in ("Ada", "Bela"):
            hand_in(book, name)
        yield book


@pytest.fixture
def other(book):
    with closing(Gradebook(book.path)) as other:
        yield other


def hand_in(book, name, answer="so"):
    id = book.add("lab", name, "", "a.ipynb", answer, "paper", None, False, [], {"q1": answer})
    book.choose(id, [], False)
    book.finish(id)


def slots(book, *names):
    """The slots as somebody sees them who looks now."""
    seen = {name: given.number for (name, _, _), given in book.hands.newest("lab").items()}
    return [Slot(r, "q1", seen.get(r.student, 0)) for r in book.results("lab") if not names or r.student in names]


def points(book):
    return {result.student: result.marks[0].points for result in book.results("lab")}


def test_a_mark_for_all_of_a_group_is_given_once_however_often_it_is_told(book, other):
    seen = slots(book)
    for one in (book, other):
        assert one.hands.give("act", "Emmy", seen, 2, "Good.", [0, 2]) == []
    assert points(book) == {"Ada": 2, "Bela": 2}
    (given,) = book.hands.all_of("lab", "Ada", "", "q1")
    assert (given.reader, given.points, given.reason, given.ticks, given.answer) == ("Emmy", 2, "Good.", (0, 2), "so")


def test_nobody_overwrites_what_they_have_not_seen(book, other):
    seen = slots(book)
    assert other.hands.give("1", "Noor", slots(other, "Bela"), 1, "") == []
    assert [slot.result.student for slot in book.hands.give("2", "Emmy", seen, 2, "")] == ["Bela"]
    assert points(book) == {"Ada": None, "Bela": 1}
    assert book.hands.give("3", "Emmy", slots(book), 2, "") == []
    assert points(other) == {"Ada": 2, "Bela": 2} and len(book.hands.all_of("lab", "Bela", "", "q1")) == 2


def test_an_answer_that_was_handed_in_anew_meanwhile_is_not_marked_unread(book, other):
    seen = slots(book, "Ada")
    hand_in(other, "Ada", "something else")
    assert book.hands.give("1", "Emmy", seen, 2, "") == seen and points(book)["Ada"] is None


def test_undo_goes_back_act_by_act_and_never_over_anothers_mark(book, other):
    book.hands.give("1", "Emmy", slots(book), 1, "first")
    book.hands.give("2", "Emmy", slots(book, "Ada"), 2, "second")
    other.hands.give("3", "Noor", slots(other, "Bela"), 3, "")
    for _ in range(2):
        assert book.hands.undo("4", "Emmy") == [("lab", "Ada", "", "q1", True)]  # told twice, it counts once
        assert points(book) == {"Ada": 1, "Bela": 3}
    (now,) = [given for of, given in book.hands.newest("lab").items() if of[0] == "Ada"]
    assert (now.reader, now.reason) == ("Emmy", "first")
    assert book.hands.undo("5", "Emmy") == [("lab", "Ada", "", "q1", True), ("lab", "Bela", "", "q1", False)]
    assert points(book) == {"Ada": None, "Bela": 3} and book.hands.undo("6", "Emmy") == []
    assert other.hands.undo("7", "Noor") == [("lab", "Bela", "", "q1", True)]
    assert points(book) == {"Ada": None, "Bela": 1}  # Emmy's, which counts again, and which she may take back now
    assert book.hands.undo("8", "Emmy") == [("lab", "Ada", "", "q1", False), ("lab", "Bela", "", "q1", True)]
    assert points(book) == {"Ada": None, "Bela": None}


def test_comments_are_kept_line_by_line_and_those_in_use_come_first(book):
    for n, reason in enumerate(["Typo", "Say why.\nA number?", "Say why."]):
        book.hands.give(str(n), "Emmy", slots(book, "Bela" if n > 1 else "Ada"), 1, reason)
    assert book.hands.comments("lab", "q1") == ["Say why.", "A number?", "Typo"]


def test_each_answer_is_dealt_to_one_reader_until_it_is_given_back_or_forgotten(book, other, monkeypatch):
    groups = [[1], [2]]
    assert book.hands.deal("Emmy", "q1", groups) == 0 and other.hands.deal("Noor", "q1", groups) == 1
    assert book.hands.deal("Lise", "q1", groups) is None and book.hands.held("q1") == {1: "Emmy", 2: "Noor"}
    assert book.hands.deal("Emmy", "q1", [[2], [1]]) == 1
    monkeypatch.setattr(by_hand, "PATIENCE", -1)
    other.hands.hold("Noor", "q1", [2])
    assert book.hands.deal("Lise", "q1", [[2]]) == 0


def test_the_table_and_the_browser_go_together_and_neither_loses_a_mark(book, tmp_path, capsys):
    path = tmp_path / "grades.csv"
    for name in ("Cem", "Dee"):
        hand_in(book, name)
    book.wrote(book.results("lab"))
    write_grades(path, list(book.results("lab")))
    for n, (name, given) in enumerate([("Bela", 2), ("Cem", 1), ("Dee", 3)]):
        book.hands.give(str(n), "Emmy", slots(book, name), given, "Hm.")
    filled = {"Ada": "1.5", "Cem": "3", "Dee": "3"}
    lines = [line.split(",") for line in path.read_text(encoding="utf-8-sig").splitlines()]
    path.write_text("\n".join(",".join([*c[:3], filled.get(c[0], c[3]), *c[4:]]) for c in lines), encoding="utf-8")
    take_hand_marks(book, path)
    assert points(book) == {"Ada": 1.5, "Bela": 2, "Cem": 1, "Dee": 3}
    said = capsys.readouterr().out
    assert "Took 1 mark from" in said and said.count("Note") == 1
    assert "Cem, q1: it says 3, but Emmy gave 1 in the browser meanwhile, which stays." in said
    assert [given.points for given in book.hands.all_of("lab", "Cem", "", "q1")] == [1, 3, 1]
    path.write_text(path.read_text(encoding="utf-8").replace("1.5", "2.5"), encoding="utf-8")
    take_hand_marks(book, path)  # what the table gave itself, it may change
    assert points(book)["Ada"] == 2.5


VERSION_1 = """
CREATE TABLE hand (
    lab TEXT, student TEXT, identifier TEXT, chk TEXT, points REAL, reason TEXT, answer TEXT, at TEXT,
    PRIMARY KEY (lab, student, identifier, chk));
INSERT INTO hand VALUES ('lab', 'Ada', '', 'q1', 1.5, 'Good.', 'so', '2026-01-01T10:00:00');
UPDATE meta SET value = '1' WHERE key = 'version'
"""


def as_version_1(path):
    with closing(sqlite3.connect(path, isolation_level=None)) as db:
        for statement in (
            "DROP TABLE hand",
            "DROP TABLE held",
            "ALTER TABLE mark DROP COLUMN parts",
            *VERSION_1.split(";"),
        ):
            db.execute(statement)


def test_a_gradebook_of_an_older_version_is_brought_up_and_a_copy_is_kept(book, tmp_path, capsys):
    path = book.path
    book.close()
    for copies in (1, 2):  # the older one may be put back
        as_version_1(path)
        with closing(Gradebook(path)) as now:
            (ada, bela) = now.results("lab")
            assert (ada.marks[0].status, ada.marks[0].points, ada.marks[0].reason) == (BY_HAND, 1.5, "Good.")
            assert bela.marks[0].status == OPEN
            assert now.hands.give("1", "Emmy", slots(now), 2, "") == [] and points(now)["Ada"] == 2
        kept = sorted(tmp_path.glob("gradebook-of-version-1*.db"))
        assert len(kept) == copies and kept[0].name in capsys.readouterr().out
        with closing(sqlite3.connect(kept[-1])) as old:
            assert old.execute("SELECT student, points FROM hand").fetchall() == [("Ada", 1.5)]
    Gradebook(path).close()
    assert len(list(tmp_path.glob("*.db*"))) == 3 and capsys.readouterr().out.count("older") == 0


def test_an_upgrade_that_fails_leaves_the_older_gradebook(book, monkeypatch):
    path = book.path
    book.close()
    as_version_1(path)
    monkeypatch.setattr(schema, "OLDER", schema.OLDER + "; no SQL")
    with pytest.raises(Exception, match="cannot be used as a gradebook"):
        Gradebook(path)
    with closing(sqlite3.connect(path)) as old:
        assert old.execute("SELECT points FROM hand").fetchall() == [(1.5,)]
