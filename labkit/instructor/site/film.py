"""A lab's animations as pictures that move by themselves (APNG), made by running what its solution plays."""

import ast
import contextlib
import io
from dataclasses import replace
from pathlib import Path
from typing import Any

from matplotlib import pyplot
from PIL import Image

from ...notebook.read import Cell, read
from ...notebook.session import Session
from ..records import CommandError

NAME, SECONDS = "_film_{}", 300.0
INTERVAL, COLOURS = 80, 64  # [ms] a picture
WHITE = 247  # the paper is a mean of what is nearly white too, and would look grey beside the page


def films(executed: Path) -> dict[str, list[Image.Image]]:
    """{id of a cell: its pictures} of the cells of an executed notebook that end in `play(...)`.

    Raises CommandError for one whose code stops.
    """
    cells: list[Cell] = []
    found: list[str] = []
    for cell in read(executed):
        named = _named(cell.source, NAME.format(len(found))) if cell.code and "play(" in cell.source else ""
        found += [cell.id] if named else []
        cells.append(replace(cell, source=named or cell.source))
    if not found:
        return {}
    pyplot.switch_backend("Agg")
    session = Session(cells)
    wanted = [NAME.format(number) for number in range(len(found))]
    # The labs look for each other's answers in their own folder, and print how they are doing.
    with contextlib.chdir(executed.parent), contextlib.redirect_stdout(io.StringIO()):
        for problem in session.run(wanted, SECONDS):
            raise CommandError(f"{executed}, {problem.where} stopped: {' '.join(problem.lines)}")
        screens: dict[str, Any] = {id: session.names[name] for id, name in zip(found, wanted)}
        pyplot.close("all")  # what the cells before have drawn
        return {id: screen.film() for id, screen in screens.items()}


def save(pictures: list[Image.Image], path: Path) -> None:
    """Write the pictures as one that moves, again and again, in the colours of its beginning, middle and end."""
    wide, high = pictures[0].size
    some = Image.new("RGB", (wide, 3 * high))
    for place, one in enumerate((pictures[0], pictures[len(pictures) // 2], pictures[-1])):
        some.paste(one, (0, place * high))
    palette = some.quantize(COLOURS)  # a third of the bytes, and lines and letters as sharp as before
    palette.putpalette([255 if value > WHITE else value for value in palette.getpalette() or ()])
    first, *rest = (one.quantize(palette=palette, dither=Image.Dither.NONE) for one in pictures)
    first.save(path, save_all=True, append_images=rest, duration=INTERVAL, loop=0)


def _named(source, name):
    """The source with its last expression, a call of `play`, under a name; '' if it ends otherwise."""
    tree = ast.parse(source)
    last = tree.body[-1] if tree.body else None
    if not (isinstance(last, ast.Expr) and isinstance(last.value, ast.Call)):
        return ""
    if getattr(last.value.func, "id", "") != "play":
        return ""
    tree.body[-1] = ast.Assign([ast.Name(name, ast.Store())], last.value)
    return ast.unparse(ast.fix_missing_locations(tree))
