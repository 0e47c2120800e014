"""Pages for people, from templates in which whatever comes from anybody is text and never HTML."""

import base64
import re
from typing import NamedTuple

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from .. import records
from .markdown import markdown
from .texts import counted, plain, readable

APART = (  # said where each answer is read alone
    "Answers that are alike are not put together: students have numbers of their own in this lab, "
    "so the same words may be right for one and wrong for another."
)
TITLE, LINE, SENTENCE, ANSWER, RUBRIC = 200, 400, 2000, 5000, 20000  # characters of one text that are shown
LINES = 60  # lines of a report that are shown
LONG = 2500  # characters, from which on paper an entry may run over the end of a sheet
MANY = 100  # rows, above which a table is folded away
TOP = 12  # mistakes that are shown before the rest is folded away


class Look(NamedTuple):
    """How a status is shown: a class of the style sheet, a sign and a word."""

    kind: str
    sign: str
    word: str


LOOKS = {
    records.PASSED: Look("good", "✓", "passed"),
    records.PARTLY: Look("bad", "◐", "in part"),
    records.FAILED: Look("bad", "✗", "not passed"),
    records.NOT_RUN: Look("wait", "–", "not run"),
    records.ERROR: Look("wait", "!", "not graded"),
    records.OPEN: Look("wait", "…", "to be read"),
    records.BLANK: Look("wait", "○", "no answer"),
    records.BY_HAND: Look("good", "✎", "by hand"),
}


def cut(value: object, longest: int = RUBRIC) -> str:
    """Anybody's text for a page: cut, and without characters that act instead of being read."""
    text = readable(str(value))
    return text[:longest] + ("…" if len(text) > longest else "")


def prose(value: object, longest: int = SENTENCE) -> Markup:
    """The same for a sentence, in which `backticks` mark code: the only HTML that is made of a text."""
    parts = re.split(r"`([^`\n]{1,200})`", cut(value, longest))
    return Markup("").join(Markup("<code>{}</code>").format(part) if i % 2 else part for i, part in enumerate(parts))


def address(png: bytes) -> Markup:
    """The address of a picture that is in the page itself, whole; it is of letters that need no escape."""
    return Markup("data:image/png;base64,{}").format(base64.b64encode(png).decode("ascii"))


def render(template: str, **context: object) -> str:
    """The HTML text of a page: templates/`template`.html.j2 with `context`."""
    return _ENVIRONMENT.get_template(f"{template}.html.j2").render(context)


def environment(*packages: str) -> Environment:
    """What makes pages of the templates of these packages, looked for in this order.

    What a template says without a filter is cut and cleaned too, and then escaped: forgetting one does no harm.
    """
    made = Environment(
        loader=ChoiceLoader([PackageLoader(package) for package in packages]),
        autoescape=True,
        finalize=lambda value: value if isinstance(value, Markup) else cut(value),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters.update(cut=cut, prose=prose, plain=plain, counted=counted, markdown=markdown)
    made.globals.update(
        TITLE=TITLE, LINE=LINE, ANSWER=ANSWER, RUBRIC=RUBRIC, LINES=LINES, LONG=LONG, MANY=MANY, TOP=TOP, APART=APART
    )
    return made


_ENVIRONMENT = environment(__package__)
