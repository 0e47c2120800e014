"""A solution's notebook run in a kernel, and where it stops if it does."""

import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from subprocess import DEVNULL
from typing import Any

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from nbformat import NotebookNode

from ..records import CommandError

WIDGET = "application/vnd.jupyter.widget-view+json"
COLOUR = re.compile(r"\x1b\[[\d;]*m")


class StoppedError(CommandError):
    """A solution stops: number of the cell from 0 on, line in it, what was raised."""


def execute(notebook: NotebookNode, folder: Path) -> NotebookNode:
    """A copy of the notebook, run in `folder`, with its outputs. Raises StoppedError if a cell stops."""
    copy = nbformat.from_dict(notebook)
    # Where no window can open, figures go into the notebook all the same.
    os.environ.setdefault("PYTHONUTF8", "1")
    try:
        NotebookClient(copy, timeout=300, startup_timeout=600, resources={"metadata": {"path": str(folder)}}).execute(
            stderr=DEVNULL
        )
    except CellExecutionError as error:
        raise StoppedError(*_stop(copy), f"{error.ename}: {error.evalue}") from error
    copy.metadata.pop("widgets", None)
    for cell in copy.cells:
        cell.metadata.pop("execution", None)
        if "outputs" in cell:
            cell.outputs = joined(cell.outputs)
        for output in cell.get("outputs", []):
            # A stored widget is dead without its kernel and would hide the picture stored beside it.
            output.get("data", {}).pop(WIDGET, None)
    return copy


def _stop(copy):
    """(number of the cell that stopped, line in it) of a notebook that was run."""
    for number, cell in enumerate(copy.cells):
        for output in cell.get("outputs", []):
            if output.output_type == "error":
                lines = re.findall(
                    r"Cell In\[\d+\], line (\d+)", re.sub(r"\x1b\[[\d;]*m", "", "\n".join(output.traceback))
                )
                return number, int(lines[0]) if lines else 1
    return 0, 0


def joined(outputs: Iterable[Mapping[str, Any]]) -> list[NotebookNode]:
    """Outputs with what was printed in one go in one piece: how many messages it came in is chance."""
    pieces: list[Any] = []
    output: Any
    for output in map(nbformat.from_dict, outputs):
        last: Any = pieces[-1] if pieces else {}
        if output.output_type == "stream" == last.get("output_type") and output.name == last.name:
            last.text += "".join(output.text)
        else:
            pieces.append(output)
            if output.output_type == "stream":
                output.text = "".join(output.text)  # a file may hold it as a list of lines
    return pieces
