"""The sandbox: what it claims is tried, what is too weak is refused, and a worker leaves nothing behind."""

import argparse
import contextlib
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil
import pytest

from labkit.instructor.records import CommandError
from labkit.instructor.sandbox import cgroup, choose, levels, probe
from labkit.instructor.sandbox.channel import Channel, NotGradedError, StudentCodeError, WorkerLostError
from labkit.instructor.sandbox.forms import fields
from labkit.instructor.sandbox.launch import INSIDE, Sandbox, make_runtime, readable
from labkit.instructor.sandbox.process import Process

pytestmark = pytest.mark.skipif(os.name == "nt", reason="grading needs a Unix")


@pytest.fixture(scope="module")
def found():
    return list(choose.look())


def options(**more):
    given = {"level": None, "trust_students": False, "weak_sandbox": False, "total": 60.0}
    return argparse.Namespace(**{**given, **more})


@pytest.mark.parametrize(
    "broken, level",
    [
        (set(), 3),
        ({"alone"}, 2),
        ({"tcp"}, 1),
        ({"unix", "fork", "alone"}, 1),
        ({"files"}, 0),
        ({"write", "alone"}, 0),
        ({"user"}, 0),
        ({"imports"}, None),
        ({"scratch"}, None),
    ],
)
def test_a_level_is_what_held(broken, level):
    assert probe.level(set(probe.PROMISES) - broken) == level
    if level == 3:
        assert probe.level(set(probe.PROMISES), group=True) == 4


def test_each_way_is_tried_and_has_a_level_or_a_reason(found):
    assert {one.way for one in found} >= {"bubblewrap", "landlock", "limits only"}
    for one in found:
        assert one.why if one.sandbox is None else one.sandbox.level == probe.level(one.held, one.sandbox.group)


def test_nothing_weaker_than_level_2_is_used_unasked(found, monkeypatch):
    for level, option in ((0, "trust_students"), (1, "weak_sandbox")):
        weak = levels.Found("limits only", Sandbox("limits", "", level=level))
        monkeypatch.setattr(choose, "look", lambda weak=weak: (one for one in [weak]))
        with pytest.raises(CommandError, match=f"--{option.replace('_', '-')}"):
            choose.choose(options())
        assert choose.choose(options(**{option: True})).level == level
    monkeypatch.setattr(
        choose, "look", lambda: (levels.Found(way, None, why="not installed") for way in ["bubblewrap"])
    )
    with pytest.raises(CommandError, match="labkit sandbox"):
        choose.choose(options())


def test_the_best_is_used_unless_less_is_asked_for(found, monkeypatch, capsys):
    ways = [levels.Found(str(n), Sandbox("bubblewrap", "", level=n)) for n in (2, 4, 3)]
    monkeypatch.setattr(choose, "look", lambda: (one for one in ways))
    assert choose.choose(options()).level == 4
    assert choose.choose(options(level=2)).level == 2
    said = capsys.readouterr().out
    assert "level 4" in said and "level 2" in said and "Warning" in said


def test_a_ctrl_c_while_the_folder_of_the_trial_is_removed_is_not_lost(monkeypatch):
    def ways():
        try:
            yield levels.Found("bubblewrap", Sandbox("bubblewrap", "", level=4))
        finally:
            raise KeyboardInterrupt

    monkeypatch.setattr(choose, "look", ways)
    with pytest.raises(KeyboardInterrupt):
        choose.choose(options())


