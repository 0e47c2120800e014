"""Which of a notebook's statements run: what the wanted names depend on, and nothing else."""

import ast
import builtins
from collections.abc import Sequence, Set
from dataclasses import dataclass

from . import source
from .names import Names

SHADOWED = {"abs", "all", "any", "divmod", "max", "min", "pow", "round", "sum"}  # by `from numpy import *`
_DEFINITIONS = (ast.FunctionDef, ast.ClassDef)


@dataclass(eq=False)
class Step:
    """One statement at the top of a cell. label: of the cell;  given: whether it is the lab's own, not the student's;
    unfilled: whether it defines something that is still to be written.
    """

    label: str
    role: str
    given: bool
    node: ast.stmt
    names: Names
    unfilled: bool = False


def needed(steps: Sequence[Step], wanted: Set[str]) -> list[Step]:
    """The steps that run: what the wanted names depend on, and what changes any of that."""
    steps = _without_stubs(steps)
    made = {name for step in steps for name in step.names.sets}
    imported = {name for step in steps if _is_import(step.node) for name in step.names.sets}
    functions = {s.node.name: s.names.inside for s in steps if isinstance(s.node, ast.FunctionDef) and not s.given}
    # Any statement may need these.
    chosen = {s for s in steps if s.names.path or is_future(s.node) or source.WRITE in s.names.uses}
    while True:
        names = set(wanted).union(*(step.names.uses for step in chosen))
        unknown = names - made - (set(dir(builtins)) - SHADOWED)
        more = {s for s in steps if _serves(s, names, imported, functions) or s.names.anything and unknown} - chosen
        if not more:
            return [step for step in steps if step in chosen]
        chosen |= more


def _without_stubs(steps):
    """The steps without parts that are still to be written and are written elsewhere: they replace nothing."""
    written = {
        name
        for step in steps
        if isinstance(step.node, _DEFINITIONS) or isinstance(step.node, ast.Assign) and step.role in ("answer", "own")
        for name in step.names.sets
        if not step.unfilled
    }
    return [step for step in steps if not (step.unfilled and step.names.sets <= written)]


def _serves(step, names, imported, functions):
    """Whether a step makes or changes one of the names."""
    if step.names.sets & names or (step.names.changes - imported) & names:
        return True
    own = functions if step.role in ("answer", "own") else {}
    changed = {name for function, name in step.names.passes if function in ("setattr", "delattr") or function in own}
    return bool(changed.union(*(own[function] for function in step.names.calls & own.keys())) & names)


def is_future(node: ast.stmt) -> bool:
    """Whether it is `from __future__ import ...`."""
    return isinstance(node, ast.ImportFrom) and node.module == "__future__"


def _is_import(node):
    return isinstance(node, ast.Import | ast.ImportFrom)


def is_unfilled(node: ast.stmt) -> bool:
    """Whether it defines a function or class in which a function still ends with `raise NotImplementedError`."""
    functions = [f for f in ast.walk(node) if isinstance(f, ast.FunctionDef)] if isinstance(node, _DEFINITIONS) else []
    ends = [f.body[-1].exc for f in functions if isinstance(f.body[-1], ast.Raise)]
    return any("NotImplementedError" in ast.unparse(end) for end in ends if end)
