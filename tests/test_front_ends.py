"""A slider and the animation of lab 1 in each front end, in a real browser: the wheel, and a front end beside it."""

import os
import signal
import socket
import subprocess
import time
import urllib.error
import urllib.request
from contextlib import suppress

import nbformat
import pytest

from helpers.browser import LAB1, PATIENCE, PIXELS, answers, put_filled
from helpers.environments import Environment, build, clean
from helpers.reference import by_itself, ci_only

pytestmark = [ci_only, by_itself, pytest.mark.browser]

KINDS = {  # what is started, and where the notebook then is
    "jupyter-lab": "lab/tree/short.ipynb",
    "jupyter-notebook": "notebooks/short.ipynb",
    "jupyter-nbclassic": "nbclassic/notebooks/short.ipynb",
    "voila": "voila/render/short.ipynb",
}
STARTED = (
    "[...document.querySelectorAll('.jp-InputPrompt, .input_prompt')].some(prompt => /[\\d*]/.test(prompt.textContent))"
)


@pytest.fixture(scope="module")
def front(browser, tmp_path_factory):
    wheel = next(build(tmp_path_factory.mktemp("dist")).glob("*.whl"))
    made = Environment(tmp_path_factory.mktemp("front ends") / "env", f"{wheel}[lab]", "notebook", "nbclassic", "voila")
    # Without the course's settings callbacks come on threads of their own, as on a hub that has none.
    (made.folder / "share/jupyter/lab/settings/overrides.json").unlink()
    return made


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """What an animation and sliders need of lab 1, filled in."""
    home = tmp_path_factory.mktemp("my course")
    path = put_filled(home, LAB1)
    book, needed = nbformat.read(path, as_version=4), ("kit", "setup", *answers(LAB1))
    starts = ("Q = ", "log = ", "play(", "explore(")
    book.cells = [cell for cell in book.cells if cell.id in needed or cell.source.startswith(starts)]
    nbformat.write(book, home / "short.ipynb")
    path.unlink()
    return home


@pytest.fixture
def server(front, folder, kind, tmp_path):
    """The address of a running front end."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    own = {f"JUPYTER_{kind}_DIR": str(tmp_path / kind) for kind in ("CONFIG", "DATA", "RUNTIME")}
    more = [str(folder)] if kind == "voila" else ["--allow-root", "--ServerApp.root_dir=.", "--IdentityProvider.token="]
    command = [str(front.programs / kind), "--no-browser", f"--port={port}", *more]
    path = f"{front.programs}{os.pathsep}{os.environ['PATH']}"
    with open(tmp_path / "log", "wb") as log:
        options = {"stdin": subprocess.DEVNULL, "stdout": log, "stderr": log, "start_new_session": True}
        process = subprocess.Popen(command, cwd=folder, env=clean(PATH=path, **own), **options)
        try:
            wait(f"http://127.0.0.1:{port}/", process)
            yield f"http://127.0.0.1:{port}"
        finally:
            os.killpg(process.pid, signal.SIGKILL)  # with its kernels
            process.wait()


def wait(address, process):
    """Return when it answers, with whatever."""
    while process.poll() is None:
        try:
            return urllib.request.urlopen(address, timeout=60).close()
        except urllib.error.HTTPError:
            return None
        except OSError:
            time.sleep(0.1)
    raise RuntimeError("it has ended")


def run_all(page, kind, again=False):
    """Run all cells; voila does so by itself."""
    from playwright.sync_api import TimeoutError

    if kind == "jupyter-nbclassic":  # what runs before its part for widgets is there shows pictures and no sliders
        page.wait_for_function("window.Jupyter?.notebook?.kernel?.widget_manager")
    while kind != "voila" and (again or not page.evaluate(STARTED)):  # a page that has no kernel yet runs nothing
        again = False
        if kind == "jupyter-nbclassic":
            page.evaluate("window.Jupyter?.notebook?.execute_all_cells()")
        else:
            with suppress(TimeoutError):  # a menu that closes while the page is still being put together
                page.keyboard.press("Escape")
                page.get_by_role("menuitem", name="Run", exact=True).click(timeout=20_000)
                page.get_by_role("menuitem", name="Run All Cells", exact=True).click(timeout=20_000)
        page.wait_for_timeout(4000)


def slider_of(page, kind):
    """The slider, once it is there. On a busy machine a page may lose what a kernel says while it starts."""
    from playwright.sync_api import TimeoutError

    slider, end = page.get_by_role("slider", name="filter's Q"), time.monotonic() + PATIENCE
    run_all(page, kind)
    while True:
        try:
            slider.wait_for(timeout=100_000)
            return slider
        except TimeoutError:
            if time.monotonic() > end:
                raise
            page.reload()
            run_all(page, kind, again=True)


@pytest.mark.parametrize("kind", KINDS)
def test_a_slider_and_the_animation_run_by_keyboard(browser, server, kind):
    page = browser.new_page(viewport={"width": 1280, "height": 1000})
    page.set_default_timeout(PATIENCE * 1000)
    page.goto(f"{server}/{KINDS[kind]}")
    slider = slider_of(page, kind)
    image = page.locator("img.widget-image").last
    page.wait_for_function(f"async image => await ({PIXELS})(image)", arg=image.element_handle())
    before = image.evaluate(f"image => ({PIXELS})(image)")
    slider.press("ArrowRight")
    page.wait_for_function(
        f"async ([image, old]) => {{ const now = await ({PIXELS})(image); return now && now !== old }}",
        arg=[image.element_handle(), before],
    )
    page.get_by_role("button", name="Play or pause").press("Enter")
    page.get_by_text("step 0 of 160").wait_for(state="detached")
    page.close()
