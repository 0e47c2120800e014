"""How solutions/checks defines the checks, and how forms of a solution are built (for maintainers).

A form is the solution's source with some texts replaced, [(old, new), ...], or code that is appended
to it and redefines what it likes.
"""

import ast
import importlib.util
import re
import sys
import traceback
from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from ...notebook.read import Cell
from ..records import CommandError

Form: TypeAlias = str | Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Right:
    """Another form of the right answer; other=True if its numbers differ and are accepted as well."""

    id: str
    form: Form
    other: bool = False


@dataclass(frozen=True)
class Mistake:
    """A known mistake: what the student is told, and the forms it comes in."""

    id: str
    say: str
    forms: tuple[Form, ...]

    def __init__(self, id: str, say: str, *forms: Form) -> None:
        for name, value in (("id", id), ("say", say), ("forms", forms)):
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class Parts:
    """How the points of all checks of a filter are divided.

    weights: {part: per cent of each check's points}, parts as in `labkit.instructor.records.PARTS`;
    drawn: from a random generator to other inputs for the probing, by which the right parts are found.
    """

    weights: dict[str, int]
    drawn: Callable[[np.random.Generator], dict]


@dataclass(frozen=True)
class Check:
    """A check and all that its data are made from."""

    name: str
    lab: str  # the solution's name, '01_cartesian_ekf'
    subject: str  # the name in it, 'KF'
    kind: str  # 'filter' or 'function'
    scenarios: list[dict]
    right: list[Right] = field(default_factory=list)
    mistakes: list[Mistake] = field(default_factory=list)
    probing: dict | None = None  # what a filter is asked besides, see labkit.checks.identify
    parts: dict | None = None  # of a function's outputs, what rows and columns are, see labkit.checks.cells
    divided: Parts | None = None  # how the points of all checks of a filter are, if not whole


def definitions(root: Path | str) -> list[Check]:
    """The checks that the package solutions/checks under `root` defines in its list CHECKS.

    Raises CommandError for a module in it that stops, with the line.
    """
    path = Path(root) / "solutions" / "checks" / "__init__.py"
    spec = importlib.util.spec_from_file_location("labkit_solution_checks", path)
    assert spec and spec.loader  # which is so for any file that ends in .py
    package = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(package)
    except (Exception, SystemExit) as error:  # written by the author of a lab, and may raise anything
        raise CommandError(f"{_raised(error, path.parent)}: {type(error).__name__}: {error}") from error
    return package.CHECKS


def _raised(error, folder):
    """The last line in the folder's files that an exception went through: 'solutions/checks/my_lab.py, line 12'."""
    steps = [(step.filename, step.lineno) for step in traceback.extract_tb(error.__traceback__)]
    steps += [(error.filename, error.lineno)] if isinstance(error, SyntaxError) else []
    name, line = [(Path(name).name, line) for name, line in steps if Path(name or "").parent == folder][-1]
    return f"solutions/checks/{name}, line {line}"


def answers(cells: Sequence[Cell], forms: Sequence[Form] | None = None) -> str:
    """The imports of the set-up and the answers in a solution's cells, as one source.

    forms: if they are known, only the imports that they or the answers need. Left out are answers that build on one
    of an earlier lab, which is not there: no check looks at them.
    """
    setup = "\n".join(cell.source for cell in cells if cell.code and "setup" in cell.tags)
    lent = {name for line in re.findall(r"^(.+) = .*\bload_answer\(", setup, re.M) for name in re.findall(r"\w+", line)}
    own = [cell.source for cell in cells if cell.code and "answer" in cell.tags]
    body = "\n\n".join(source for source in own if not lent & set(re.findall(r"\w+", source)))
    needed = None if forms is None else set(re.findall(r"\w+", body + repr(forms)))
    return f"{imports(setup, needed)}\n{body}\n"


def defined(cells: Sequence[Cell]) -> list[str]:
    """The functions and classes that a lab's own answer cells define, filled in or not, in their order."""
    nodes = [node for cell in cells if cell.code and cell.role == "answer" for node in ast.parse(cell.source).body]
    return [node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.ClassDef)]


def imports(source: str, needed: Container[str] | None) -> str:
    """The imports in a source, of the `needed` names if not None: matplotlib, for one, takes a second to load."""
    lines = []
    for node in ast.parse(source).body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = node.names
            node.names = [n for n in names if needed is None or (n.asname or n.name) in needed]
            lines += [ast.unparse(node)] if node.names else []
    return "\n".join(lines)


def build(source: str, form: Form, name: str) -> Any:
    """The object `name` of the solution in another form. Raises CommandError for a text that is not once in it."""
    if isinstance(form, str):
        source = f"{source}\n{form}"
    else:
        for old, new in form:
            if source.count(old) != 1:
                raise CommandError(f"`{old}` occurs {source.count(old)} times in the solution, not once")
            source = source.replace(old, new)
    namespace = {"__name__": "form"}
    exec(compile(source, "<a form of the solution>", "exec"), namespace)
    if name not in namespace:
        raise CommandError(f"it defines no {name!r}")
    return namespace[name]
