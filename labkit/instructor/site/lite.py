"""JupyterLite: the students' kit in a browser, by way of Pyodide, with nothing installed.

Pyodide itself (cdn.jsdelivr.net), ipywidgets and filterpy (from the Python package index) come from the web when a lab
is opened. Without it the tests see that all is built and opens, up to the kernel's start, and that labs need nothing
that Pyodide lacks. With Pyodide 314.0.6, which its package for Node.js brings without NumPy, the kernel has started,
installed the kit and shown a slider. That a whole lab runs there has not been seen.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from ..authoring.release import release
from ..records import CommandError
from ..trouble import why

ABSENT = ("psutil",)  # only the command line needs it
INSTALL = "%pip install -q robot-localization-labkit"
FIRST: dict[str, Any] = {
    "cell_type": "code",
    "execution_count": None,
    "id": "lite",
    "metadata": {},
    "outputs": [],
    "source": f"# In the browser: gets the kit, once for each start of the kernel; it takes a minute.\n{INSTALL}",
}


def python() -> str:
    """The Python that has jupyterlite, which LABKIT_LITE names: in the kit's own it would disturb JupyterLab."""
    return os.environ.get("LABKIT_LITE") or sys.executable


def build(root: Path, out: Path, scratch: Path) -> None:
    """Make JupyterLite with the students' kit of the project in `root` in `out`. Raises CommandError and OSError.

    scratch: a folder for what is needed on the way.
    """
    kit, wheels, contents = scratch / "kit", scratch / "wheels", scratch / "contents"
    release(root, kit)
    pin(kit / "pyproject.toml")
    _run([python(), "-m", "hatchling", "build", "-t", "wheel", "-d", str(wheels)], kit)
    shutil.copytree(kit / "notebooks", contents / "notebooks")
    for path in sorted(contents.glob("notebooks/*.ipynb")):
        notebook = json.loads(path.read_text(encoding="utf-8"))
        notebook["cells"].insert(0, FIRST)
        path.write_text(json.dumps(notebook, indent=1, ensure_ascii=False), encoding="utf-8")
    line = [python(), "-m", "jupyter", "lite", "build", "--apps", "lab", "--no-sourcemaps"]
    line += ["--no-unused-shared-packages", "--contents", str(contents), "--output-dir", str(out)]
    _run([*line, "--piplite-wheels", str(next(wheels.iterdir()))], scratch)


def pin(project: Path) -> None:
    """Leave out of a pyproject.toml what the browser has no use for, so that nothing asks for it there."""
    text = project.read_text(encoding="utf-8")
    project.write_text(re.sub(rf'(?m)^ *"({"|".join(ABSENT)})\b.*\n', "", text), encoding="utf-8")


def _run(line, folder):
    try:
        done = subprocess.run(line, cwd=folder, capture_output=True, text=True, check=False)
    except OSError as error:
        raise CommandError(f"{line[0]}, which LABKIT_LITE names, cannot be run: {why(error)}.") from None
    if done.returncode:
        told = "\n".join((done.stdout + done.stderr).strip().splitlines()[-8:])
        raise CommandError(f"`{' '.join(line[1:5])} ...` stopped:\n{told}")
