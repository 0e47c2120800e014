"""Written answers as they are shown: Markdown and formulas work, and nothing else that somebody wrote does."""

import re
import time

import pytest

from labkit.instructor import records
from labkit.instructor.records import Check, Mark, Result
from labkit.instructor.report.feedback import feedback_page
from labkit.instructor.report.formula import mathml
from labkit.instructor.report.markdown import DEEPEST, LETTERS, PICTURES, markdown
from labkit.instructor.report.to_mark import to_mark_page

from helpers.graded import TITLE, sound

PNG = "data:image/png;base64,iVBORw0KGgo="


def on_pages(text):
    """The feedback page and the page for marking, parsed, with `text` as question, rubric and answer."""
    check = Check("q", "Q", 1, True, False, text, text)
    result = Result("Ada", marks=[Mark("q", None, 1, records.OPEN)], answers={"q": text})
    return sound(feedback_page(result, [check], TITLE)), sound(to_mark_page([result], [check], TITLE))


def test_tables_lists_code_emphasis_and_formulas_are_shown_as_such():
    text = (
        "# Head\n*soft* **strong** `code`\n\n- one\n- two\n\n1. first\n\n| a | b |\n|---|--:|\n| 1 | $x_k$ |\n\n"
        "```python\nif a < b:\n```\n\n$$\nP = F P F^\\top + Q\n$$\n\n\\begin{align}\na &= b\n\\end{align}\n\n> said"
    )
    for seen in on_pages(text):
        assert set(re.findall(r"\w+", "h4 em strong code ul ol li table pre blockquote math msub msup mtable")) <= set(
            seen.tags
        )
        assert "if a < b:" in seen.text and "$" not in seen.text and "**" not in seen.text
        assert ("math", "display", "block") in seen.attributes


@pytest.mark.parametrize("formula", ["\\foo", "\\frac{", "x_1_2", "{" * 900 + "}" * 900, "x" * 3000])
def test_a_formula_that_cannot_be_read_stays_as_it_was_typed(formula):
    assert not mathml(formula, False)
    for seen in on_pages(f"so ${formula}$ it is"):
        assert f"${formula}$" in seen.text.replace(" ", "") and "math" not in seen.tags


def test_a_formula_carries_neither_addresses_nor_looks():
    for latex in ("\\href{javascript:x}{y}", "\\style{position:fixed}{y}", "\\class{box}{y}", "\\color{red}y"):
        assert re.fullmatch("<math>(<m(row|style)>)+<mi>y</mi>(</m(row|style)>)+</math>", mathml(latex, False)), latex
    assert "999" not in mathml("a\\hspace{999em}b", False)
    assert mathml("\\text{<b>&lt;}", False).count("&lt;b&gt;&amp;lt;") == 1


def test_a_formula_in_lines_and_the_words_in_it_are_read_as_jupyter_reads_them():
    shown = mathml("\\begin{aligned} H &= \\text{derivative of } y \\\\ S &= 2 \\end{aligned}", True)
    assert shown.count("<mtr>") == 2 and "derivative\xa0of" in shown and "&amp;" not in shown


def test_only_pictures_that_are_in_the_notebook_are_shown():
    text = f"![my \\] plot]({PNG}) ![lost](attachment:x.png) ![far](https://evil.example/x.png) "
    text += "![drawn](data:image/svg+xml;base64,AA)"
    for seen in on_pages(text):
        assert seen.tags.count("img") in (1, 3)  # on the page for marking it is question and rubric too
        assert "not in the notebook: lost" in seen.text and "not in the notebook: far" in seen.text
        assert "not a PNG, JPEG or GIF: drawn" in seen.text and "evil.example" not in seen.text
    large = f"![large](data:image/png;base64,{'A' * (LETTERS + 1)})"
    assert "too large" in markdown(large, 5000).html and not markdown(large, 5000).more
    many = " ".join(f"![x](data:image/png;base64,{'A' * n}=)" for n in range(4, 40))
    assert markdown(many, 5000).html.count("<img") == PICTURES


def test_links_are_words_and_addresses():
    text = "[here](https://a.example/x) <https://b.example> [bad](javascript:alert(1)) <b onclick=x>bold</b>"
    for seen in on_pages(text):
        led = [value for tag, _, value in seen.attributes if tag == "a"]
        assert all(re.fullmatch(r"[\w./-]+\.html", address) for address in led)  # the page's own
        assert "here (https://a.example/x)" in seen.text
        assert "https://b.example" in seen.text and "<b onclick=x>bold</b>" in seen.text


def test_characters_that_act_come_in_by_no_door():
    for odd in (
        "&#8238;",
        "&#x202e;",
        "&#27;[31m",
        "\u202e",
        "\x1b[31m",
        "&#xD800;",
        "$\\unicode{x202e}$",
        "$a\u202e$",
    ):
        on_pages(f"abc {odd} def")


HUGE = 20_000
ODD = {
    "quotes": "> " * HUGE,
    "lists": "".join(" " * i + "- x\n" for i in range(200)),
    "stars": "*a **b " * HUGE,
    "dollars": "$" * HUGE,
    "escaped dollars": "\\$" * HUGE,
    "brackets": "![" * HUGE,
    "ticks": "".join("`" * i + " " for i in range(200)),
    "fences": "```\n~~~~\n" * HUGE,
    "pipes": "|a|b|\n|-|-|\n" + "|a|b\n" * HUGE,
    "formulas": "$x$ " * HUGE,
    "deep formula": "$" + "\\sqrt{" * 300 + "x" + "}" * 300 + "$",
    "environments": "\\begin{align}" * HUGE,
    "unended pictures": "![x](data:image/png;base64," * HUGE,
    "right to left": "שלום $x$ \u202e" * HUGE,
    "breaks out of code": "```\n</code></pre><script>x</script>\n" * 500,
}


@pytest.mark.parametrize("text", ODD.values(), ids=ODD)
def test_what_is_huge_or_nested_neither_breaks_a_page_nor_takes_long(text):
    begun = time.process_time()
    on_pages(text)
    assert time.process_time() - begun < 10


def test_what_is_nested_too_deep_is_shown_as_it_was_typed():
    text = "".join("  " * i + f"- level {i}\n" for i in range(DEEPEST))
    assert f"level {DEEPEST - 1}" in markdown(text, HUGE).html
