"""A lab as one page of HTML to be printed: formulas as MathML, pictures in the page, lines under each question."""

import html
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined
from markdown_it import MarkdownIt
from markupsafe import Markup
from mdit_py_plugins.amsmath import amsmath_plugin
from mdit_py_plugins.dollarmath import dollarmath_plugin
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import PythonLexer

from ...notebook.read import Cell, NotebookError, read
from ...notebook.session import Session
from ..authoring import kit
from ..records import CommandError
from ..report.formula import mathml
from ..report.texts import counted

LINES = 6, 2  # to write on under a question: these, and so many more for each point

_HINT = re.compile(r"<details>\s*<summary>(.*?)</summary>(.*?)</details>", re.S)
_COLOURS = HtmlFormatter(style="default", nowrap=True)


class Part(NamedTuple):
    """A piece of the page: 'text', 'code', 'picture', 'printed' or 'answer'; what it holds; lines to write on."""

    kind: str
    html: Markup = Markup()
    lines: int = 0


def page(lab: str, root: Path) -> str:
    """The page of the lab called `lab` of the project in `root`. Raises CommandError if there is none."""
    try:
        book, run = (read(root / folder / f"{lab}.ipynb") for folder in ("notebooks", "solutions"))
    except NotebookError as error:
        raise CommandError(f"{error} Labs are called as in notebooks/, such as 01_cartesian_ekf.") from None
    hints: list[Part] = []
    shown = {cell.id: cell.stored.get("outputs", []) for cell in run if cell.id in _given(book)}
    parts = [part for cell in book if cell.id != kit.ID for part in _parts(cell, shown.get(cell.id, ()), hints)]
    pages = Environment(loader=PackageLoader(__package__, ""), autoescape=True, undefined=StrictUndefined)
    title = next((cell.source.splitlines()[0].lstrip("# ") for cell in book if cell.source.startswith("# ")), lab)
    colours = Markup(_COLOURS.get_style_defs("pre"))
    return pages.get_template("page.html.j2").render(title=title, colours=colours, parts=parts, hints=hints)


def _given(book: Sequence[Cell]) -> set[str]:
    """The ids of cells that show what no answer is needed for: nothing of a student's is in their pictures."""
    steps = Session(book).steps
    imported = {name for step in steps if type(step.node).__name__.startswith("Import") for name in step.names.sets}
    waiting: set[str] = set()  # names that an answer makes or changes
    labels = set()
    for step in steps:
        if step.unfilled or step.names.uses & (waiting | {"load_answer"}):
            waiting |= step.names.sets | step.names.changes - imported
            labels.add(step.label)
    return {cell.id for cell in book if cell.role == "show" and cell.label not in labels}


def _parts(cell, outputs, hints):
    """The Parts of a cell; its hints are put with the others."""
    if cell.code:
        yield Part("code", Markup(highlight(cell.source, PythonLexer(), _COLOURS)))
        yield from filter(None, map(_output, outputs))
    elif cell.role == "answer":
        points = cell.metadata.get("nbgrader", {}).get("points", 0)
        worth = Markup.escape(counted(points, "point")) if points else Markup()
        yield Part("answer", worth, round(LINES[0] + LINES[1] * points))
    else:
        yield Part("text", _text(_HINT.sub(lambda found: _put_by(found, hints), cell.source)))


def _put_by(hint, hints):
    hints.append(Part("text", _text(hint[2])))
    return f"*{hint[1].strip()}: number {len(hints)} at the end.*"


def _output(output):
    data = output.get("data", {})
    if "image/png" in data:
        return Part("picture", Markup('<img alt="" src="data:image/png;base64,{}">').format("".join(data["image/png"])))
    if output.get("name") == "stdout":
        return Part("printed", Markup.escape("".join(output["text"])))
    return None


def _text(source: str) -> Markup:
    """A lab's own Markdown as HTML."""
    return Markup(_MARKDOWN.render(source))


def _math(tex: str, options: dict[str, Any] | None = None) -> str:
    return mathml(tex, options is None or options["display_mode"]) or f"<code>{html.escape(tex)}</code>"


_MARKDOWN = MarkdownIt("commonmark", {"html": True}).enable(["table", "strikethrough"])
_MARKDOWN.use(dollarmath_plugin, allow_labels=False, double_inline=True, renderer=_math).use(
    amsmath_plugin, renderer=_math
)
