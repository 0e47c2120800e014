"""The cell before a lab's set-up that gets the kit where there is none, as in Colab, and says from where."""

import json
import tomllib
from pathlib import Path

from nbformat import NotebookNode
from nbformat.v4 import new_code_cell

from ..records import CommandError

PROJECT = Path(__file__).resolve().parents[3] / "pyproject.toml"
ID = "kit"

_SOURCE = """\
# This gets the course's kit where there is none, as in Colab. Elsewhere it does nothing.
import importlib.util, os, subprocess, sys

if not importlib.util.find_spec("labkit"):
    kit = os.environ.get("LABKIT_FROM") or ADDRESS
    if kit:
        print(f"labkit is not installed here: getting it from {kit}")
        pip = [sys.executable, "-m", "pip", "install", "-q", kit]
        print(subprocess.run(pip, capture_output=True, text=True).stderr or "Here it is.")
        importlib.invalidate_caches()
    else:
        print("labkit is not installed here, and this notebook does not know where it is.")
        print("Ask your course for the address, and run %pip install ADDRESS in a cell here.")
"""


def cell() -> NotebookNode:
    """The cell, folded in JupyterLab; students' own computers have the kit. Raises CommandError as `address` does."""
    metadata = {"labkit": "setup", "jupyter": {"source_hidden": True}}
    return new_code_cell(_SOURCE.replace("ADDRESS", json.dumps(address()), 1).rstrip(), id=ID, metadata=metadata)


def address() -> str:
    """What `pip install` takes to install the kit, as the project's pyproject.toml says; '' if it does not.

    Raises CommandError for a file that cannot be read so.
    """
    if not PROJECT.is_file():  # a package alone, with no lab to build
        return ""
    try:
        found = tomllib.loads(PROJECT.read_text(encoding="utf-8")).get("tool", {}).get("labkit", {}).get("address", "")
    except tomllib.TOMLDecodeError as error:
        raise CommandError(f"pyproject.toml is no TOML: {error}") from None
    if not isinstance(found, str) or "\n" in found:
        raise CommandError(f'pyproject.toml: `address = "..."` under [tool.labkit] is one text, not {found!r}')
    return found
