"""`labkit site`: pages are written as Markdown into a temporary folder, and Sphinx makes the site of them."""

import importlib.util
import shutil
import sys
from pathlib import Path

from ..authoring.release import ROOT
from ..folders import temporary
from ..records import CommandError
from ..trouble import ended

NEEDS = {
    "site": ("sphinx", "myst_parser", "furo", "ziamath"),
    "lite": ("jupyterlite_core", "jupyterlite_pyodide_kernel", "hatchling"),
}
APART = (
    "They want an environment of their own, since in the kit's they would disturb JupyterLab: `python3 -m venv lite`, "
    "`lite/bin/python -m pip install jupyterlab jupyterlite-core jupyterlite-pyodide-kernel hatchling`; then let the "
    "variable LABKIT_LITE name that Python, by its whole path."
)
UNTRIED = """\
In OUT/lite are the labs in JupyterLab without a server: publish the folder, or serve it with
`python3 -m http.server`. Their Python comes from cdn.jsdelivr.net (Pyodide) and the Python package index, so whoever
opens one needs the internet. It was tried up to where NumPy comes in: try one lab before a class does.\
"""


def main(out: str, lite: bool = False) -> int:
    """Make the site in a new folder; returns the exit status.

    lite: whether the students' kit comes with it as JupyterLite.
    """
    print("Pages, pictures and reference are made: it may take a minute.", flush=True)
    try:
        if status := ended("labkit site", lambda: site(ROOT, Path(out), lite)):
            return status
    except KeyboardInterrupt:
        left = f"A part of it is in {out}: remove that." if Path(out).exists() else "Nothing was written."
        print(f"\nStopped. {left}", file=sys.stderr)
        return 130
    print(f"{out}: open index.html; its pages need no server and ask nothing of the internet.")
    if lite:
        print(UNTRIED.replace("OUT", out))
    return 0


def site(root: Path, out: Path, lite: bool = False) -> None:
    """Make the site of the project in `root` in the folder `out`, new or empty. Raises CommandError and OSError."""
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise CommandError(f"{out} is there already: name a new folder. Nothing is deleted.")
    _need("site", "In the folder of the full kit, `pip install '.[site]'` gets it.")
    from . import lite as browser, pages, sphinx

    if lite and browser.python() == sys.executable:
        _need("lite", APART)
    with temporary("site") as scratch:
        written, made = Path(scratch) / "pages", Path(scratch) / "site"
        pages.write(root, written, lite)
        sphinx.build(written, made)
        if lite:
            browser.build(root, made / "lite", Path(scratch))
        out.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(made, out, dirs_exist_ok=True)


def _need(extra, cure):
    missing = [name for name in NEEDS[extra] if not importlib.util.find_spec(name)]
    if missing:
        raise CommandError(f"{', '.join(missing)} cannot be found. {cure}")
