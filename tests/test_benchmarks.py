"""The benchmarks run; how fast is for a person on a quiet machine to see."""

import subprocess
import sys

import pytest

from helpers.reference import LABS, ROOT


@pytest.mark.slow
def test_the_kernel_benchmark_runs():
    command = [sys.executable, "tests/benchmarks/kernel.py", "--quick"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("target") == 4 + len(LABS)
