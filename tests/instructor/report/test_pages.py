"""What holds for every page: no text breaks it, whichever filter a template forgot, and its colours can be read."""

import re

import numpy as np
import pytest
from jinja2 import UndefinedError

from labkit.instructor import records
from labkit.instructor.records import Check, Mark, Result
from labkit.instructor.report import pages
from labkit.instructor.report.class_overview import class_page
from labkit.instructor.report.feedback import feedback_page
from labkit.instructor.report.names import file_name, labels
from labkit.instructor.report.to_mark import to_mark_page

from helpers.graded import sound

ODD = {
    "script": "<script>alert(1)</script>",
    "breaks out": "\"'></pre></style></title><img src=x onerror=alert(1)>",
    "comment": "<!-- --> ]]> <![CDATA[",
    "link": "javascript:alert(1)",
    "entity": "&lt;b&gt; &#0; &amp",
    "direction": "abc\u202egnp.exe\u202c \u2066x\u2069 \u200f",
    "control": "\x00\x07\x1b[31m\r\x85",
    "surrogate": "\ud800 and \udfff",
    "backticks": "`<b>` ``` `\n`",
    "long": "x" * 100_000,
    "long and odd": "<\u202e&`" * 25_000,
    "empty": "",
}


def every_page(odd):
    """All pages of results in which every text is `odd`."""
    check = Check("a", odd, 1, False, False, odd, odd)
    hidden, hand = Check("b", odd, 1, hidden=True), Check(odd, odd, 1, True, False, odd, odd)
    marks = [
        Mark("a", 0, 1, records.FAILED, odd, (odd,) * 3, odd + "."),
        Mark("b", 0, 1, odd, odd, (odd,), odd),
        Mark(odd, None, 1, records.OPEN, odd),
    ]
    result = Result(odd, odd, "lab", odd, None, True, [odd], 3, "", marks, {odd: odd})
    unfit = Result(odd, odd, "lab", odd, problem=odd or "?")
    checks, results, taken = [check, hidden, hand], [result, unfit], set()
    links = {label: file_name(label, taken) for label in labels(results)}
    return [
        feedback_page(result, checks, odd),
        feedback_page(unfit, checks, odd),
        to_mark_page(results, checks, odd),
        class_page(results, checks, odd, links),
    ]


@pytest.mark.parametrize("odd", ODD.values(), ids=ODD)
def test_no_text_breaks_a_page(odd):
    for page in every_page(odd):
        sound(page)
        assert len(page) < 400_000 and "<script" not in page and "<img src=x" not in page


@pytest.mark.parametrize("forgotten", [(), ("cut", "prose")], ids=["as written", "filters forgotten"])
def test_no_text_makes_a_tag_or_an_attribute(monkeypatch, forgotten):
    for name in forgotten:
        monkeypatch.setitem(pages._ENVIRONMENT.filters, name, lambda text, *_: text)
    payload = '\u202e\x07<script>alert(1)</script>"\'><img src=x onerror=alert(1)> x="1" {{ 7 * 7 }} {% raw %}<!--'
    for page, harmless in zip(every_page(payload), every_page("some words")):
        seen, expected = sound(page), sound(harmless)
        assert seen.tags == expected.tags
        assert [pair[:2] for pair in seen.attributes] == [pair[:2] for pair in expected.attributes]
        assert "<script>alert(1)</script>" in seen.text and "{{ 7 * 7 }}" in seen.text and "49" not in seen.text


def test_a_name_that_a_template_misspells_is_an_error():
    with pytest.raises(UndefinedError):
        pages.render("to_mark", title="t")


def test_colours_can_be_read_in_both_themes_and_on_paper():
    def light(color):
        color = color * 2 if len(color) == 3 else color
        parts = np.array([int(color[i : i + 2], 16) for i in (0, 2, 4)]) / 255
        return np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4) @ [0.2126, 0.7152, 0.0722]

    style = re.search("<style>(.*)</style>", pages.render("to_mark", title="t", ways=[], questions=[]), re.DOTALL)[1]
    themes = [dict(re.findall(r"--(\w+): #(\w+)", part)) for part in re.findall(r":root \{.*?\}", style, re.DOTALL)]
    assert len(themes) == 3
    for theme in themes:
        for fore in ("fore", "soft", "good", "bad", "wait"):
            for back in ("back", "card"):
                low, high = sorted([light(theme[fore]), light(theme[back])])
                assert (high + 0.05) / (low + 0.05) >= 4.5, (fore, back)
