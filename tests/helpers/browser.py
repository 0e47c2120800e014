"""JupyterLab on a scratch folder and a real browser in front of it, for tests and for pictures.

tests/helpers/pictures.py takes the pictures of the README with it.
The browser is the one that LABKIT_CHROMIUM names, or the first Chromium or Chrome found on PATH.
"""

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from labkit.instructor.handout.command import find
from labkit.instructor.records import CommandError

ROOT = Path(__file__).parents[2]
LAB1, LAB3 = "01_cartesian_ekf", "03_range_bearing_ekf"
PATIENCE = 600  # [s] for anything that JupyterLab or a kernel has to do: no limit, but an end of what never comes

# As root it needs --no-sandbox; the others keep it from talking to the network on its own.
CHROMIUM_OPTIONS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]


class NoBrowserError(Exception):
    """Why there is no browser to test with, in one sentence."""


def find_chromium():
    """The browser's path; raises NoBrowserError."""
    try:
        return find()
    except CommandError as problem:
        raise NoBrowserError(str(problem)) from None


@contextmanager
def chromium():
    """A Playwright browser; raises NoBrowserError where there is none."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        raise NoBrowserError("playwright is not installed: `python3 lab.py test` installs it") from None
    path = find_chromium()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=CHROMIUM_OPTIONS)
        try:
            yield browser
        finally:
            browser.close()


@pytest.fixture(scope="module")
def browser():
    """The browser for the tests of a module, which are skipped where there is none."""
    try:
        with chromium() as one:
            yield one
    except NoBrowserError as problem:
        if os.environ.get("LABKIT_REQUIRE_BROWSER") == "1":
            pytest.fail(str(problem))
        pytest.skip(str(problem))


# --- notebooks as files


def cells(name, folder="notebooks"):
    """{id: source} of a notebook of the project, in order."""
    content = json.loads((ROOT / folder / f"{name}.ipynb").read_text(encoding="utf-8"))
    return {cell["id"]: "".join(cell["source"]) for cell in content["cells"]}


def answers(name):
    """{id: source} of the answer cells of a solution that hold code, without the solution marks."""
    content = json.loads((ROOT / "solutions" / f"{name}.ipynb").read_text(encoding="utf-8"))
    return {
        cell["id"]: re.sub(r"(?m)^\s*### (BEGIN|END) SOLUTION\n?", "", "".join(cell["source"]))
        for cell in content["cells"]
        if cell["cell_type"] == "code" and cell["id"].startswith("answer")
    }


def put(folder, name, **filled):
    """Copy a student's notebook into a folder, with some answers (id with _ for -) filled in."""
    content = json.loads((ROOT / "notebooks" / f"{name}.ipynb").read_text(encoding="utf-8"))
    for cell in content["cells"]:
        cell["source"] = filled.get(cell["id"].replace("-", "_"), cell["source"])
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.ipynb"
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def put_filled(folder, name, **wrong):
    """The same with all answers right, but for those that are given."""
    right = {id.replace("-", "_"): source for id, source in answers(name).items()}
    return put(folder, name, **{**right, **wrong})


# --- the server


class Server:
    """JupyterLab in a folder of its own, which is also its root; with `labkit`'s settings."""

    def __init__(self, theme="Light", **variables):
        # A space in its name, since students have such folders.
        self.home = Path(tempfile.mkdtemp(prefix="robot lab "))
        self.root = self.home / "notebooks"
        self.root.mkdir()
        self._settings(theme)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.url = f"http://127.0.0.1:{free.getsockname()[1]}"
        own = {f"JUPYTER_{kind}_DIR": str(self.home / kind.lower()) for kind in ("CONFIG", "DATA", "RUNTIME")}
        own |= {f"JUPYTERLAB_{kind}_DIR": str(self.home / kind.lower()) for kind in ("SETTINGS", "WORKSPACES")}
        # The tests' own backend would leave plt.show without a picture.
        inherited = {name: value for name, value in os.environ.items() if name != "MPLBACKEND"}
        self.log = open(self.home / "log", "wb")  # noqa: SIM115 - closed by stop
        self.process = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "jupyterlab",
                "--no-browser",
                "--allow-root",
                "--ServerApp.root_dir=.",
                f"--port={self.url.rpartition(':')[2]}",
                "--ServerApp.port_retries=0",
                "--IdentityProvider.token=lab",
            ],
            cwd=self.root,
            stdin=subprocess.DEVNULL,
            stdout=self.log,
            stderr=self.log,
            env={**inherited, **own, "IPYTHONDIR": str(self.home / "ipython"), **variables},
            start_new_session=True,
        )

    def _settings(self, theme):
        """Put labkit's settings in front of what the environment has, which may be an older copy."""
        settings = json.loads((ROOT / "labkit/jupyter/overrides.json").read_text())
        settings["@jupyterlab/apputils-extension:themes"] = {"theme": f"JupyterLab {theme}"}
        folder = self.home / "config" / "labconfig"
        folder.mkdir(parents=True)
        (folder / "default_setting_overrides.json").write_text(json.dumps(settings))

    def wait(self):
        """Return when it answers."""
        end = time.monotonic() + PATIENCE
        while True:
            try:
                return urllib.request.urlopen(f"{self.url}/api?token=lab", timeout=60).close()
            except (urllib.error.URLError, OSError):
                if self.process.poll() is not None or time.monotonic() > end:
                    raise RuntimeError("JupyterLab did not start:\n" + self.told()) from None
                time.sleep(0.05)

    def told(self):
        return (self.home / "log").read_text(errors="replace")

    def stop(self):
        """End it, its kernels first, and delete its folder."""
        self.process.terminate()
        try:
            self.process.wait(15)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        if os.name != "nt":
            with suppress(ProcessLookupError):  # kernels that outlived it
                os.killpg(self.process.pid, signal.SIGKILL)
        self.log.close()
        shutil.rmtree(self.home, ignore_errors=True)


