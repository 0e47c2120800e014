"""Markdown of students and instructors as HTML: formulas readable, pictures in the page, nothing that leads away.

Whatever somebody wrote is text: HTML is shown as it was typed, a link as its words and its address.
"""

import re
from collections.abc import Sequence
from typing import Any, NamedTuple

from markdown_it import MarkdownIt
from markdown_it.renderer import RendererHTML
from markdown_it.token import Token
from markupsafe import Markup, escape
from mdit_py_plugins.amsmath import amsmath_plugin
from mdit_py_plugins.dollarmath import dollarmath_plugin

from .formula import mathml
from .texts import readable

PICTURES, LETTERS = 10, 2_000_000  # pictures of one text that are shown, and letters of a picture's data
BELOW = 3  # a text's headings stand below the page's own three kinds
DEEPEST = 40  # lists in lists and the like; what is nested deeper is shown as it was typed
_PICTURE = re.compile(r"(!\[(?:\\.|[^\[\]\\\n]){0,500}\]\()(data:[^\s()<>]*)\)")
_KNOWN = re.compile(r"data:image/(png|jpe?g|gif);base64,[A-Za-z0-9+/]*=*")


class Shown(NamedTuple):
    """A text as HTML, and how many more characters there were than are shown."""

    html: Markup
    more: int


def markdown(text: str, longest: int) -> Shown:
    """The first `longest` characters of a Markdown text as HTML; what a picture is made of does not count.

    Pictures must be in the text, as `![name](data:image/png;base64,...)`, PNG, JPEG or GIF; others are named.
    """
    found: list[str] = []

    def keep(picture: re.Match[str]) -> str:
        found.append(picture[2])
        return f"{picture[1]}picture:{len(found) - 1})"

    text = readable(_PICTURE.sub(keep, text))
    env = {"pictures": found}
    tokens = _MARKDOWN.parse(text[:longest], env)
    if any(token.level >= DEEPEST for token in tokens):
        html = f"<pre>{escape(text[:longest])}</pre>"
    else:
        html = _MARKDOWN.renderer.render(tokens, _MARKDOWN.options, env)
    return Shown(Markup(readable(html)), max(0, len(text) - longest))  # once more, for entities such as &#8238;


def inline(text: str, longest: int) -> Markup:
    """The first `longest` characters of a Markdown text as HTML for a place that holds words only, as a button."""
    env: dict[str, list[str]] = {"pictures": []}
    tokens = _MARKDOWN.parseInline(readable(text)[:longest], env)
    return Markup(readable(_MARKDOWN.renderer.render(tokens, _MARKDOWN.options, env)))


class _Page(RendererHTML):
    """Each method makes the HTML of the tokens of its name; env is that of one text."""

    def image(self, tokens: Sequence[Token], idx: int, options: Any, env: Any) -> str:
        name = escape(tokens[idx].content or "without a name")
        number = re.fullmatch(r"picture:(\d{1,6})", str(tokens[idx].attrs["src"]))
        if not number or int(number[1]) >= len(env["pictures"]):
            return _missing(name, "not in the notebook")
        data = env["pictures"][int(number[1])]
        if not _KNOWN.fullmatch(data):
            return _missing(name, "not a PNG, JPEG or GIF")
        shown = env.setdefault("shown", set())
        if len(data) > LETTERS or len(shown | {data}) > PICTURES:
            return _missing(name, "too large or one of too many")
        shown.add(data)
        return f'<img src="{escape(data)}" alt="{name}">'

    def link_open(self, tokens: Sequence[Token], idx: int, options: Any, env: Any) -> str:
        known = tokens[idx].info == "auto"  # its words are its address
        env.setdefault("links", []).append("" if known else tokens[idx].attrs["href"])
        return ""

    def link_close(self, tokens: Sequence[Token], idx: int, options: Any, env: Any) -> str:
        address = env["links"].pop()
        return f" (<code>{escape(address)}</code>)" if address else ""

    def heading_open(self, tokens: Sequence[Token], idx: int, options: Any, env: Any) -> str:
        return f"<h{min(6, int(tokens[idx].tag[1]) + BELOW)}>"

    def heading_close(self, tokens: Sequence[Token], idx: int, options: Any, env: Any) -> str:
        return f"</h{min(6, int(tokens[idx].tag[1]) + BELOW)}>"

    def code_block(self, tokens: Sequence[Token], idx: int, options: Any, env: Any) -> str:
        return f"<pre><code>{escape(tokens[idx].content)}</code></pre>"

    def math_inline(self, tokens: Sequence[Token], idx: int, options: Any, env: Any) -> str:
        token = tokens[idx]
        typed = f"{token.markup}{token.content}{token.markup}" if "$" in token.markup else token.content
        html = mathml(token.content, token.type != "math_inline") or f"<code>{escape(typed)}</code>"
        return f"<div>{html}</div>" if token.block else html

    def td_open(self, tokens: Sequence[Token], idx: int, options: Any, env: Any) -> str:
        side = re.fullmatch(r"text-align:(right|center)", str(tokens[idx].attrs.get("style")))
        return f'<{tokens[idx].tag} class="{side[1]}">' if side else f"<{tokens[idx].tag}>"

    fence, th_open = code_block, td_open
    math_inline_double = math_block = amsmath = math_inline


def _missing(name: str, why: str) -> str:
    return f"<i>(A picture is not shown here, since it is {why}: {name}.)</i>"


_MARKDOWN = MarkdownIt(
    "commonmark", {"html": False, "xhtmlOut": False, "maxNesting": DEEPEST + 1}, renderer_cls=_Page
).enable(["table", "strikethrough"])
_MARKDOWN.use(dollarmath_plugin, allow_labels=False, allow_blank_lines=False, double_inline=True).use(amsmath_plugin)
# The plugins bring their own ways to show a formula.
_MARKDOWN.renderer = _Page()
