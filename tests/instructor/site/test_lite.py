"""The students' kit in a browser: what labs import must be there, and nothing may need threads or processes."""

import functools
import http.server
import os
import subprocess
import sys
import threading
from urllib.parse import urlparse

import pytest

from labkit.instructor.site import lite

from helpers.browser import chromium
from helpers.reference import COURSE, ROOT, ci_only

# A Python that has what Pyodide's has: of others only its own list (numpy, scipy, matplotlib and their needs),
# what JupyterLite's kernel brings (IPython, comm and theirs), and the wheels that the site has with labkit's.
PYODIDE = """
import sys
GONE = {"curses", "dbm", "ensurepip", "fcntl", "grp", "idlelib", "lib2to3", "msvcrt", "pwd", "resource", "syslog",
        "termios", "tkinter", "turtle", "venv", "winreg", "winsound", "_winapi", "pty", "tty"}
THERE = set(sys.stdlib_module_names) - GONE | set('''
    numpy scipy matplotlib mpl_toolkits pylab PIL contourpy cycler dateutil fontTools kiwisolver packaging pyparsing six
    IPython asttokens comm decorator executing jedi matplotlib_inline parso prompt_toolkit pure_eval pygments stack_data
    traitlets wcwidth ipywidgets widgetsnbextension jupyterlab_widgets filterpy labkit __main__'''.split())

from importlib.machinery import PathFinder
find = PathFinder.find_spec

def found(name, path=None, target=None):
    there = name.partition(".")[0] in THERE or name.startswith("_sysconfigdata")
    return find(name, path, target) if there else None

PathFinder.find_spec = staticmethod(found)
import socket, subprocess, threading
import matplotlib.font_manager  # it has a thread watch over its first list of fonts, which Pyodide brings

def cannot(*args, **kwargs):
    raise RuntimeError("can't start new thread")

threading.Thread.start = subprocess.Popen.__init__ = socket.socket.__init__ = cannot
import json, matplotlib
matplotlib.use("Agg")
names = {"__name__": "__main__"}
for cell in json.load(open(sys.argv[1], encoding="utf-8"))["cells"]:
    tags = cell["metadata"].get("tags", [])
    if cell["cell_type"] == "code" and "hidden" not in tags and (sys.argv[2] == "all" or "setup" in tags):
        exec(compile("".join(cell["source"]), cell["id"], "exec"), names)
        matplotlib.pyplot.close("all") if "matplotlib.pyplot" in sys.modules else None
print("done", sorted(sys.modules.keys() & {"psutil", "jupyterlab", "nbformat", "tornado", "zmq"}))
"""


def _in_the_browser(lab, which):
    folder = ROOT / "solutions"
    line = [sys.executable, "-c", PYODIDE, f"{lab}.ipynb", which]
    done = subprocess.run(line, cwd=folder, capture_output=True, text=True, check=False)
    assert done.stdout.endswith("done []\n"), done.stderr[-3000:]


def test_the_setup_cell_of_a_lab_needs_nothing_that_pyodide_lacks():
    _in_the_browser("03_range_bearing_ekf", "setup")


@ci_only
@pytest.mark.slow
@pytest.mark.parametrize("lab", COURSE)
def test_a_whole_lab_needs_nothing_that_pyodide_lacks(lab):
    _in_the_browser(lab, "all")


@ci_only
@pytest.mark.slow
@pytest.mark.browser
def test_it_is_built_and_opens_up_to_the_kernels_start(tmp_path):
    """What is asked of the web, which is refused here, is Pyodide and nothing else."""
    if not os.environ.get("LABKIT_LITE"):
        pytest.importorskip("jupyterlite_pyodide_kernel")
    lite.build(ROOT, tmp_path / "lite", tmp_path)
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=tmp_path)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server, chromium() as browser:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        here = f"http://127.0.0.1:{server.server_port}/"
        page, away = browser.new_page(), []
        page.context.route(lambda url: not url.startswith((here, "data:", "blob:")), lambda route: route.abort())
        page.context.on("request", lambda request: away.append(request.url) if here not in request.url else None)
        with page.context.expect_event(
            "request", lambda r: "/pyodide/" in r.url and here not in r.url, timeout=600_000
        ):
            page.goto(f"{here}lite/lab/index.html?path=notebooks/01_cartesian_ekf.ipynb")
        page.wait_for_selector(".jp-Notebook .jp-Cell:has-text('Where is the robot?')", timeout=600_000)
        server.shutdown()
    assert {urlparse(url).netloc for url in away if url.startswith("http")} == {"cdn.jsdelivr.net"}


def test_the_browsers_wheel_asks_for_nothing_that_is_not_there(tmp_path):
    project = tmp_path / "pyproject.toml"
    project.write_text((ROOT / "pyproject.toml").read_text(encoding="utf-8"), encoding="utf-8")
    lite.pin(project)
    import tomllib

    needs = tomllib.loads(project.read_text(encoding="utf-8"))["project"]["dependencies"]
    assert sorted(needs) == ["filterpy", "ipywidgets>=7.7", "matplotlib", "numpy", "scipy"]
