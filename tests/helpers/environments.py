"""Virtual environments with the kit from its wheel, as those have it who do without lab.py; for tests under CI."""

import json
import os
import subprocess
import sys

import nbformat
from jupyter_client.kernelspec import KernelSpecManager
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient

from helpers.reference import ROOT

FOREIGN = ("PYTHONPATH", "VIRTUAL_ENV", "LABKIT_DATA", "LABKIT_FROM", "MPLBACKEND", "IPYTHONDIR")


def clean(**more):
    """The variables of a machine that knows nothing of this project."""
    return {name: value for name, value in os.environ.items() if name not in FOREIGN} | more


def run(*command, cwd=None):
    """What a command prints; it has to succeed."""
    words = list(map(str, command))
    done = subprocess.run(words, cwd=cwd, env=clean(), capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


class Environment:
    """A virtual environment with some packages, and kernels in it; its folder should have a space in its name."""

    def __init__(self, folder, *packages):
        run(sys.executable, "-m", "venv", folder)
        self.folder = folder
        self.programs = folder / ("Scripts" if os.name == "nt" else "bin")
        self.python = self.programs / "python"
        run(self.python, "-m", "pip", "install", "-q", *packages)
        spec = folder / "kernels" / "bare"
        spec.mkdir(parents=True)
        argv = [str(self.python), "-m", "ipykernel_launcher", "-f", "{connection_file}"]
        (spec / "kernel.json").write_text(json.dumps({"argv": argv, "display_name": "bare"}))
        self.specs = KernelSpecManager(kernel_dirs=[str(spec.parent)], ensure_native_kernel=False)

    def execute(self, path, wanted=lambda cell: True, first=(), **variables):
        """{id: what it printed and shows} of the cells that are wanted, run in the notebook's own folder."""
        book = nbformat.read(path, as_version=4)
        book.cells = [*map(nbformat.v4.new_code_cell, first), *(cell for cell in book.cells if wanted(cell))]
        manager = AsyncKernelManager(kernel_name="bare", kernel_spec_manager=self.specs)
        client = NotebookClient(book, km=manager, timeout=600, resources={"metadata": {"path": str(path.parent)}})
        client.owns_km = True  # so that the kernel ends with it
        client.execute(env=clean(**variables), stderr=subprocess.DEVNULL)
        return {cell.id: repr(cell.get("outputs")) for cell in book.cells}


def build(folder):
    """Wheel and source distribution of the project as it is, in a folder of this one."""
    tools = Environment(folder / "tools", "hatchling")
    run(tools.python, "-m", "hatchling", "build", "-d", folder / "made", cwd=ROOT)
    return folder / "made"
