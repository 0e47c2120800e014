"""What can be counted in labkit's code: `python docs/count.py` prints it, tests/test_house.py holds it.

Rooms, floors, arrows that run back up, lines, long modules and functions, and how many public functions say what
they take and give: a docstring, types, and the shape of every array (in an alias of labkit.geometry or in words).
"""

import ast
import re
import sys
from itertools import pairwise
from pathlib import Path

from house import ROOT, WING, back, floors, modules, plan

ARRAYS = re.compile(r"\b(NDArray|ndarray|ArrayLike)\b")
SHAPE = re.compile(r"\((?:\.\.\.|\d|[A-Za-z0-9+ ]+)(?:, ?[A-Za-z0-9+ .]+)*,?\)")


def public(path):
    """Yield (name, node) of the public functions and methods of a module."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    groups = [("", tree)] + [(f"{c.name}.", c) for c in tree.body if isinstance(c, ast.ClassDef) and c.name[0] != "_"]
    for prefix, group in groups:
        for node in group.body:
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                yield prefix + node.name, node


def untyped(node):
    """Whether a parameter or the result of a function has no type."""
    every = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs, node.args.vararg, node.args.kwarg]
    bare = [a for a in every if a and a.annotation is None and a.arg not in ("self", "cls")]
    return bool(bare) or node.returns is None


def aliases(root=ROOT):
    """Names of the types in geometry whose docstring says a shape."""
    body = ast.parse((root / "labkit" / "geometry.py").read_text(encoding="utf-8")).body
    pairs = [
        (a.targets[0].id, b.value.value)
        for a, b in pairwise(body)
        if isinstance(a, ast.Assign)
        and isinstance(a.targets[0], ast.Name)
        and isinstance(b, ast.Expr)
        and isinstance(b.value, ast.Constant)
    ]
    return {name for name, text in pairs if isinstance(text, str) and re.search(r"\(|any shape", text)}


def shapeless(node, shaped):
    """Whether arrays come or go through a function and neither its types nor its docstring say their shape."""
    notes = [
        ast.unparse(n)
        for n in (*(a.annotation for a in ast.walk(node.args) if isinstance(a, ast.arg)), node.returns)
        if n
    ]
    arrays = ARRAYS.search(" ".join(notes)) or any(re.search(r"\bArray\b", note) for note in notes)
    return bool(arrays) and not SHAPE.search(ast.get_docstring(node) or "")


def figures(root=ROOT):
    """{what: number or list} of all that the tests hold and a maintainer may want to know."""
    known, (arrows, _) = modules(root), plan(root)
    students = {name: path for name, path in known.items() if not name.startswith(f"labkit.{WING}")}
    lines = {name: len(path.read_text(encoding="utf-8").splitlines()) for name, path in known.items()}
    functions = [(f"{name}.{f}", node) for name, path in known.items() for f, node in public(path)]
    every = [
        (name, node)
        for name, path in known.items()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef)
    ]
    shaped = aliases(root)
    return {
        "lines, students' side": sum(lines[name] for name in students),
        "lines, instructors' wing": sum(lines.values()) - sum(lines[name] for name in students),
        "rooms": len([room for room in arrows if "/" not in room]) + 1,
        "floors": 1 + max(floors(arrows).values()),
        "arrows that run back up": back(arrows),
        "modules over 250 lines": sorted(name for name, count in lines.items() if count > 250),
        "functions over 40 lines": sorted(f"{n}.{f.name}" for n, f in every if f.end_lineno - f.lineno + 1 > 40),
        "public functions": len(functions),
        "without types": sorted(name for name, node in functions if untyped(node)),
        "without a docstring": sorted(name for name, node in functions if not ast.get_docstring(node)),
        "arrays without a shape": sorted(name for name, node in functions if shapeless(node, shaped)),
    }


if __name__ == "__main__":
    for what, value in figures(Path(sys.argv[1]) if sys.argv[1:] else ROOT).items():
        print(f"{what}: {value if isinstance(value, int) else f'{len(value)}  ' + ', '.join(map(str, value[:12]))}")
