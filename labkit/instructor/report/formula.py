"""Formulas in LaTeX as MathML, which browsers show without scripts."""

import html
import re
from xml.etree.ElementTree import Element, tostring

from latex2mathml.converter import convert_to_element

LONGEST, DEEPEST = 2000, 60  # characters and levels of one formula; a larger one stays as it was typed

_TAGS = set(
    re.findall(
        r"\w+",
        "math mrow mi mn mo mtext mspace mstyle mfrac msqrt mroot msub msup msubsup munder mover munderover "
        "mmultiscripts mprescripts none mtable mtr mtd mpadded mphantom menclose",
    )
)
# What only says how a formula looks, and how large that may be: none leads away, none covers the page.
_LOOK = {
    **dict.fromkeys(("accent", "accentunder", "displaystyle", "fence", "form", "largeop", "movablelimits"), r"\w+"),
    **dict.fromkeys(("separator", "stretchy", "symmetric", "columnalign", "mathvariant"), r"[a-z -]+"),
    **dict.fromkeys(("lspace", "rspace", "width", "linethickness"), r"-?[0-2]?(\.\d+)?(em|pt)|0"),
    **dict.fromkeys(("minsize", "maxsize"), r"[0-4]?(\.\d+)?em"),
    "scriptlevel": r"[+-]?[0-3]",
}


def mathml(latex: str, block: bool) -> str:
    """The MathML element of a formula, '' if it cannot be read. block: on a line of its own."""
    if len(latex) > LONGEST:
        return ""
    # Unnumbered, as in Jupyter; a part of a formula in lines is known by the whole's name only.
    latex = re.sub(r"\\(begin|end)\{(align|gather|equation)(ed)?\}", r"\\\1{\2*}", latex.strip())
    try:
        made = convert_to_element(latex, display="block" if block else "inline")
        _tidy(made)
        made.attrib = {"display": "block"} if block else {}
        return tostring(made, encoding="unicode", short_empty_elements=False)
    except Exception:  # it has many errors of its own, and whatever nobody thought of when somebody wrote it
        return ""


def _tidy(element: Element, depth: int = 0) -> None:
    """Leave of an element and what is in it what is harmless; ValueError for what is no formula."""
    if element.tag not in _TAGS or depth > DEEPEST:
        raise ValueError(element.tag)
    text = element.text or ""
    if element.tag == "mtext":
        text = text.replace("&#x000A0;", "\xa0")  # so it writes each space
    else:
        text = html.unescape(text)  # signs come as entities
        if "\\" in text:
            raise ValueError(text)  # a command that it does not know
    element.text = text
    element.attrib = {
        name: value for name, value in element.attrib.items() if re.fullmatch(_LOOK.get(name, "(?!)"), value)
    }
    for inner in element:
        _tidy(inner, depth + 1)
