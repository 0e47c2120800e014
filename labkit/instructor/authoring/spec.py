"""How solutions/checks defines the checks, and how forms of a solution are built (for maintainers).

A form is the solution's source with some texts replaced, [(old, new), ...], or code that is appended
to it and redefines what it likes.
"""

import ast
import importlib.util
import re
import sys
from dataclasses import dataclass, field
from pathlib import Path

from ..records import CommandError


@dataclass(frozen=True)
class Right:
    """Another form of the right answer; other=True if its numbers differ and are accepted as well."""

    id: str
    form: object
    other: bool = False


@dataclass(frozen=True)
class Mistake:
    """A known mistake: what the student is told, and the forms it comes in."""

    id: str
    say: str
    forms: tuple

    def __init__(self, id, say, *forms):
        for name, value in (("id", id), ("say", say), ("forms", forms)):
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class Check:
    """A check and all that its data are made from."""

    name: str
    lab: str  # the solution's name, '01_cartesian_ekf'
    subject: str  # the name in it, 'KF'
    kind: str  # 'filter' or 'function'
    scenarios: list
    right: list = field(default_factory=list)
    mistakes: list = field(default_factory=list)


class SpecError(CommandError):
    """The definitions of a check contradict each other or the solution."""


def definitions(root):
    """The checks that the package solutions/checks defines in its list CHECKS."""
    path = Path(root) / "solutions" / "checks" / "__init__.py"
    spec = importlib.util.spec_from_file_location("labkit_solution_checks", path)
    package = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(package)
    return package.CHECKS


def answers(root, lab, forms=None):
    """The imports of the setup cell and the answer cells of a solution, as one source.

    forms: if they are known, only the imports that they or the answers need.
    """
    text = (Path(root) / "solutions" / f"{lab}.py").read_text(encoding="utf-8")
    cells = [part.partition("\n")[::2] for part in re.split(r"^# %%", text, flags=re.MULTILINE)]
    cells = [(head, body) for head, body in cells if "[markdown]" not in head]
    setup = "\n".join(body for head, body in cells if '"setup' in head)
    body = "\n".join(body for head, body in cells if '"answer' in head)
    needed = None if forms is None else set(re.findall(r"\w+", body + repr(forms)))
    return imports(setup, needed) + "\n" + body


def imports(source, needed):
    """The imports in a source, of the `needed` names if not None: matplotlib, for one, takes a second to load."""
    lines = []
    for node in ast.parse(source).body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = node.names
            node.names = [n for n in names if needed is None or (n.asname or n.name) in needed]
            lines += [ast.unparse(node)] if node.names else []
    return "\n".join(lines)


def build(source, form, name):
    """The object `name` of the solution in another form."""
    if isinstance(form, str):
        source = f"{source}\n{form}"
    else:
        for old, new in form:
            if source.count(old) != 1:
                raise SpecError(f"`{old}` occurs {source.count(old)} times in the solution, not once")
            source = source.replace(old, new)
    namespace = {"__name__": "form"}
    exec(compile(source, "<a form of the solution>", "exec"), namespace)
    return namespace[name]
