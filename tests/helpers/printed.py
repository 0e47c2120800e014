"""What the cells of a solution print, also where numpy has to do without some of the processor's units.

`python printed.py NOTEBOOK` runs the cells without a kernel, which takes no picture and half of the time, and prints
JSON, {cell id: what it printed}. Cells whose output no test compares run only if those need what they define.
"""

import ast
import builtins
import io
import json
import os
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

import nbformat


def units():
    """What numpy uses of this processor beyond what it takes for granted, as NPY_DISABLE_CPU_FEATURES names it."""
    import numpy as np

    return np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])


def printed(notebook, without=()):
    """{cell id: text} of the cells of a notebook, run by numpy without these units of the processor."""
    env = {**os.environ, "NPY_DISABLE_CPU_FEATURES": " ".join(without), "PYTHONUTF8": "1"}
    done = subprocess.run(
        [sys.executable, __file__, notebook],
        env=env,
        cwd=notebook.parent,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def stored(notebook):
    """The same of what the notebook holds."""
    return {cell.id: "".join(map(_text, cell.outputs)).strip() for cell in _cells(notebook) if _compared(cell)}


def _cells(notebook):
    return [cell for cell in nbformat.read(notebook, as_version=4).cells if cell.cell_type == "code"]


def _compared(cell):
    return "nbval-ignore-output" not in cell.metadata.get("tags", [])


def _needed(cells):
    """Those that are compared, and others that alone define a name that these use."""
    trees = {cell.id: ast.parse(cell.source) for cell in cells}
    defined = {id: set(_defined(tree)) for id, tree in trees.items()}
    compared = [cell.id for cell in cells if _compared(cell)]
    used = {node.id for id in compared for node in ast.walk(trees[id]) if isinstance(node, ast.Name)}
    missing = used.difference(dir(builtins), *(defined[id] for id in compared))
    return [cell for cell in cells if _compared(cell) or missing & defined[cell.id]]


def _defined(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.alias):
            yield node.asname or node.name


def _text(output):
    if output.output_type == "stream":
        return output.text if output.name == "stdout" else ""
    return output.data["text/plain"] if output.output_type == "execute_result" else ""


def _run(notebook):
    import IPython.display
    import matplotlib.pyplot as plt

    plt.switch_backend("Agg")
    plt.show = lambda: plt.close("all")
    IPython.display.display = lambda *shown, **more: None
    texts, names = {}, {"__name__": "__main__"}
    for cell in _needed(_cells(notebook)):
        out = io.StringIO()
        with redirect_stdout(out):
            _cell(cell.source, names)
        if _compared(cell):
            texts[cell.id] = out.getvalue().strip()
    return texts


def _cell(source, names):
    """Run a cell, and print its last value as a notebook shows it."""
    tree = ast.parse(source)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "<cell>", "exec"), names)
    value = last and eval(compile(ast.Expression(last.value), "<cell>", "eval"), names)
    if value is not None:
        print(value._repr_mimebundle_()["text/plain"] if hasattr(value, "_repr_mimebundle_") else repr(value))


if __name__ == "__main__":
    print(json.dumps(_run(Path(sys.argv[1]))))
