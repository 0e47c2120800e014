"""What stands for Jupyter where a notebook's code runs without it."""

import builtins
import os
import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ..checks.feedback import LabError
from .read import read
from .source import WRITE, python

ASKED = "`input()` waits for somebody to type, and nobody is there when a notebook is checked: write the value instead."

PYLAB = "from pylab import *\nimport numpy\nimport numpy as np\nfrom matplotlib import pyplot, pyplot as plt"


class Nothing:
    """Takes the place of what only Jupyter has: any use of it does nothing."""

    def __getattr__(self, name: str) -> "Nothing":
        return self

    def __call__(self, *args: Any, **options: Any) -> "Nothing":
        """Called as anything, it is nothing still."""
        return self

    def __iter__(self) -> Iterator[Any]:
        return iter(())


class Shell(Nothing):
    """Stands for IPython's shell; `%run` runs a file by `run_text`, other magics do nothing."""

    def __init__(self, run_text: Callable[[str, str], None]) -> None:
        self.run_text = run_text

    def run_line_magic(self, name: str, line: str) -> None:
        """`%name line`."""
        if name == "pylab":
            self.run_text(PYLAB, "%pylab")
        if name == "run" and (file := re.match(r"""(?:-\w+\s+)*(?:"([^"]+)"|'([^']+)'|(\S+))""", line.strip())):
            path = Path(next(filter(None, file.groups())))
            if path.suffix == ".ipynb":
                texts = [python(cell.source) for cell in read(path) if cell.code]
            else:
                path = path.with_suffix(".py")
                texts = [path.read_text(encoding="utf-8-sig")]
            for text in texts:
                self.run_text(text, str(path))

    def getoutput(self, command: str) -> list[str]:
        """What a `!command` printed."""
        return []


def stand_ins(run_text: Callable[[str, str], None]) -> dict[str, Any]:
    """{name: what stands for it} among a notebook's names."""
    shell = Shell(run_text)
    return {"input": asked, "display": Nothing(), "get_ipython": lambda: shell, WRITE: _write}


def asked(prompt: object = "") -> str:
    """Stands for `input`."""
    raise LabError(ASKED)


def _write(name, text, append):
    with open(name, "a" if append else "w", encoding="utf-8") as file:
        file.write(text)


def alone() -> None:
    """Make this process one in which nobody looks at pictures, answers questions or waits."""
    os.environ["MPLBACKEND"] = "template"  # draws nothing
    builtins.input = asked
    time.sleep = lambda seconds: None
