"""A student's first hour in a real browser: JupyterLab, an answer, a check, a slider."""

import os

import pytest

from browser import LAB1, LAB3, NoBrowser, Page, answers, cells, chromium, jupyterlab, put, put_filled

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def browser():
    try:
        with chromium() as one:
            yield one
    except NoBrowser as problem:
        if os.environ.get("LABKIT_REQUIRE_BROWSER") == "1":
            pytest.fail(str(problem))
        pytest.skip(str(problem))


@pytest.fixture(scope="module")
def server(browser):
    with jupyterlab() as running:
        yield running


def open_page(browser, server, path):
    page = Page(browser, server, path)
    yield page
    page.close()


def explore_id(lab):
    return next(id for id, source in cells(lab).items() if source.startswith("explore("))


def move_by_keyboard(page, id, presses=8):
    """Arrow keys on the first slider of a cell; the picture and the text before and after."""
    output = page.output(id)
    image, text = output.locator("img").first, output.locator(".widget-html").last
    before = image.get_attribute("src"), text.inner_text()
    output.locator(".noUi-handle").first.focus()
    for _ in range(presses):
        page.page.keyboard.press("ArrowRight")
    page.page.wait_for_function("([img, old]) => img.src !== old", arg=[image.element_handle(), before[0]])
    page.page.wait_for_function("([p, old]) => p.innerText !== old", arg=[text.element_handle(), before[1]])
    return before, (image.get_attribute("src"), text.inner_text())


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
        assert "RMSE" in before[1] and before != after
        assert page.output(explore).get_by_text("Error displaying widget").count() == 0
        assert page.output(explore).get_by_text("filter's").count() >= 2  # a visible label for each slider
        assert not [line for line in page.complaints if "widget" in line.lower()], page.complaints


def test_a_slider_follows_the_mouse_and_play_the_keyboard(browser, server):
    for page in open_page(browser, server, put_filled(server.root / "mouse", LAB1)):
        page.run_all()
        explore = explore_id(LAB1)
        page.wait_run(explore)
        output = page.output(explore)
        image, handle = output.locator("img").first, output.locator(".noUi-handle").first
        handle.scroll_into_view_if_needed()
        before, box = image.get_attribute("src"), handle.bounding_box()
        page.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.page.mouse.down()
        page.page.mouse.move(box["x"] + 60, box["y"] + 4, steps=5)
        page.page.mouse.up()
        page.page.wait_for_function("([img, old]) => img.src !== old", arg=[image.element_handle(), before])
        play = next(id for id, source in cells(LAB1).items() if source.startswith("play("))
        output = page.output(play)
        image = output.locator("img").first
        before = image.get_attribute("src")
        output.locator(".noUi-handle").first.focus()
        page.page.keyboard.press("ArrowRight")
        page.page.wait_for_function("([img, old]) => img.src !== old", arg=[image.element_handle(), before])
        output.get_by_text("step 1 of 160").wait_for()


def test_an_unfilled_lab_shows_the_sentence_in_place_of_the_picture(browser, server):
    for page in open_page(browser, server, put(server.root / "unfilled", LAB1)):
        explore = explore_id(LAB1)
        page.run("setup", "answer-kf", explore)
        alert = page.output(explore).get_by_role("alert")
        alert.wait_for()
        assert "still to be written" in alert.inner_text()
        assert page.output(explore).locator("img:visible").count() == 0


def test_the_settings_reach_jupyterlab(server):
    """Without them widget callbacks run on another thread, which matplotlib does not bear."""
    from urllib.request import urlopen

    settings = urlopen(f"{server.url}/lab/api/settings/@jupyterlab/apputils-extension:kernels-settings?token=lab")
    assert '"disabled"' in settings.read().decode().split('"commsOverSubshells"')[1][:400]
