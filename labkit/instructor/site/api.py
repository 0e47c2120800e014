"""The reference: a page for each package of labkit that labs import from, filled by Sphinx from the docstrings."""

import ast
import inspect
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

# Packages and modules that a lab's author or a student has use for; the checks' inside is for maintainers.
ROOMS = {
    "labkit": "*.py",
    "labkit.plots": "plots/*.py",
    "labkit.widgets": "widgets/*.py",
    "labkit.legged": "legged/*.py",
    "labkit.team": "team/*.py",
    "labkit.mrclam": "mrclam/*.py",
    "labkit.recorded": "recorded/*.py",
    "labkit.checks": "checks/__init__.py",
    "labkit.guesses": "guesses/__init__.py",
    "labkit.notebook": "notebook/answers.py",
}
_NAMED = re.compile(r"\*{0,2}\w+(, \w+)*: ")
INSIDE = ("cli.py", "__main__.py", "kinds.py")


def pages(labkit: Path) -> dict[str, str]:
    """{path of a page: its Markdown}, from the modules in the folder labkit."""
    return {f"api/{room}.md": _page(labkit, room, pattern) for room, pattern in ROOMS.items()}


def _page(labkit, room, pattern):
    parts = [f"# `{room}`"]
    for path in sorted(labkit.glob(pattern), key=lambda path: (path.name != "__init__.py", path.name)):
        if path.name in INSIDE or not ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))):
            continue
        dotted = ".".join(["labkit", *path.relative_to(labkit).with_suffix("").parts]).removesuffix(".__init__")
        if dotted != room:
            parts.append(f"## `{dotted}`")
        parts.append(f"```{{eval-rst}}\n.. automodule:: {dotted}\n   :members:\n```")
    return "\n\n".join(parts) + "\n"


def readable(app: Any, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Turn a docstring, which is plain text, into what Sphinx reads, in place. Called by autodoc for each."""
    text = "\n".join(lines).strip()
    lines[:] = [line for part in re.split(r"\n\s*\n", text) for line in [*_paragraph(part.splitlines()), ""]]


def signature(app: Any, what: str, name: str, thing: Any, options: object, args: str, returns: str) -> Any:
    """(parameters, result) as they are written in the code, where types have names. Called by autodoc for each."""
    if not args or what not in ("class", "function", "method"):
        return None
    try:
        made = thing.__init__ if what == "class" else inspect.unwrap(thing)
        node = ast.parse(textwrap.dedent(inspect.getsource(made))).body[0]
    except (OSError, TypeError, AttributeError, IndentationError):
        node = None
    if not isinstance(node, ast.FunctionDef):  # a dataclass's is written nowhere
        return args.replace("ndarray[tuple[Any, ...], dtype[float64]]", "NDArray"), returns
    static = any(getattr(one, "id", "") == "staticmethod" for one in node.decorator_list)
    if what in ("class", "method") and not static:
        del (node.args.posonlyargs or node.args.args)[:1]
    return f"({ast.unparse(node.args)})", ast.unparse(node.returns) if node.returns and what != "class" else None


def _paragraph(lines: list[str]) -> Iterator[str]:
    """A paragraph of a docstring; one that explains names, or is laid out in lines, keeps its lines."""
    if all(line.startswith("    ") for line in lines):
        yield from ["::", "", *lines]
    elif any(line[0] == " " for line in lines) or sum(bool(_NAMED.match(line)) for line in lines) > 1:
        joined = re.sub(r"\n\s+", " ", "\n".join(line.rstrip() for line in lines))
        yield from (f"| {_plain(re.sub(' {2,}', '  ', line))}" for line in joined.splitlines())
    else:
        yield from map(_plain, lines)


def _plain(line):
    """A line in which only `code` means anything."""
    pieces = re.split(r"(`[^`]+`)", line)
    return "".join(f"`{p}`" if n % 2 else re.sub(r"([\\*|_`])", r"\\\1", p) for n, p in enumerate(pieces))
