"""Find the written answers in a notebook: in their cells, in cells added below, in the question's own cell, as code.

What a student wrote is what the lab as it was handed out does not have. It belongs to the question that it stands
under, or whose cell (by id or nbgrader's grade_id) it stands in.
"""

import ast
import re
import warnings
from collections.abc import Sequence

from ...notebook.read import Cell
from .names import shorten

LONGEST = 200_000  # characters of one answer, without its pictures
PICTURE, PICTURES = 2_000_000, 6_000_000  # characters of one picture, and of all in one notebook, each time shown
SHOWN = ("image/png", "image/jpeg", "image/gif")
_ATTACHED = re.compile(r"\]\(attachment:([^)\s]+)[^)]*\)")


def written(released: Sequence[Cell], cells: Sequence[Cell]) -> tuple[dict[str, str], list[str]]:
    """({id: Markdown} of all written questions, '' where nothing was written; notes on what could not be placed).

    released: the cells of the students' notebook as it was handed out;  cells: those that were handed in. Pictures
    that are attached to a cell become part of the text, as data.
    """
    lab, reader = _Lab(released), _Reader()
    for cell in cells:
        reader.read(cell, lab)
    answers, notes, room = {}, [], [PICTURES]
    for id in lab.questions:
        pieces, left, shown = reader.found.get(id) or reader.code.get(id, []), LONGEST, []
        for text, pictures in pieces:
            shown.append(_with_pictures(text[:left], pictures, room))
            left -= min(len(text), left)
        if sum(len(text) for text, _ in pieces) > LONGEST:
            notes.append(f"Of cell '{id}' only the first {LONGEST} characters are shown.")
        answers[id] = "\n\n".join(filter(None, shown))
    if any(_ATTACHED.search(answer) for answer in answers.values()):
        notes.append("A picture in an answer is not shown: it is missing, of another kind, or too large.")
    if reader.strays and not all(answers.values()):
        places = ", ".join(reader.strays[:5])
        notes.append(f"Text that stands under no question and was not taken for an answer: {places}.")
    return answers, notes


class _Lab:
    """The lab as it was handed out. questions: ids of the written answers;  lines: {line: the question that it
    belongs to, or ''};  of: {cell id: the same}.
    """

    def __init__(self, released: Sequence[Cell]) -> None:
        self.questions = [cell.id for cell in released if cell.role == "answer" and not cell.code]
        self.of: dict[str, str] = {}
        self.lines: dict[str, str] = {}
        question = ""
        for cell in reversed(released):  # a question is the text that stands before its answer
            question = cell.id if cell.id in self.questions else question
            self.of[cell.id] = question
            if not cell.code:
                self.lines.update({line.strip(): question for line in cell.source.splitlines() if line.strip()})
            if re.search(r"^#", cell.source, re.MULTILINE) and not cell.code:
                question = ""
        self.stubs = {cell.source.strip() for cell in released if cell.id in self.questions}


class _Reader:
    """Goes through the cells. found, code: {question: pieces of text, and of code, each with its cell's pictures};
    strays: where other text stands;  pictures: of the cell that is read, {name: (type, base64)}.
    """

    def __init__(self) -> None:
        self.question = ""
        self.found: dict[str, list[tuple[str, dict]]] = {}
        self.code: dict[str, list[tuple[str, dict]]] = {}
        self.strays: list[str] = []
        self.pictures: dict[str, tuple[str, str]] = {}

    def read(self, cell: Cell, lab: _Lab) -> None:
        """Take in one cell."""
        known = cell.id in lab.of
        if known:
            self.question = lab.of[cell.id]
        if cell.code and cell.id not in lab.questions:
            if not known and self.question:
                self._add_code(cell.source)
            return
        self.pictures = _pictures(cell)
        own: list[str] = []
        for line in cell.source.splitlines():
            text = line.strip()
            if text in lab.stubs:
                continue
            if text and text in lab.lines:
                own = self._add(own, cell)
                self.question = lab.lines[text] or (self.question if cell.id in lab.questions else "")
            else:
                own.append(line)
        self._add(own, cell)

    def _add(self, lines, cell):
        """Take lines for (a part of) the answer to the question that it is at; returns no lines."""
        text = "\n".join(lines).strip("\n").rstrip()
        if text and not self.question:
            self.strays.append(f"{cell.label} ({shorten(' '.join(text.split()), 40)})")
        elif text:
            is_code = cell.code and not _is_prose(text)
            self._keep(self.found, _fenced(text) if is_code else _bare(text, cell.code))
        return []

    def _add_code(self, source):
        if not source.strip():
            return
        if _is_prose(source):
            self._keep(self.found, _bare(source.strip(), True))
        else:
            self._keep(self.code, _fenced(source.strip()))

    def _keep(self, where, text):
        where.setdefault(self.question, []).append((text, self.pictures))


def _pictures(cell):
    """{name: (type, base64)} of what is attached to a cell; Jupyter calls the first one of each cell image.png."""
    attachments, found = cell.stored.get("attachments"), {}
    for name, kinds in attachments.items() if isinstance(attachments, dict) else ():
        for kind in SHOWN:
            data = kinds.get(kind) if isinstance(kinds, dict) else None
            if isinstance(data, list):
                data = "".join(part for part in data if isinstance(part, str))
            if isinstance(data, str):
                found[name] = (kind, re.sub(r"\s", "", data))
    return found


def _with_pictures(text, pictures, room):
    """The text with its pictures as data; room: [characters that are left for them], which is counted down."""

    def picture(match):
        kind, data = pictures.get(match[1], ("", ""))
        sound = len(data) <= min(PICTURE, room[0]) and re.fullmatch(r"[A-Za-z0-9+/]+={0,2}", data)
        room[0] -= len(data) if sound else 0
        return f"](data:{kind};base64,{data})" if sound else match[0]

    return _ATTACHED.sub(picture, text)


def _is_prose(source):
    """Whether a code cell holds words: comments, a text in quotes, or what is no Python at all."""
    try:
        with warnings.catch_warnings(action="ignore"):
            body = ast.parse(source[:LONGEST]).body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return True
    return all(isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant | ast.Name) for node in body)


def _bare(text, code):
    """The words of a code cell without comment signs and quotes."""
    if not code:
        return text
    return re.sub(r"(?m)^[ \t]*#[ \t]?", "", text).strip().strip("\"'").strip()


def _fenced(source):
    fence = "`" * max(3, 1 + max(map(len, re.findall("`+", source)), default=0))
    return f"{fence}python\n{source}\n{fence}"
