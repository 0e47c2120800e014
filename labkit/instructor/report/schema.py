"""The gradebook's file: its tables, made when it is new and checked when it is not."""

import os
import secrets
import sqlite3
from contextlib import closing
from itertools import count
from pathlib import Path

from ..records import CommandError

VERSION = 2
CURES = {  # what SQLite's words stand for
    "locked": "another program has it open: close it there",
    "readonly": "it cannot be written: choose another --out, or allow it",
    "full": "there is no room left: make room on that disk",
    "disk I/O": "its disk cannot be read or written, or is full: look at the disk",
    "unable to open": "a folder is where it should be, or its folder cannot be written: choose another --out",
    "malformed": "it is damaged: put back a copy that you have, or move it away and grade anew",
}
TABLES = """
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT);
CREATE TABLE paper (lab TEXT, digest TEXT, checks TEXT, PRIMARY KEY (lab, digest));
CREATE TABLE submission (
    id INTEGER PRIMARY KEY, lab TEXT, student TEXT, identifier TEXT, source TEXT, digest TEXT, paper TEXT,
    handed_in TEXT, late INTEGER, notes TEXT, answers TEXT, level INTEGER, problem TEXT, done INTEGER,
    current INTEGER, added TEXT);
CREATE INDEX by_student ON submission (lab, student, identifier);
CREATE TABLE mark (
    submission INTEGER REFERENCES submission, chk TEXT, points REAL, status TEXT, reason TEXT, lines TEXT,
    mistake TEXT, at TEXT, parts TEXT, PRIMARY KEY (submission, chk));
CREATE TABLE figure (submission INTEGER PRIMARY KEY, data BLOB);
"""
HAND = """
CREATE TABLE hand (
    id INTEGER PRIMARY KEY, lab TEXT, student TEXT, identifier TEXT, chk TEXT, points REAL, reason TEXT, ticks TEXT,
    reader TEXT, act TEXT, stands INTEGER, at TEXT, answer TEXT);
CREATE INDEX of_hand ON hand (lab, student, identifier, chk);
CREATE INDEX by_act ON hand (act);
CREATE TABLE held (submission INTEGER, chk TEXT, reader TEXT, until REAL, PRIMARY KEY (submission, chk));
"""
OLDER = f"""
ALTER TABLE hand RENAME TO hand_1;
{HAND}
INSERT INTO hand (lab, student, identifier, chk, points, reason, ticks, reader, act, at, answer)
    SELECT lab, student, identifier, chk, points, reason, '[]', '', '', at, answer FROM hand_1 ORDER BY at;
DROP TABLE hand_1;
UPDATE meta SET value = '2' WHERE key = 'version'
"""  # from version 1, which kept nothing but the last mark that a person gave


def trouble(error: sqlite3.Error) -> str:
    """What SQLite says of the gradebook's file, and what to do; without a full stop."""
    said = str(error)
    cure = next((cure for words, cure in CURES.items() if words in said), "move it away, or choose another --out")
    return f"{said}; {cure}"


def connect(path: Path, seed: int | None) -> tuple[sqlite3.Connection, int]:
    """(connection, seed of the random inputs) of the gradebook in `path`, which is made if it is not there.

    Raises CommandError if the file is no gradebook, is another version's, or was begun with another seed.
    """
    try:
        db = sqlite3.connect(path, timeout=5, isolation_level=None)
        db.execute("PRAGMA journal_mode=WAL")
        db.execute("PRAGMA synchronous=NORMAL")
        _make(db, seed)
        meta = dict(db.execute("SELECT key, value FROM meta").fetchall())
        if meta.get("version") == "1":
            _bring_up(db, path)
            meta = dict(db.execute("SELECT key, value FROM meta").fetchall())
    except sqlite3.Error as error:
        raise CommandError(f"{path} cannot be used as a gradebook: {trouble(error)}.") from None
    if meta.get("version") != str(VERSION):
        raise CommandError(
            f"{path} was made by another version of this kit: finish with that one, or choose another --out."
        )
    if seed is not None and seed != int(meta["seed"]):
        raise CommandError(
            f"{path} was begun with --seed {meta['seed']}: leave the option out, or choose another --out."
        )
    return db, int(meta["seed"])


def _make(db: sqlite3.Connection, seed: int | None) -> None:
    """The tables of a new file, all of them or none; those of an old one stay."""
    db.execute("BEGIN IMMEDIATE")
    with db:
        if not db.execute("SELECT name FROM sqlite_master WHERE name = 'meta'").fetchall():
            for statement in (TABLES + HAND).split(";"):
                db.execute(statement)
            first = {"version": VERSION, "seed": secrets.randbits(62) if seed is None else seed}
            db.executemany("INSERT INTO meta VALUES (?, ?)", [(key, str(value)) for key, value in first.items()])


def _bring_up(db: sqlite3.Connection, path: Path) -> None:
    """Make this version's gradebook of one of version 1, all of it or nothing, and keep a copy beside it."""
    db.execute("BEGIN IMMEDIATE")  # nobody else writes between the copy and the change
    with db:
        if db.execute("SELECT value FROM meta WHERE key = 'version'").fetchall() != [("1",)]:
            return  # somebody else has done it just now
        names = (path.with_name(f"{path.stem}-of-version-1{f'-{n}' if n > 1 else ''}{path.suffix}") for n in count(1))
        kept = next(name for name in names if not name.exists())
        part = kept.with_name(f"{kept.name}.part")
        part.unlink(missing_ok=True)
        with closing(sqlite3.connect(path)) as reader, closing(sqlite3.connect(part)) as copy:
            reader.backup(copy)
        os.replace(part, kept)
        if "parts" not in [column for _, column, *_ in db.execute("PRAGMA table_info(mark)")]:
            db.execute("ALTER TABLE mark ADD COLUMN parts TEXT DEFAULT '[]'")
        for statement in OLDER.split(";"):
            db.execute(statement)
    print(f"Note: {path} was an older version's; it is this one's now, and {kept.name} beside it is the old one.")
