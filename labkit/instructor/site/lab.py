"""One lab as a page: what students get, and the pictures that the executed solution keeps; none of its code."""

import re
from base64 import b64decode
from pathlib import Path
from typing import Any, NamedTuple

import nbformat

from ..authoring import kit
from ..records import CommandError
from . import film

FIRST = """
```{{container}} take
Take it with you: {{download}}`{name}.ipynb`, one file of the [students' kit](../docs/students.md).{lite}
Pictures are here as they come out where all answers are right.
```
"""
LITE = (
    ' Or <a href="../lite/lab/index.html?path=notebooks/{name}.ipynb">open it in the browser</a>, '
    "with nothing installed."
)


class Head(NamedTuple):
    """What a lab's first cell says of it: title, time and what it builds on, the rest with the outcomes."""

    title: str
    time: str
    rest: str


def head(student: Path) -> Head:
    """The first cell of a students' notebook, in parts. Raises CommandError for one that has no such cell."""
    cells = _read(student).cells
    found = re.match(r"# ([^\n]+)\n+\*(.+?)\*\n+(.*)", cells[0].source if cells else "", re.S)
    if not found:
        raise CommandError(f"{student} does not begin with a title and a line that says how long the lab takes.")
    return Head(*(part.strip() for part in found.groups()))


def page(student: Path, executed: Path, folder: Path, lite: bool = False) -> str:
    """The Markdown of a lab's page; its pictures are written into `folder`, beside which the page stands.

    student, executed: the two notebooks. lite: whether the site has the lab in the browser too.
    Raises CommandError for a notebook that cannot be read.
    """
    drawn = {cell.id: list(_pictures(cell)) for cell in _read(executed).cells if cell.cell_type == "code"}
    films = film.films(executed)
    parts, section = [], "the beginning"
    folder.mkdir(parents=True, exist_ok=True)
    for cell in _read(student).cells:
        if cell.cell_type == "markdown":
            parts.append(cell.source)
            section = (re.findall(r"(?m)^##+ (.+)", cell.source) or [section])[-1]
            continue
        if cell.id == kit.ID:
            continue
        if not cell.metadata.get("jupyter", {}).get("source_hidden"):  # as in the notebook, what is folded stays away
            parts.append(f"```python\n{cell.source}\n```")
        shown = [_shown(cell.id, n, png, text, folder, section) for n, (png, text) in enumerate(drawn.get(cell.id, []))]
        if cell.id in films:
            film.save(films[cell.id], folder / f"{cell.id}-film.png")
            shown.append(_folded("See it move", f"![The run of the picture, moving]({folder.name}/{cell.id}-film.png)"))
        if shown and cell.metadata.get("labkit") == "guess":
            shown = [_folded("What it draws (predict first)", "\n\n".join(shown))]
        parts += shown
    note = FIRST.format(name=student.stem, lite=LITE.format(name=student.stem) if lite else "")
    title, _, rest = parts[0].partition("\n")
    return "\n\n".join([title, note.strip(), rest.strip(), *parts[1:]]) + "\n"


def _read(path) -> Any:
    try:
        return nbformat.read(path, as_version=4)
    except (OSError, ValueError, nbformat.ValidationError) as error:
        raise CommandError(f"{path} cannot be read as a notebook: {error}. `labkit build` makes it anew.") from None


def _pictures(cell):
    """(PNG, its line of text or '') of each picture that a cell keeps."""
    for output in cell.outputs:
        data = output.get("data", {})
        if "image/png" in data:
            text = data.get("text/plain", "")
            yield b64decode(data["image/png"]), "" if text.startswith("<") else text


def _shown(cell, number, png, text, folder, section):
    """The Markdown of a picture, which is written into the folder."""
    path = folder / f"{cell}-{number}.png"
    path.write_bytes(png)
    words = re.sub(r"[\[\]`*\\]", "", section)
    picture = f"![Picture in “{words}”{': ' if text else ''}{text}]({folder.name}/{path.name})"
    said = f"*With its controls in the notebook. Here as it begins: {text}*"
    return f"{picture}\n\n{said}" if text else picture


def _folded(summary, text):
    return f"<details><summary>{summary}</summary>\n\n{text}\n\n</details>"