@contextmanager
def jupyterlab(**options):
    """A running Server, ended at the end whatever happens."""
    server = Server(**options)
    try:
        server.wait()
        yield server
    finally:
        server.stop()


# --- one notebook in the browser


class Page:
    """A notebook opened in JupyterLab, its cells found by their ids."""

    def __init__(self, browser, server, path, height=1000):
        self.ids = list(cells(path.stem))
        self.complaints = []  # what the browser's console says that is an error
        self.page = browser.new_page(viewport={"width": 1280, "height": height})
        self.page.set_default_timeout(PATIENCE * 1000)
        self.page.on("console", lambda m: self.complaints.append(m.text) if m.type == "error" else None)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        place = path.relative_to(server.root).as_posix()
        self.page.goto(f"{server.url}/lab/tree/{urllib.request.quote(place)}?token=lab&reset")
        self.page.locator(".jp-Notebook .jp-Cell").nth(len(self.ids) - 1).wait_for(state="attached")
        # Running a cell before the kernel answers would do nothing.
        self.page.locator(".jp-NotebookPanel-toolbar [data-status=idle]").wait_for(state="attached")

    def cell(self, id):
        return self.page.locator(".jp-Notebook .jp-Cell").nth(self.ids.index(id))

    def output(self, id):
        return self.cell(id).locator(".jp-OutputArea").first

    def fill(self, id, source):
        """Type a source over what stands in a cell."""
        editor = self.cell(id).locator(".cm-content")
        editor.scroll_into_view_if_needed()
        editor.click()
        self.page.keyboard.press("ControlOrMeta+A")
        self.page.keyboard.insert_text(source)

    def run(self, *ids):
        """Run cells one after the other, each until it is done."""
        for id in ids:
            was, end = self._prompt(id), time.monotonic() + PATIENCE
            while self._prompt(id) == was:  # an output that arrives moves the cells, and a click then misses
                assert time.monotonic() < end
                self.cell(id).locator(".cm-content").click()
                self.page.keyboard.press("Control+Enter")
                self._changes(id, was, seconds=4)
            while not self._has_run(id, seconds=60):  # what a page lost while its kernel started is run once more
                assert time.monotonic() < end
                self.cell(id).locator(".cm-content").click()
                self.page.keyboard.press("Control+Enter")

    def _prompt(self, id):
        return self.cell(id).locator(".jp-InputArea-prompt").inner_text()

    def _changes(self, id, was, seconds):
        """Return when the prompt of a cell has changed, or after a while."""
        end = time.monotonic() + seconds
        while self._prompt(id) == was and time.monotonic() < end:
            self.page.wait_for_timeout(20)

    def run_all(self):
        self.page.get_by_role("menuitem", name="Run", exact=True).click()
        self.page.get_by_role("menuitem", name="Run All Cells", exact=True).click()

    def _has_run(self, id, seconds):
        """Whether a cell's `[*]` has become a number within a while."""
        end = time.monotonic() + seconds
        while not any(map(str.isdigit, self._prompt(id))) and time.monotonic() < end:
            self.page.wait_for_timeout(20)
        return any(map(str.isdigit, self._prompt(id)))

    def wait_run(self, id):
        """Return when a cell has run."""
        assert self._has_run(id, PATIENCE)

    def wait_run_all(self):
        """Return when every cell has run."""
        self.page.wait_for_function(
            "() => [...document.querySelectorAll('.jp-CodeCell .jp-InputArea-prompt')]"
            ".every(prompt => /\\d/.test(prompt.textContent))"
        )

    def pixels(self, image):
        """What an <img> shows, as text: its address changes with each picture, this only with its look."""
        return image.evaluate(f"image => ({PIXELS})(image)")

    def wait_pixels(self, image, old, same=False):
        """Return when an <img> looks different from what it was (or the same again)."""
        self.page.wait_for_function(
            "async ([image, old, same]) => {"
            f" const now = await ({PIXELS})(image); return now && (now === old) === same }}",
            arg=[image.element_handle(), old, same],
        )

    def close(self):
        self.page.close()


# Nothing while the next picture is on its way: the address of the last one is then void.
PIXELS = """async image => {
  try {
    await image.decode();
    const bytes = await (await fetch(image.src)).arrayBuffer();
    return new TextDecoder('latin1').decode(bytes);
  } catch { return ''; }
}"""
