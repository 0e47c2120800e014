"""The code that a lab gives its students, kept for `labkit check`: it supplies what a student's notebook lost."""

import json
from pathlib import Path

from ...notebook.read import read
from ...notebook.rehearse import GIVEN
from .. import files


def content(root: Path) -> str:
    """The text of the file GIVEN: for each lab under `root` the code of the students' notebook, without answers."""
    labs = {
        path.stem: [
            [cell.number, cell.id, cell.role, cell.source] for cell in read(path) if cell.code and cell.role != "answer"
        ]
        for path in sorted((root / "notebooks").glob("[0-9]*_*.ipynb"))
    }
    lines = (f"{json.dumps(lab)}: [\n" + ",\n".join(map(json.dumps, cells)) + "\n]" for lab, cells in labs.items())
    return "{\n" + ",\n".join(lines) + "\n}\n"


def write(root: Path) -> None:
    """Write it, if it is another than before."""
    if stale(root):
        files.write(GIVEN, content(root))


def stale(root: Path) -> bool:
    """Whether the file is not what the notebooks give today."""
    return not GIVEN.is_file() or GIVEN.read_text(encoding="utf-8") != content(root)