def test_the_table_is_printed():
    done = subprocess.run([sys.executable, "-m", "labkit", "sandbox"], capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stderr
    assert all(words in done.stdout for words in ("bubblewrap", "landlock", "labkit grade uses level"))
    lines = [line for line in done.stdout.splitlines() if line.startswith("A worker ")]
    assert not lines or len(lines) == len(probe.PROMISES)
    assert all(line.endswith(tried) for line, (_, tried) in zip(lines, probe.PROMISES.values()))
    assert max(map(len, done.stdout.splitlines())) <= 160


def test_folders_are_bound_once():
    paths = readable("/some/where")
    assert len(paths) == len(set(paths))
    assert not any(a != b and a.startswith(f"{b}/") for a in paths for b in paths)


def test_a_worker_has_the_kit_without_its_numbers_and_the_grader(tmp_path):
    make_runtime(tmp_path)
    kit = tmp_path / "labkit"
    assert (kit / "log.py").is_file() and {path.suffix for path in kit.rglob("*") if path.is_file()} == {
        ".py",
        ".pyc",
        ".toml",
    }
    wing = {str(path.relative_to(kit / "instructor")) for path in (kit / "instructor").rglob("*.py")}
    assert wing == {f"{name}.py" for name in INSIDE} and {str(Path(name).parent) for name in wing} == {".", "sandbox"}
    text = "".join(path.read_text(encoding="utf-8") for path in (kit / "instructor").rglob("*.py"))
    assert not re.search(r"^(from|import) .*\b(authoring|exam|report|intake|command|records)\b", text, re.MULTILINE)


def test_a_worker_starts_with_what_it_has(tmp_path):
    """No module that it imports is one of those that it lacks."""
    make_runtime(tmp_path)
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from labkit.instructor.sandbox import worker as w; "
    code += "print(w.__file__)"
    done = subprocess.run([sys.executable, "-I", "-B", "-c", code], capture_output=True, text=True)
    assert done.stdout.strip().startswith(str(tmp_path)), done.stderr


def ask_to_the_end(channel):
    for _ in range(100):  # its last breath may be an answer
        with contextlib.suppress(StudentCodeError):
            channel.ask({"do": "probe"}, 5, fields())
        time.sleep(0.05)


def ask_on(channel):
    while True:
        with contextlib.suppress(StudentCodeError):  # its last breath may be an answer
            channel.ask({"do": "probe"}, 600, fields())


def test_a_worker_that_is_gone_is_told_of_and_leaves_nothing(found):
    box = next((one.sandbox for one in found if one.sandbox), None)
    if box is None:
        pytest.skip("no sandbox here")
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        channel = Channel(Sandbox(box.way, make_runtime(f"{folder}/runtime"), level=box.level), 30)
        channel.settle()
        channel.worker.process.kill()
        channel.worker.process.wait()
        # Nothing inside bubblewrap could have killed it; elsewhere nobody knows.
        outside = box.way == "bubblewrap"
        with pytest.raises(NotGradedError if outside else WorkerLostError, match="SIGKILL") as lost:
            ask_to_the_end(channel)
        assert outside or lost.value.killed
        channel.end()
        assert os.listdir(folder) == ["runtime"]
    assert channel.worker.process.poll() is not None


class Halved:
    """A sandbox whose outer process is killed before the inner one, which holds its pipes open, is shut in."""

    def __init__(self, told):
        self.told = told

    def start(self, seconds):
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "bufsize": 0}
        code = 'sleep 600 <&0 & echo $! > "$0"; kill -9 $$'
        process = subprocess.Popen(["sh", "-c", code, self.told], start_new_session=True, **pipes)
        return Process(process, "", {}, way="bubblewrap")


@pytest.mark.skipif(sys.platform == "win32", reason="it has no such processes")
def test_a_worker_whose_other_half_goes_on_is_not_waited_for(tmp_path):
    channel, start = Channel(Halved(tmp_path / "inner"), 60), time.monotonic()
    with pytest.raises(NotGradedError, match=r"the system ended a worker \(signal SIGKILL"):
        channel.settle()
    assert time.monotonic() - start < 5
    channel.end()
    with contextlib.suppress(psutil.NoSuchProcess):
        inner = psutil.Process(int((tmp_path / "inner").read_text()))
        while inner.status() != psutil.STATUS_ZOMBIE:  # until whoever has it now buries it
            assert time.monotonic() - start < 10
            time.sleep(0.02)


def test_a_process_is_put_into_its_control_group_first(tmp_path):
    (tmp_path / "cgroup.procs").touch()
    done = subprocess.run([*cgroup.within(str(tmp_path)), "echo", "a b"], capture_output=True, text=True)
    assert done.stdout == "a b\n"
    assert (tmp_path / "cgroup.procs").read_text() == "0\n"
