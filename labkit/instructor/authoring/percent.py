"""Read a lab's source, `solutions/NN_name.py` in jupytext's percent format: each cell gets an id and a role.

Before the cell "setup" comes one that is the same in all labs, see `labkit.instructor.authoring.kit`.
"""

import re
from pathlib import Path

import jupytext
from nbformat import NotebookNode, from_dict

from ...guesses import UNMADE
from ...notebook.read import Cell, cells_of
from ..records import CommandError
from . import kit

ROLES = ("setup", "answer", "check", "guess")
KERNEL = {
    "kernelspec": {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}


def notebook(script: Path) -> NotebookNode:
    """The notebook in a script, solutions and hidden parts in it.

    Raises CommandError for a script that is no UTF-8, and for ids and tags that no notebook can have.
    """
    text = _text(script)
    for line, head in enumerate(text.splitlines(), 1):
        if re.match(r'# %%.*\stags=(?!\[("[^"]*"[, ]*)*\])', head):  # which jupytext stops at, without a line
            raise CommandError(f'solutions/{script.name}, line {line}: tags are a list of texts, as in tags=["check"].')
    made = jupytext.reads(text, fmt="py:percent")
    ids = set[str]()
    for number, cell in enumerate(made.cells, 1):
        tags = cell.metadata.get("tags", [])
        kind = "show" if cell.cell_type == "code" else "text"
        cell.id = cell.metadata.pop("id", f"{kind}-{number:02d}")
        if wrong := _unfit(cell.id, ids):
            raise CommandError(f"{place(script, number - 1 + ('setup' in ids))}: {wrong}.")
        ids.add(cell.id)
        roles = [role for role in ROLES if role in tags and "hidden" not in tags]
        cell.metadata["labkit"] = role = roles[0] if roles else kind
        if role == "answer" or "points" in cell.metadata:
            cell.metadata["nbgrader"] = _graded(cell, role, cell.metadata.pop("points", None))
    made.cells = [one for cell in made.cells for one in ([kit.cell()] if cell.id == "setup" else []) + [cell]]
    made.nbformat, made.nbformat_minor = 4, 5
    made.metadata = from_dict(KERNEL)
    return made


def _text(script):
    """What a script says, with or without a byte order mark."""
    data = script.read_bytes()
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise CommandError(f"solutions/{script.name}, line {line}: this is no UTF-8: save the file as UTF-8.") from None


def _unfit(id, ids):
    """Why a cell cannot have this id, '' if it can. ids: those of the cells before."""
    if not isinstance(id, str) or not re.fullmatch(r"[\w-]{1,64}", id, re.ASCII):
        return f"the id {id!r} has to be a text in quotes, of letters from a to z, digits, '-' and '_' only"
    return f"two cells have the id '{id}'" if id in ids else ""


def cells(script: Path) -> list[Cell]:
    """The cells in a script. Raises CommandError as `notebook` does."""
    return cells_of(notebook(script), script)


def place(script: Path, number: int, line: int = 0) -> str:
    """Where a line of the cell with this number (from 0 on) is, 0 for its head: 'solutions/09_my_lab.py, line 30'."""
    lines = enumerate(_text(script).splitlines(), 1)
    heads = [one for at, text in lines if text.startswith("# %%") for one in [at] * (1 + ('id="setup"' in text))]
    return f"solutions/{script.name}" + (f", line {heads[number] + line}" if number < len(heads) else "")


def unmade(id: str, source: str) -> str:
    """The source of a cell with a prediction that is still to be made. Raises CommandError if there is none in it."""
    source, count = re.subn(r"""^(guess = )["']\w["']""", rf'\1"{UNMADE}"', source, flags=re.MULTILINE)
    if count != 1:
        raise CommandError(f"cell '{id}': a prediction has one line such as guess = \"b\"")
    return source


def _graded(cell, role, points):
    """What a cell counts, in nbgrader's schema: an answer of text is marked by hand, a check by itself."""
    marks = {
        "schema_version": 3,
        "grade_id": cell.id,
        "cell_type": cell.cell_type,
        "task": False,
        "grade": points is not None,
        "solution": role == "answer",
        "locked": role != "answer",
    }
    return marks | ({"points": points} if points is not None else {})
