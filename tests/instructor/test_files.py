"""A file is written whole or not at all, whatever happens on the way."""

import os
import zipfile

import pytest

from labkit.instructor import files
from labkit.instructor.records import CommandError


def pack(file):
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("a", "b")


def test_text_bytes_and_what_a_function_writes(tmp_path):
    path = tmp_path / "grades.csv"
    files.write(path, "Zoë \ud83d\n")
    assert path.read_bytes() == "Zoë ?\n".encode()
    files.write(path, b"\xff")
    assert path.read_bytes() == b"\xff"
    files.write(path, pack)
    assert zipfile.ZipFile(path).read("a") == b"b" and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("stop", [KeyboardInterrupt, ValueError])
def test_what_interrupts_it_leaves_the_old_file_and_nothing_else(tmp_path, stop):
    path = tmp_path / "grades.csv"
    files.write(path, "old")
    (tmp_path / "grades.csv.part").write_text("left by a grader that was killed")

    def half(file):
        file.write(b"half of")
        raise stop

    with pytest.raises(stop):
        files.write(path, half)
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_a_file_that_cannot_be_written_is_told_with_the_reason(tmp_path, monkeypatch):
    with pytest.raises(CommandError, match=r"no.s\.csv cannot be written: No such file"):
        files.write(tmp_path / "no" / "s.csv", "")

    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(CommandError, match=r"g\.csv cannot be written: .*is it open in a spreadsheet"):
        files.write(tmp_path / "g.csv", "")
    assert list(tmp_path.iterdir()) == []
