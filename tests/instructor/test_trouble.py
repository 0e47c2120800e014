"""A disk that is full or read-only, a folder in the way, nobody who reads: a sentence, status 2, and no mark lost."""

import os
import shlex
import shutil
import sqlite3
import subprocess
import sys

import pytest

from helpers.classroom import LAB, as_file, filled
from helpers.reference import ROOT

pytest.importorskip("nbval")
pytestmark = pytest.mark.slow
ENV = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUTF8": "1"}


def shell(line, folder, **env):
    """(status, what it printed, errors) of a line for the shell, with `labkit` for the command."""
    line = line.replace("labkit", f"{shlex.quote(sys.executable)} -m labkit", 1).replace(
        "GRADE", f"grade class --lab {LAB} --out out"
    )
    done = subprocess.run(
        ["bash", "-c", line], cwd=folder, env={**ENV, **env}, capture_output=True, text=True, check=False, timeout=500
    )
    assert "Traceback" not in done.stderr and "Exception ignored" not in done.stderr, done.stderr
    return done.returncode, done.stdout, done.stderr


@pytest.fixture(scope="module")
def graded(tmp_path_factory):
    """A class of one that was graded, with what came of it."""
    folder = tmp_path_factory.mktemp("trouble")
    as_file(folder / "class" / "Ada" / f"{LAB}.ipynb", filled(answer_q1="So."))
    assert shell("labkit GRADE --jobs 1", folder)[0] == 0
    return folder


@pytest.fixture
def small(graded, tmp_path):
    return shutil.copytree(graded, tmp_path / "small")


def marks(folder):
    with sqlite3.connect(folder / "out" / "gradebook.db") as book:
        return book.execute("SELECT chk, points, status FROM mark ORDER BY chk").fetchall()


def goes_on(folder):
    """The same command works again, and grades nobody."""
    before = marks(folder)
    status, said, errors = shell("labkit GRADE --jobs 1", folder)
    assert (status, marks(folder)) == (0, before), errors
    assert "Ada: " not in said and (folder / "out" / "grades.csv").read_text(encoding="utf-8-sig").count("passed") == 11


WRITTEN = ["grades.csv", "grades.csv.part", f"class-{LAB}.html", ".lock", f"feedback/{LAB}/Ada.html"]


@pytest.mark.parametrize("name", WRITTEN)
def test_a_folder_where_a_file_should_be(small, name):
    place = small / "out" / name
    if place.exists():
        place.rename(small / "aside")
    place.mkdir()
    (place / "x").touch()
    status, _, errors = shell("labkit GRADE --jobs 1", small)
    assert status == 2 and "a folder is where a file should be; move it away" in errors and name in errors
    shutil.rmtree(place)
    goes_on(small)


@pytest.mark.parametrize("name", ["feedback", f"feedback/{LAB}"])
def test_a_file_where_a_folder_should_be(small, name):
    shutil.rmtree(small / "out" / name)
    (small / "out" / name).touch()
    status, _, errors = shell("labkit GRADE --jobs 1", small)
    assert status == 2 and "move it away" in errors and name in errors
    (small / "out" / name).unlink()
    goes_on(small)


@pytest.mark.parametrize("how", ["| true; exit ${PIPESTATUS[0]}", ">&-", ">/dev/full", ">&- 2>&-"])
def test_nobody_reads_what_it_prints(small, how):
    status, _, errors = shell(f"labkit GRADE --jobs 1 --regrade all {how}", small)
    assert status == 2 and (errors.count("\n") == 1 or "2>&-" in how)
    status, _, errors = shell("labkit GRADE --jobs 1", small)
    assert status == 0, errors
    goes_on(small)


def test_a_gradebook_that_another_program_has_open(small):
    with sqlite3.connect(small / "out" / "gradebook.db") as book:
        book.execute("BEGIN EXCLUSIVE")
        status, _, errors = shell("labkit GRADE --jobs 1", small)
        book.execute("ROLLBACK")
    assert status == 2 and "another program has it open: close it there" in errors
    goes_on(small)


def test_a_damaged_gradebook(small):
    book = small / "out" / "gradebook.db"
    with sqlite3.connect(book) as db:
        db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    whole = book.read_bytes()
    for at in range(2, 12):
        book.write_bytes(whole[: at * 4096] + b"\xaa" * 8192 + whole[at * 4096 + 8192 :])
        for log in (small / "out").glob("gradebook.db-*"):
            log.unlink()
        status, _, errors = shell("labkit GRADE --jobs 1", small)
        assert status in (0, 2) and (not status or "gradebook" in errors)
        if status:
            break
    assert status == 2
    book.write_bytes(whole)
    for log in (small / "out").glob("gradebook.db-*"):
        log.unlink()
    goes_on(small)


@pytest.fixture
def full(tmp_path):
    """A disk of 3 MB."""
    place = tmp_path / "disk"
    place.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=3m", "none", place], capture_output=True).returncode:
        pytest.skip("nothing can be mounted here")
    yield place
    subprocess.run(["umount", "-l", place], check=True)


@pytest.mark.parametrize("left", [0, 30, 100])
def test_a_full_disk(small, full, left):
    shutil.copytree(small / "out", full / "out")
    shutil.rmtree(small / "out")
    (small / "out").symlink_to(full / "out")
    before = marks(small)
    filler = full / "filler"
    with open(filler, "wb") as file:
        free = os.statvfs(full).f_bavail * os.statvfs(full).f_frsize
        file.write(b"x" * max(0, free - left * 1024))
    status, _, errors = shell("labkit GRADE --jobs 1 --regrade all", small)
    assert status == 2 and ("make room on that disk" in errors or "look at the disk" in errors), errors
    filler.unlink()
    assert [mark for mark in before if mark not in marks(small)] == []
    assert shell("labkit GRADE --jobs 1", small)[0] == 0
    goes_on(small)


def test_a_read_only_disk(small, full):
    shutil.copytree(small / "out", full / "out")
    shutil.rmtree(small / "out")
    (small / "out").symlink_to(full / "out")
    subprocess.run(["mount", "-o", "remount,ro", full], check=True)
    status, _, errors = shell("labkit GRADE --jobs 1", small)
    assert status == 2 and "Read-only file system: nothing can be written on that disk" in errors
    subprocess.run(["mount", "-o", "remount,rw", full], check=True)
    goes_on(small)


@pytest.mark.parametrize("kind", ["missing", "full"])
def test_no_place_for_temporary_files(small, full, kind):
    if kind == "full":
        with open(full / "filler", "wb") as file:
            file.write(b"x" * os.statvfs(full).f_bavail * os.statvfs(full).f_frsize)
    place = full if kind == "full" else full / "nowhere"
    before = marks(small)
    status, _, errors = shell("labkit GRADE --jobs 1 --regrade all", small, TMPDIR=str(place))
    assert status == 0, errors  # another place is looked for
    assert shell("labkit GRADE --jobs 1", small)[0] == 0 and set(marks(small)) == set(before)
