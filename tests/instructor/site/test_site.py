"""The whole site in a real browser: opened as files, it asks for nothing else, leads nowhere wrong, and is readable."""

import re
from urllib.parse import unquote, urldefrag, urlparse

import pytest

from labkit.instructor.site import command

from helpers.browser import chromium
from helpers.reference import ROOT, ci_only

for needed in ("sphinx", "myst_parser", "furo", "axe_playwright_python"):
    pytest.importorskip(needed)
pytestmark = [ci_only, pytest.mark.browser, pytest.mark.slow]

MOST, PHONE = 15_000_000, 390  # bytes of the site, pixels of a phone's width
SIZES = "Promise.all([...document.images].map(async i => [i.src, i.alt, await i.decode().then(() => i.naturalWidth)]))"
QUIET = {"preload": False}  # axe would ask for the style sheets once more, which no browser allows a file
SKIP = ("genindex.html", "search.html")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    out = tmp_path_factory.mktemp("a site") / "of the course"
    command.site(ROOT, out)
    return out


@pytest.fixture(scope="module")
def seen(site):
    """{page: what the browser found}, each page opened once on a desktop's screen and once on a phone's."""
    from axe_playwright_python.sync_playwright import Axe

    found = {}
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        asked, faults = [], []
        page.on("request", lambda request: asked.append(request.url))
        page.on("requestfailed", lambda request: faults.append(request.url))
        page.on("pageerror", lambda error: faults.append(str(error)))
        for path in sorted(site.rglob("*.html")):
            page.goto(path.as_uri())
            page.evaluate("document.querySelectorAll('details').forEach(part => part.open = true)")
            axe = [] if path.name in SKIP else Axe().run(page, options=QUIET).response["violations"]
            found[path] = {
                "axe": [v for v in axe if v["impact"] in ("serious", "critical")],
                "links": page.evaluate("[...document.links].map(link => link.href)"),
                "ids": page.evaluate("[...document.querySelectorAll('[id]')].map(part => part.id)"),
                "pictures": page.evaluate(SIZES),
                "formulas": page.evaluate(
                    "[...document.querySelectorAll('math')].map(m => m.getBoundingClientRect().width)"
                ),
                "typed": page.evaluate("document.querySelector('article')?.innerText ?? ''"),
            }
            page.set_viewport_size({"width": PHONE, "height": 800})
            found[path]["width"] = page.evaluate("document.documentElement.scrollWidth")
            page.set_viewport_size({"width": 1280, "height": 900})
    return found, asked, faults


def test_the_site_is_small_and_has_all_its_pages(site):
    assert sum(path.stat().st_size for path in site.rglob("*") if path.is_file()) < MOST
    there = {path.relative_to(site).as_posix() for path in site.rglob("*.html")}
    pages = ["index", "cite", "licence", "notebooks/index", "notebooks/glossary", "api/labkit", "api/labkit.team"]
    pages += [f"docs/{name}" for name in ("students", "instructors", "maintainers", "own-lab", "threats", "sources")]
    assert {f"{page}.html" for page in pages} <= there
    assert len(list((site / "_images").glob("*-film*.png"))) >= 3


def test_nothing_is_asked_of_anybody_else(seen):
    _, asked, faults = seen
    assert {urlparse(url).scheme for url in asked} <= {"file", "data"} and faults == []


def test_every_link_leads_to_a_page_and_a_place_on_it(seen):
    found, _, _ = seen
    ids = {path.as_uri(): set(page["ids"]) for path, page in found.items()}
    dead = []
    for path, page in found.items():
        for link in page["links"]:
            url, place = urldefrag(link)
            if urlparse(url).scheme != "file":
                continue
            if url in ids:
                dead += [(path.name, link)] if place and unquote(place) not in ids[url] else []
            elif (
                not re.sub("^file://", "", unquote(url))
                or not __import__("pathlib").Path(urlparse(unquote(url)).path).exists()
            ):
                dead.append((path.name, link))
    assert dead == []


def test_pictures_are_there_and_told(seen):
    found, _, _ = seen
    pictures = [(path.name, *one) for path, page in found.items() for one in page["pictures"]]
    assert len(pictures) > 60
    assert [one for one in pictures if not one[2].strip() or one[3] < 2] == []


def test_formulas_are_drawn(seen):
    found, _, _ = seen
    assert sum(len(page["formulas"]) for page in found.values()) > 500
    assert {path.name for path, page in found.items() if any(width < 1 for width in page["formulas"])} == set()
    left = {path.name: re.findall(r"\$[^$\n]*\\\w+[^$\n]*\$", page["typed"]) for path, page in found.items()}
    assert {name: some for name, some in left.items() if some} == {}


def test_a_phone_shows_pages_without_scrolling_sideways(seen):
    found, _, _ = seen
    assert {path.name: page["width"] for path, page in found.items() if page["width"] > PHONE} == {}


def test_axe_finds_nothing_serious(seen):
    found, _, _ = seen
    told = {
        path.name: [(v["id"], [node["html"][:100] for node in v["nodes"]][:3]) for v in page["axe"]]
        for path, page in found.items()
        if page["axe"]
    }
    assert told == {}
