"""The text of a student's answer, read where it failed: slips of Python that explain it, never a failure of their own.

The notebook and `labkit check` have the object, whose text Python remembers; grading has only the text of the cells,
in a process that runs none of it. Both come to the same sentences.
"""

import ast
import inspect
import linecache
import re
import sys
import textwrap
import types
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from itertools import islice
from typing import Any

from .feedback import is_library
from .hints import fold
from .slips import Method, Outside, odd, slips

LONGEST = 100_000  # characters of a cell that is read
MOST = 2  # sentences: who mends two slips runs the check again
UNREADABLE = SyntaxError, ValueError, RecursionError, MemoryError  # also of what was made to be unreadable
DATA = ast.Constant, ast.BinOp, ast.UnaryOp, ast.List, ast.Tuple, ast.Dict, ast.Call


def notes_on(subject: Any) -> list[str]:
    """What the text of a function, or of a class with all its methods, shows; [] where there is no text."""
    functions = list(functions_of(subject))
    nodes = [node for function in functions if (node := _node_of(function.__code__))]
    if not nodes or len(nodes) < len(functions) or any(map(_is_stub, nodes)):  # known in part: nothing is sure
        return []
    names = functions[0].__globals__

    def is_outside(name, has_field):
        value = names.get(name)
        tool = value is None or callable(value) or inspect.ismodule(value)
        return not tool and (has_field or not isinstance(value, int | float | str))  # a number may well be a constant

    return _said([Method(node, inspect.isclass(subject)) for node in nodes], is_outside)


def notes_in(trees: Sequence[ast.Module], name: str) -> list[str]:
    """The same for what cells define under this name; nothing of them is run."""
    node = definitions(trees).get(name)
    if not node or isinstance(node, ast.ClassDef) and node.bases:
        return []
    bound = isinstance(node, ast.ClassDef)
    nodes = [one for one in (node.body if bound else [node]) if isinstance(one, ast.FunctionDef)]
    data = dict(_assigned(trees))
    return _said(
        [Method(one, bound) for one in nodes], lambda name, has_field: name in data and (has_field or data[name])
    )


def definitions(trees: Iterable[ast.Module]) -> dict[str, ast.FunctionDef | ast.ClassDef]:
    """{name: the last definition at the top of these cells that is not a stub}."""
    nodes = [n for tree in trees for n in tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef)]
    return {node.name: node for node in nodes if not _is_stub(node)}


def parsed(text: str) -> ast.Module | None:
    """The tree of a cell, without its magics, or None if it is too long or no Python."""
    text = re.sub(r"(?m)^([ \t]*)[%!?].*$", r"\1pass", text) if len(text) <= LONGEST else ""
    try:
        with warnings.catch_warnings(action="ignore"):
            return ast.parse(text) if text else None
    except UNREADABLE:
        return None


def newest_is_broken(name: str) -> bool:
    """Whether the last cell run in this notebook that defines `name` is no Python, so that an older one counts."""
    ipython = sys.modules.get("IPython")
    shell = ipython and ipython.get_ipython()
    cells = shell.history_manager.input_hist_parsed if shell else []
    defines = re.compile(rf"\b(class|def)\s+{name}\b")
    newest = next((cell for cell in reversed(cells) if defines.search(cell)), "")
    try:
        with warnings.catch_warnings(action="ignore"):
            compile(newest, "cell", "exec", ast.PyCF_ALLOW_TOP_LEVEL_AWAIT)
    except (SyntaxError, ValueError):
        return True
    return False


def functions_of(subject: Any) -> Iterator[types.FunctionType]:
    """A student's function itself, or the methods of a class."""
    members = [subject, *(member for cls in getattr(subject, "__mro__", ()) for member in vars(cls).values())]
    for member in members:
        inner = getattr(member, "fget", None) if isinstance(member, property) else getattr(member, "__func__", member)
        if inspect.isfunction(inner):
            yield inner


def _said(methods: Sequence[Method], is_outside: Outside) -> list[str]:
    said: dict[str, None] = {}
    with suppress(*UNREADABLE):
        for found in (slips(methods, is_outside), odd(methods)):
            said = said or dict.fromkeys(islice(found, 20))  # one line can have the same slip very often
    return [line for sentence in list(said)[:MOST] for line in fold(sentence)]


def _node_of(code):
    """The definition that a code object was made from, its lines counted as the cell's, or None."""
    lines = [] if is_library(code.co_filename) else linecache.getlines(code.co_filename)
    if sum(map(len, lines)) > LONGEST:
        return None
    try:
        block = inspect.getblock(lines[code.co_firstlineno - 1 :])
    except (*UNREADABLE, IndexError):
        return None
    tree = parsed(textwrap.dedent("".join(block)))
    if not tree or not tree.body or not isinstance(tree.body[0], ast.FunctionDef):
        return None
    return ast.increment_lineno(tree.body[0], code.co_firstlineno - 1)


def _assigned(trees):
    """(name, whether it is more than a number or a text) of what cells give a value at their top, but for tools."""
    for node in (node for tree in trees for node in tree.body):
        value = getattr(node, "value", None)
        if isinstance(node, ast.Assign) and isinstance(value, DATA) and "load_answer" not in ast.dump(value):
            found = [n.id for target in node.targets for n in ast.walk(target) if isinstance(n, ast.Name)]
            yield from ((name, not isinstance(value, ast.Constant)) for name in found)
        elif isinstance(node, ast.For):
            yield from ((n.id, False) for n in ast.walk(node.target) if isinstance(n, ast.Name))


def _is_stub(node):
    ends = [f.body[-1] for f in ast.walk(node) if isinstance(f, ast.FunctionDef)]
    return any(isinstance(end, ast.Raise) and "NotImplementedError" in ast.dump(end) for end in ends)
