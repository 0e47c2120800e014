"""Take the README's pictures, the first three in a real browser: `python tests/helpers/pictures.py`.

The real robot's picture needs the data set (see docs/students.md).
"""

import base64
import io
import json
import sys
import tempfile
from pathlib import Path

from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1]))

from helpers.browser import LAB1, LAB3, ROOT, Page, answers, cells, chromium, jupyterlab, put_filled
from helpers.marking import graded, marking

PICTURES = ROOT / "docs" / "pictures"
WRONG = ("H = np.tile(-np.eye(2), (p, 1))", "H = np.tile(np.eye(2), (p, 1))")


def show_cell(lab, start):
    return next(id for id, source in cells(lab).items() if start in source and not id.startswith("answer"))


def shot(locator, name):
    PICTURES.mkdir(parents=True, exist_ok=True)
    path = PICTURES / f"{name}.png"
    locator.screenshot(path=path)
    save(Image.open(path), name)


def save(image, name):
    # 32 levels a colour hide the grain of the JPEG inside, and halve the file.
    image = image.convert("RGB").point(lambda v: min(255, (v + 4) // 8 * 8))
    image.save(PICTURES / f"{name}.png", optimize=True)


def still(lab, start, name):
    """The picture that a cell of an executed solution shows."""
    book = json.loads((ROOT / "solutions" / f"{lab}.ipynb").read_text(encoding="utf-8"))
    cell = next(c for c in book["cells"] if c["cell_type"] == "code" and start in "".join(c["source"]))
    data = next(out["data"]["image/png"] for out in cell["outputs"] if "image/png" in out.get("data", {}))
    save(Image.open(io.BytesIO(base64.b64decode(data))), name)


def take(browser, server):
    page = Page(browser, server, put_filled(server.root, LAB1), height=1600)
    explore = show_cell(LAB1, "explore(KF")
    page.run("setup", "answer-stack", "answer-repeat", "answer-kf", explore)
    page.output(explore).locator("img").first.wait_for()
    handle = page.output(explore).locator(".noUi-handle").nth(1)
    handle.focus()
    for _ in range(8):
        page.page.keyboard.press("ArrowRight")
    page.output(explore).get_by_text("6.31").first.wait_for()
    page.page.wait_for_timeout(1000)  # the last picture of the drag
    shot(page.output(explore), "lab1-explore")
    page.fill("answer-kf", answers(LAB1)["answer-kf"].replace(*WRONG))
    page.run("answer-kf", "check-kf")
    page.cell("check-kf").locator(".jp-OutputArea-output").first.wait_for()
    shot(page.cell("check-kf"), "lab1-check")
    page.close()

    page = Page(browser, server, put_filled(server.root, LAB3), height=1600)
    real = show_cell(LAB3, "mrclam.load(robot=1)")
    page.run("setup", "answer-h", "answer-jacobian", "answer-kf", real)
    picture = page.output(real).locator("img").first
    picture.wait_for()
    shot(picture, "lab3-real-robot")
    page.close()


def take_marking(browser):
    """The page of `labkit mark`, with two answers that are the same and one that nearly is."""
    said = (
        "The truth is inside from the first step on, since $P_0 = 3\\,I$ makes the ellipse large. But **that is not "
        "enough**: {} that is far too large would hold it too, so it must also be small.\n\n"
        "| step | half axis |\n|---|--:|\n| 1 | 1.7 m |\n| 50 | 0.3 m |"
    )
    texts = [said.format("an ellipse"), said.format("an ellipse"), said.format("a region")]
    students = dict(zip(("Ada Lovelace", "Alan Turing", "Grace Hopper"), texts))
    with tempfile.TemporaryDirectory() as folder:
        out = graded(Path(folder) / "out", {**students, "Emmy Noether": "Since it begins so large."})
        with marking(out) as server:
            page = browser.new_page(viewport={"width": 1240, "height": 860})
            page.goto(f"{server.address}Noor/")
            page.locator(".questions a").first.click()
            for keys in ("n", "1", "c", "Say why it has to be small.", "Control+Enter", "1", "2"):
                page.locator("#give").wait_for()
                page.keyboard.insert_text(keys) if " " in keys else page.keyboard.press(keys)
                page.wait_for_timeout(500)
            shot(page, "marking")


if __name__ == "__main__":
    still("05_fuzzy_hybrid", "explore(", "lab5-explore")
    still("07_formation", "draw_formation(", "lab7-formation")
    with chromium() as one, jupyterlab() as running:
        take_marking(one)
        take(one, running)
