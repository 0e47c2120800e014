"""What a cell's text means in Jupyter: Python, with IPython's own reading of magics, `!` and `?`."""

import ast
import re

# Cell and line magics that run what follows among the notebook's names. Other cells' bodies are no Python or leave no
# names.
TRANSPARENT = {"time", "capture", "prun"}
FILES = {"writefile", "file"}
WRITE = "__labkit_write__"


def python(source: str) -> str:
    """The text of a cell as Python, its lines where they were (but for those that a backslash joins after a `!`).

    A cell that writes a file with `%%writefile` becomes one call, WRITE(name, content, append).
    """
    try:
        ast.parse(source)
        return source
    except (SyntaxError, ValueError):
        pass  # it may be more than Python
    text = re.sub(r"^(?:[ \t]*\n)+", "", source)
    above = "\n" * source[: len(source) - len(text)].count("\n")
    head, _, body = text.partition("\n")
    magic = re.match(r"\s*%%(\w+)\s*(.*)", head)
    if not magic:
        return above + _transformed(source)
    name, rest = magic[1], magic[2].split()
    if name in FILES:
        names = [word.strip("\"'") for word in rest if not word.startswith("-")]
        return f"{above}{WRITE}({' '.join(names)!r}, {body!r}, {bool(names) and names != rest})"
    return f"{above}\n{python(body)}" if name in TRANSPARENT else ""


def _transformed(source):
    from IPython.core.inputtransformer2 import TransformerManager  # slow to load, and few cells need it

    return TransformerManager().transform_cell(source)


def statements(code: str, filename: str) -> list[ast.stmt]:
    """The statements at the top of `code`, as `python` gives it; raises SyntaxError or ValueError."""
    return [_without_magic(node, filename) for node in ast.parse(code, filename).body]


def _without_magic(node, filename):
    """`%time x = f()` as the statement that it runs."""
    call = node.value if isinstance(node, ast.Expr) else None
    if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute) and call.func.attr == "run_line_magic":
        name, line = (part.value if isinstance(part, ast.Constant) else "" for part in call.args[:2])
        try:
            inner = ast.parse(line, filename).body if name in TRANSPARENT else []
        except (SyntaxError, ValueError):
            inner = []
        if len(inner) == 1:
            return ast.increment_lineno(inner[0], node.lineno - 1)
    return node
