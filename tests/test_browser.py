"""A student's first hour in a real browser: JupyterLab, an answer, a check, a slider."""

import nbformat
import pytest

from helpers.browser import LAB1, LAB3, Page, answers, cells, jupyterlab, put, put_filled
from helpers.reference import LABS, ROOT, by_itself

pytestmark = [by_itself, pytest.mark.browser]

# Letters and their ground differ by at least this ratio of luminance (WCAG 2, level AA).
READABLE = 4.5
CONTRAST = """element => {
  const parts = colour => colour.match(/[\\d.]+/g).map(Number);
  const light = colour => parts(colour).slice(0, 3)
    .map(v => v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  let ground = element;
  while (parts(getComputedStyle(ground).backgroundColor)[3] === 0) ground = ground.parentElement;
  const [a, b] = [getComputedStyle(element).color, getComputedStyle(ground).backgroundColor].map(light);
  return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
}"""

# What is wider than its place, and so cut off or with a scroll bar: outputs, widgets and texts.
CRAMPED = """() => [...document.querySelectorAll(
    '.jp-OutputArea-output, .jp-OutputArea-output pre, .widget-box, .jp-RenderedMarkdown')]
  .filter(e => e.clientWidth && e.scrollWidth > e.clientWidth + 1)
  .concat([...document.querySelectorAll('.jp-mod-outputsScrolled')])
  .map(e => `${e.scrollWidth} > ${e.clientWidth}: ${e.textContent.trim().slice(0, 80)}`)"""


@pytest.fixture(scope="module")
def server(browser, tmp_path_factory):
    """In the dark theme, where colours that cannot be read would show; without the big data set."""
    with jupyterlab(theme="Dark", LABKIT_DATA=str(tmp_path_factory.mktemp("no data"))) as running:
        yield running


def open_page(browser, server, path):
    page = Page(browser, server, path)
    yield page
    page.close()


def explore_id(lab):
    return next(id for id, source in cells(lab).items() if source.startswith("explore("))


