"""The command line where nobody reads: a sentence and status 2, nothing of Python's own."""

import os
import shlex
import subprocess
import sys

import pytest

from helpers.reference import ROOT


@pytest.mark.parametrize("how", ["| true; exit ${PIPESTATUS[0]}", ">/dev/full", ">&-", ">&- 2>&-", "<&- >&-"])
def test_nobody_reads_what_it_prints(tmp_path, how):
    code = "import time; time.sleep(1); from labkit.cli import main; exit(main(['data']))"
    line = f"{shlex.join([sys.executable, '-c', code])} {how}"
    env = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUTF8": "1"}
    done = subprocess.run(["bash", "-c", line], cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and done.stderr.count("\n") == ("2>&-" not in how), done.stderr
    assert done.stderr.startswith("labkit: ") or "2>&-" in how


def test_ctrl_c_ends_a_command_without_a_traceback_however_soon():
    stop = "c._data = lambda _: signal.raise_signal(signal.SIGINT)"
    code = f"import signal, labkit.cli as c; {stop}; exit(c.main(['data']))"
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "")
