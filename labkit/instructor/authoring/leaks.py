"""What must not leave in a release: the lines of solutions and hidden cells, and what someone tried out."""

import ast
import json
import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

from ...notebook.read import Cell, NotebookError, cells_of, parse
from ..records import CommandError
from . import percent

# Shorter pieces, counted without white space, stand in much that gives nothing away.
TELLING = 20

_BLOCK = re.compile(r"^[ \t]*### BEGIN (SOLUTION|HIDDEN TESTS)\n(.*?)^[ \t]*### END \1[ \t]*\n?", re.M | re.S)
_STUB = re.compile(r"^[ \t]*raise NotImplementedError\(.*\)$|^\*Write your answer here.*\*$", re.M)


@dataclass(frozen=True)
class SourceCell:
    """A cell of solutions/NN_name.py: what students see of it, and the texts that they must not see."""

    name: str
    code: bool
    hidden: bool
    visible: str
    secrets: list[str]


def leaks(scripts: Sequence[Path], kit: Mapping[str, tuple[bytes, int]]) -> Iterator[str]:
    """Sentences on what stands in the kit although students must not see it.

    scripts: the sources of the labs;  kit: {path: (content, mode)}. Raises CommandError for what cannot be searched.
    """
    labs = {script.stem: _cells(script) for script in scripts}
    for lab, cells in labs.items():
        path = f"notebooks/{lab}.ipynb"
        yield from _unlike_source(path, lab, cells, kit[path][0])
    secrets = _secrets(labs)
    for path, (data, _) in kit.items():
        if path.endswith(".png"):
            continue
        texts = _texts(path, data)
        bare = _bare("\n".join(texts))
        for piece, (where, told) in secrets.items():
            if piece in bare:
                yield f"{path} holds `{told}`, which is secret in {where}."
        if "labkit/checks/data/" in path:
            code = [text for text in texts if _is_code(text)]
            yield from (f"{path} holds code, `{text}`: checks store numbers and sentences." for text in code)


def released(path: str, data: bytes) -> list[Cell]:
    """The cells of a students' notebook. Raises CommandError if it has none."""
    try:
        cells = cells_of(parse(data, path), path)
    except NotebookError:
        cells = []
    if not cells:
        raise CommandError(f"{path} is not a notebook with cells: `labkit build` makes it anew.")
    return cells


def _cells(script):
    """The list of SourceCell of a script."""
    found = []
    for cell in percent.cells(script):
        hidden = "hidden" in cell.tags
        visible = _BLOCK.sub("\n", cell.source)
        visible = percent.unmade(cell.id, visible) if cell.role == "guess" else visible
        secrets = [cell.source] if hidden else [match[2] for match in _BLOCK.finditer(cell.source)]
        name = f"cell '{cell.id}'"
        if not hidden and ("SOLUTION" in visible or "HIDDEN TESTS" in visible):
            raise CommandError(f"solutions/{script.name}, {name}: a solution or hidden marker lacks its partner.")
        found.append(SourceCell(name, cell.code, hidden, "" if hidden else visible, secrets))
    return found


def _secrets(labs):
    """{a piece without white space: (where it stands, the piece)} of all that students must not see.

    A piece that a lab also shows outside of its solutions and hidden cells is no secret: its author
    says there, mostly in a hint, what to write.  The script decides on that and not the notebook,
    so that a notebook cannot excuse itself.
    """
    shown = _bare("".join(cell.visible for cells in labs.values() for cell in cells))
    secrets = {}
    for lab, cells in labs.items():
        for cell in cells:
            for piece in (piece for text in cell.secrets for piece in _pieces(text, cell.code)):
                if _bare(piece) not in shown:
                    secrets.setdefault(_bare(piece), (f"solutions/{lab}.py, {cell.name}", piece))
    return secrets


def _pieces(text, code):
    """The lines of a text, and the sentences of one that is not code: it may have been wrapped anew."""
    pieces = text.splitlines() + ([] if code else re.split(r"(?<=[.:;?!])\s+", text))
    telling = [" ".join(piece.split()) for piece in pieces if len(_bare(piece)) >= TELLING]
    # A solution of short lines only tells as a whole.
    return telling or [" ".join(text.split())] * (len(_bare(text)) >= TELLING)


def _unlike_source(path, lab, cells, data):
    """Sentences on outputs in a notebook, and on cells that are not what the script leaves for students.

    That finds what a search for known lines cannot: an answer that someone tried out in the notebook.
    """
    anew = "`labkit build` makes it anew."
    there = released(path, data)
    if "widgets" in parse(data, path).get("metadata", {}):
        yield f"{path} holds the states of widgets: {anew}"
    for cell in there:
        counted = cell.stored.get("execution_count") is not None
        if counted or cell.stored.get("outputs") or cell.stored.get("attachments"):
            yield f"{path}, cell '{cell.id}' was run and holds outputs: {anew}"
    seen = [cell for cell in cells if not cell.hidden]
    for due, cell in zip_longest(seen, there):
        if due is None or cell is None or _visible(due.visible) != _visible(cell.source):
            name = due.name if due else f"cell '{cell.id}'"
            yield f"{path}, {name} is not what solutions/{lab}.py leaves for students: {anew}"
            return


def _visible(source):
    return _bare(_STUB.sub("", source))


def _bare(text):
    """The text without white space, so that neither indenting nor wrapping makes another line of it."""
    return "".join(text.split())


def _texts(path, data):
    """The texts in a file: all strings of a JSON file, whose quotes and line breaks are escaped there."""
    try:
        text = data.decode("utf-8")
        return list(_strings(json.loads(text))) if path.endswith((".json", ".ipynb")) else [text]
    except ValueError:
        raise CommandError(f"{path} cannot be searched: it is not UTF-8 text, or not JSON.") from None


def _strings(value):
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for key, item in value.items():
            yield key
            yield from _strings(item)
    elif isinstance(value, list):
        for item in value:
            yield from _strings(item)


def _is_code(text):
    """Whether a text is a Python statement; single words and names with dashes are just expressions."""
    try:
        tree = ast.parse(textwrap.dedent(text).strip())
    except (SyntaxError, ValueError):
        return False
    return any(not isinstance(node, ast.Expr) for node in tree.body)