def assert_spoken(page):
    """What the kit puts on JupyterLab's page keeps nobody out, as far as axe can tell; the rest is JupyterLab's."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    found = axe.run(page.page, context=".jp-OutputArea-output .widget-vbox").response["violations"]
    assert [(one["id"], one["nodes"][0]["html"]) for one in found if one["impact"] in ("serious", "critical")] == []


def assert_sound(page):
    """All that ran can be seen: no broken widget or formula, no complaint, nothing cut off."""
    assert page.page.get_by_text("Error displaying widget").count() == 0
    assert page.page.locator("mjx-merror").count() == 0
    assert [line for line in page.complaints if "Failed to load resource" not in line] == []
    assert page.page.evaluate(CRAMPED) == []


def move_by_keyboard(page, id, presses=8):
    """Arrow keys on the first slider of a cell, there and back; the text before and in between."""
    output = page.output(id)
    image, text = output.locator("img").first, output.locator(".widget-html").last
    page.wait_pixels(image, "")
    pixels, words = page.pixels(image), text.inner_text()
    output.locator(".noUi-handle").first.focus()
    for _ in range(presses):
        page.page.keyboard.press("ArrowRight")
    page.wait_pixels(image, pixels)
    page.page.wait_for_function("([p, old]) => p.innerText !== old", arg=[text.element_handle(), words])
    moved = text.inner_text()
    for _ in range(presses):
        page.page.keyboard.press("ArrowLeft")
    page.wait_pixels(image, pixels, same=True)  # the run and its noise have stayed
    return words, moved


@pytest.mark.parametrize("lab", [LAB1, LAB3])
def test_a_student_fills_in_a_lab_and_moves_a_slider(browser, server, lab):
    folder = server.root / f"filled in {lab}"
    path = put(folder, lab)
    if lab == LAB3:
        put_filled(folder, LAB1)
    for page in open_page(browser, server, path):
        page.run("setup")
        explore = explore_id(lab)
        page.run(explore)
        page.output(explore).get_by_text("NameError").first.wait_for()
        for id, source in answers(lab).items():
            page.run(id)  # the stub as it is
            page.fill(id, source)
            page.run(id, id.replace("answer", "check"))
            page.output(id.replace("answer", "check")).get_by_text("checks passed").wait_for()
        page.run(explore)
        page.output(explore).locator("img").first.wait_for()
        before, after = move_by_keyboard(page, explore)
        assert "RMSE" in before and before != after
        assert page.output(explore).get_by_text("filter's").count() >= 2  # a visible label for each slider
        page.output(explore).get_by_role("slider", name="filter's Q").wait_for()  # and one that can be heard
        page.output(explore).get_by_role("img", name="Picture").wait_for()
        page.run_all()
        page.wait_run_all()
        assert_sound(page)


def test_a_slider_follows_the_mouse_and_play_the_keyboard(browser, server):
    for page in open_page(browser, server, put_filled(server.root / "mouse", LAB1)):
        world, run, explore, play = (
            next(id for id, source in cells(LAB1).items() if source.startswith(start))
            for start in ("Q = ", "log = ", "explore(", "play(")
        )
        page.run("setup", *answers(LAB1), world, run, play, explore)
        output = page.output(explore)
        image, handle = output.locator("img").first, output.locator(".noUi-handle").first
        handle.scroll_into_view_if_needed()
        before, box = page.pixels(image), handle.bounding_box()
        page.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.page.mouse.down()
        page.page.mouse.move(box["x"] + 60, box["y"] + 4, steps=5)
        page.page.mouse.up()
        page.wait_pixels(image, before)
        output = page.output(play)
        image = output.locator("img").first
        before = page.pixels(image)
        output.locator(".noUi-handle").first.focus()
        page.page.keyboard.press("ArrowRight")
        page.wait_pixels(image, before)
        output.get_by_text("step 1 of 160").wait_for()
        output.get_by_role("slider", name="frame").wait_for()
        output.get_by_role("button", name="Play or pause").press("Enter")
        output.get_by_text("step 1 of 160").wait_for(state="detached")
        assert_spoken(page)


def test_an_unfilled_lab_shows_the_sentence_in_place_of_the_picture(browser, server):
    for page in open_page(browser, server, put(server.root / "unfilled", LAB1)):
        explore = explore_id(LAB1)
        page.run("setup", "answer-kf", explore)
        alert = page.output(explore).get_by_role("alert")
        alert.wait_for()
        assert "still to be written" in alert.inner_text()
        assert alert.evaluate(CONTRAST) > READABLE
        assert page.output(explore).locator("img:visible").count() == 0


def test_no_text_of_any_lab_is_wider_than_its_place(browser, server):
    """Formulas above all: what is too long is cut off, behind a scroll bar that nobody looks for."""
    book = nbformat.v4.new_notebook()
    for lab in LABS:
        texts = (cell for cell in nbformat.read(ROOT / f"notebooks/{lab}.ipynb", 4).cells if cell.cell_type != "code")
        book.cells += [nbformat.v4.new_markdown_cell(f"{cell.source}\n\n({lab}, {cell.id})") for cell in texts]
    path = server.root / "all texts.ipynb"
    nbformat.write(book, path)
    page = browser.new_page(viewport={"width": 1280, "height": 1000})
    page.goto(f"{server.url}/lab/tree/all%20texts.ipynb?token=lab&reset")
    last = page.locator(".jp-Notebook .jp-Cell").nth(len(book.cells) - 1)
    last.wait_for(state="attached")
    last.scroll_into_view_if_needed()
    last.locator(".jp-RenderedMarkdown").get_by_text(LABS[-1]).wait_for()
    page.wait_for_function(
        "() => !document.querySelector('.MathJax_Preview') && document.querySelector('mjx-container')"
    )
    assert page.locator("mjx-merror").count() == 0
    assert page.evaluate(CRAMPED) == []
    page.close()


def test_the_settings_reach_jupyterlab(server):
    """Without them widget callbacks run on another thread, which matplotlib does not bear."""
    from urllib.request import urlopen

    settings = urlopen(f"{server.url}/lab/api/settings/@jupyterlab/apputils-extension:kernels-settings?token=lab")
    assert '"disabled"' in settings.read().decode().split('"commsOverSubshells"')[1][:400]
