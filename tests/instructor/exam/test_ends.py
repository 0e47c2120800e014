"""However a grading ends, nothing of it is left: no process, and no folder once the next one begins."""

import ctypes
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from labkit.instructor import folders

from helpers.classroom import LAB, as_file, filled
from helpers.reference import ROOT

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux has subreapers")
PR_SET_CHILD_SUBREAPER = 36


@pytest.fixture
def adopts():
    """This process takes in orphans, as systemd, a container's first process or a terminal does."""
    libc = ctypes.CDLL(None)
    libc.prctl(PR_SET_CHILD_SUBREAPER, 1)
    yield
    libc.prctl(PR_SET_CHILD_SUBREAPER, 0)


def started(tmp_path, temporary):
    for number in range(16):  # more than it can grade before it is stopped, on a machine on which signals come late
        as_file(tmp_path / "class" / f"student {number}" / f"{LAB}.ipynb", filled())
    command = [sys.executable, "-m", "labkit", "grade", tmp_path / "class", "--lab", LAB, "--out", tmp_path / "out"]
    env = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(temporary)}
    return subprocess.Popen(
        list(map(str, command)), env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def of(temporary):
    """Command lines of the processes that work in a folder for temporary files, as these and their environment tell."""
    found = []
    for process in psutil.process_iter():
        try:
            words = process.cmdline()
            if str(temporary) in " ".join([*words, process.environ().get("TMPDIR", "")]):
                found.append(words)
        except psutil.Error:  # it has ended
            continue
    return found


def wait_for(what, seconds=30):
    stop = time.monotonic() + seconds
    while not what() and time.monotonic() < stop:
        time.sleep(0.02)
    return what()


def kernel(temporary):
    return any("ipykernel_launcher" in words for words in of(temporary))


def swept(temporary):
    done = subprocess.run(
        [sys.executable, "-c", "from labkit.instructor import folders; folders.sweep()"],
        env={**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(temporary)},
    )
    return done.returncode == 0 and list(temporary.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "how, later",
    [(signal.SIGKILL, 0), (signal.SIGKILL, 0.3), (signal.SIGKILL, 2), (signal.SIGTERM, 0.3)],
    ids=["killed as a kernel starts", "killed while it starts", "killed as it grades", "ended while it starts"],
)
def test_all_of_it_ends(adopts, tmp_path, how, later):
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    for path in (temporary, *temporary.parents):
        if path.stat().st_uid == os.geteuid():
            path.chmod(path.stat().st_mode | 0o011)  # root's workers are other users
    grader = started(tmp_path, temporary)
    assert wait_for(lambda: kernel(temporary)), (grader.kill(), grader.communicate())
    time.sleep(later)
    grader.send_signal(how)
    said, _ = grader.communicate(timeout=30)
    assert wait_for(lambda: not of(temporary), 10), of(temporary)
    if how == signal.SIGTERM:
        assert "The marks so far are kept" in said
        assert wait_for(lambda: not list(temporary.iterdir()), 10), list(temporary.iterdir())
    else:
        assert all(path.name.startswith("labkit-") for path in temporary.iterdir())
        assert wait_for(lambda: swept(temporary), 10)  # a process that has ended may hold its lock for a moment


def test_the_folder_of_one_that_lives_or_of_nobody_is_left(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / "labkit-mine").mkdir()
    (tmp_path / "labkit-link").symlink_to(tmp_path / "labkit-mine")
    (tmp_path / "labkit-file").touch()
    with folders.temporary("grade") as lives, folders.temporary("grade") as other:
        assert Path(lives).is_dir() and Path(other).is_dir()
    assert {path.name for path in tmp_path.iterdir()} == {"labkit-mine", "labkit-link", "labkit-file"}


def test_what_a_killed_process_left_goes_when_the_next_begins(tmp_path, monkeypatch):
    code = (
        "import os; from labkit.instructor import folders; f = folders.temporary('grade'); f.__enter__(); os._exit(9)"
    )
    env = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", code], env=env)
    (left,) = tmp_path.iterdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with folders.temporary("grade") as folder:
        assert [path.name for path in tmp_path.iterdir()] == [Path(folder).name] != [left.name]


def test_a_folder_is_removed_however_deep_it_is_and_to_whomever_it_is_closed(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept" / "file").touch()
    with folders.temporary("grade") as folder:
        monkeypatch.chdir(folder)
        os.symlink(tmp_path / "kept", "link")
        for number in range(1500):
            os.mkdir("deep" * 9)
            Path("file").touch()
            os.chdir("deep" * 9)
            os.mkdir(f"closed{number}", 0)
        os.chdir(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["kept"] and (tmp_path / "kept" / "file").is_file()
