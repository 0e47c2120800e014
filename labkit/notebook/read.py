"""Read a notebook file as data."""

import codecs
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..checks.feedback import LabError

MAX_BYTES = 50_000_000
ROLES = ("setup", "answer", "check", "guess", "show", "text")


class NotebookError(LabError):
    """A file that is no notebook; the text says why, in one line."""


@dataclass(frozen=True)
class Cell:
    """One cell: its place counted from 1, its id, its role, its source, and all that the file has of it.

    role: one of ROLES for a cell of the released notebook, 'own' for one that the student added.
    """

    number: int
    id: str
    role: str
    code: bool
    source: str
    stored: dict = field(default_factory=dict, compare=False, repr=False)

    @property
    def label(self) -> str:
        """What the cell is called when something in it is told."""
        return f"cell '{self.id}'" if self.id.startswith(ROLES) else f"cell {self.number}"

    @property
    def metadata(self) -> dict:
        """Its metadata, {} if there is none."""
        metadata = self.stored.get("metadata")
        return metadata if isinstance(metadata, dict) else {}

    @property
    def tags(self) -> list:
        """The tags in its metadata, [] if there are none."""
        tags = self.metadata.get("tags")
        return tags if isinstance(tags, list) else []

    @property
    def printed(self) -> str:
        """What the cell of a valid notebook printed when it was run."""
        streams = [out for out in self.stored.get("outputs", []) if out.get("name") == "stdout"]
        return "".join("".join(out["text"]) for out in streams)


def read(path: Path | str) -> list[Cell]:
    """The cells of the notebook at `path`; raises NotebookError."""
    path = Path(path)
    try:
        if path.is_dir():
            raise NotebookError(f"{path} is a folder without notebooks in it.")
        if path.stat().st_size > MAX_BYTES:
            raise NotebookError(f"{path} has more than {MAX_BYTES // 10**6} MB: clear its outputs and save it again.")
        raw = path.read_bytes()
    except FileNotFoundError:
        what = "fits no file" if re.search(r"[*?\[]", path.name) else "does not exist"
        raise NotebookError(f"{path} {what}.") from None
    except OSError as error:
        raise NotebookError(f"{path} cannot be opened: {error.strerror or error}.") from None
    return cells_of(parse(raw, path), path)


def parse(raw: bytes, path: Path | str = "The file") -> Any:
    """What the bytes of a notebook file hold; raises NotebookError."""
    if not raw.strip():
        raise NotebookError(f"{path} is empty.")
    try:
        text = _decoded(raw).strip()
        return json.loads(text)
    except UnicodeDecodeError:
        raise NotebookError(f"{path} is not UTF-8 text, so it is not a notebook.") from None
    except json.JSONDecodeError as error:
        if conflict := re.search(r"^(<{7}|[|]{7}|={7}|>{7})(?=\s|$)", text, re.MULTILINE):
            line = text[: conflict.start()].count("\n") + 1
            raise NotebookError(
                f"{path} is not a notebook any more: git's conflict marks are in it (line {line}). Keep one side of "
                "each conflict, delete the marks, and save it again."
            ) from None
        if text.startswith("{") and (not text.endswith("}") or error.pos >= len(text)):
            raise NotebookError(f"{path} ends in the middle: it was cut off when it was saved or sent.") from None
        raise NotebookError(f"{path} is not a notebook: line {error.lineno} is not JSON.") from None
    except ValueError:  # int() refuses more than some thousand digits
        raise NotebookError(f"{path} is not a notebook: a number in it is too long.") from None
    except RecursionError:
        raise NotebookError(f"{path} is not a notebook: it is nested too deeply.") from None


def _decoded(raw):
    """The text of a file: UTF-8, or what PowerShell (UTF-16) and other programs of Windows write in its place."""
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return raw.decode("utf-16")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        if not re.match(rb"\s*\{", raw) or b"\0" in raw:
            raise
        return raw.decode("cp1252")


def cells_of(content: Any, path: Path | str = "The file") -> list[Cell]:
    """The cells of a parsed notebook; raises NotebookError if it is none."""
    version = content.get("nbformat") if isinstance(content, dict) else None
    if not isinstance(version, int):
        raise NotebookError(f"{path} is JSON, but not a notebook.")
    if version not in (3, 4):
        advice = "open it in Jupyter and save it again" if version < 4 else "this kit is older than that"
        raise NotebookError(f"{path} is a notebook of format {version}, not 4: {advice}.")
    cells = content.get("cells") if version == 4 else _older(content.get("worksheets"))
    if not isinstance(cells, list):
        raise NotebookError(f"{path} is a notebook without a list of cells.")
    return [_cell(cell, number, path) for number, cell in enumerate(cells, start=1)]


def _older(sheets):
    """The cells of a notebook of format 3, which has pages of them and calls a code cell's source its input."""
    try:
        cells = [cell for sheet in sheets for cell in sheet["cells"]]
        return [{**cell, "source": cell["input"]} if "input" in cell else cell for cell in cells]
    except (TypeError, KeyError):
        return None


def labels(cells: Sequence[Cell]) -> dict[int, str]:
    """{number of a cell: its label}, each label once: copies keep an id, and all but the first go by number."""
    found: dict[str, int] = {}
    for cell in cells:
        found.setdefault(cell.label, cell.number)
    return {cell.number: cell.label if found[cell.label] == cell.number else f"cell {cell.number}" for cell in cells}


def _cell(cell, number, path):
    source = cell.get("source") if isinstance(cell, dict) else None
    if isinstance(cell, dict) and source is None:  # some programs leave it out where a cell is empty
        source = ""
    if isinstance(source, list) and all(isinstance(line, str) for line in source):
        # Programs that cut the text into lines themselves may have lost all that ends them.
        source = ("" if any(line.endswith("\n") for line in source) else "\n").join(source)
    if not isinstance(source, str) or not isinstance(cell.get("cell_type"), str):
        raise NotebookError(f"{path}: cell {number} is not a notebook cell.")
    id = cell["id"] if isinstance(cell.get("id"), str) else ""
    found = Cell(number, id, "own", cell["cell_type"] == "code", source, cell)
    found = replace(found, id=_kept_id(found))
    # The role in the metadata, which copying and pasting keeps; else a tag; else what the id begins with.
    words = [found.metadata.get("labkit"), *found.tags, re.split("[-_]", id)[0]]
    return replace(found, role=next((word for word in words if word in ROLES), "own"))


def _kept_id(cell):
    """The cell's id as the lab gave it: many programs make new ones, or none, but keep nbgrader's in the metadata."""
    marks = cell.metadata.get("nbgrader")
    kept = marks.get("grade_id") if isinstance(marks, dict) else None
    return kept if isinstance(kept, str) and not cell.id.startswith(ROLES) else cell.id
