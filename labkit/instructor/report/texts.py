"""Texts and numbers of people: cleaned, compared, and as cells of tables."""

import html
import re
import unicodedata
from collections.abc import Iterable

from ..records import STUB

SHOWN = 10  # how many problems or names one message lists

# What colours a terminal's text, sets its window's title and the like.
_TERMINAL = re.compile(r"(?:\x1b\[|\x9b)[0-?]*[@-~]?|\x1b\][^\x07\x1b\n]{0,200}(?:\x07|\x1b\\)")
# Control characters, those that turn the text around them, and half characters, which no file can hold.
_ODD = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\U000e0000-\U000e007f"
    "\u061c\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffc\ufffe\uffff]"
)
# Where a spreadsheet may begin a formula: at a sign, also of full or small width, behind what it may skip.
_SIGNS = "=+@\\-\uff1d\uff0b\uff20\uff0d\ufe66\ufe62\ufe6b\ufe63\u2212"
_SKIPPED = r"""[\s"'\x80-\xad\u180e\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff]*"""
_FORMULA = f"(?={_SKIPPED}[{_SIGNS}])"
_BEGINS = {comma: rf"(^|[{commas}])" for comma, commas in ((",", ";\t"), (";", ";,\t"))}


def readable(text: str) -> str:
    """`text` without characters that act instead of being read; tabs and line ends stay."""
    return _ODD.sub("", _TERMINAL.sub("", text))


def is_blank(answer: str) -> bool:
    """Whether nobody wrote anything: white space, letters that are not seen, or the words that ask for an answer."""
    return not "".join(readable(answer).replace(STUB, "").split())


def final(reason: str) -> str:
    """What a check says in a notebook, where one may go on, as it is said of a mark."""
    return re.sub(r"^Not yet right\b", "Not right", reason)


def clean(text: object) -> str:
    """`text` on one line, without control characters, a terminal's colours and halves of characters."""
    line = " ".join(_TERMINAL.sub("", str(text)).split())
    return " ".join(_ODD.sub("", line).split())


def cut(text: str, longest: int) -> str:
    """`text`, or its first `longest` characters and a word that it was cut."""
    return text if len(text) <= longest else f"{text[:longest]}… (cut here: it has {len(text)} characters)"


def squash(text: str) -> str:
    """`text` for comparing: composed letters, one space for each gap."""
    return unicodedata.normalize("NFC", " ".join(text.split()))


def key(text: str) -> str:
    """`text` for looking up: no capitals, and no leading zeros, which a spreadsheet drops of a number."""
    text = squash(clean(text)).casefold()
    return text.lstrip("0") or "0" if text.isdigit() else text


def guard(text: object, comma: str = ",") -> str:
    """`text`, clean, as a cell that no spreadsheet takes for a formula. comma: what is between the table's cells.

    A spreadsheet of another language begins a cell behind a semicolon or comma inside of it too, quoted or not.
    """
    return re.sub(_BEGINS[comma] + _FORMULA, r"\1'", clean(text))


def unguard(text: str, comma: str = ",") -> str:
    """The text, clean, that `guard` made a cell of."""
    return re.sub(_BEGINS.get(comma, _BEGINS[","]) + "'" + _FORMULA, r"\1", text.lstrip("\t\r"))


def guard_html(text: str, comma: str) -> str:
    """The same as `guard` for a cell of HTML, in which students are to see no sign that is not theirs."""
    cell = html.escape(clean(text), quote=False)
    sign = re.compile(f"(?:{_BEGINS.get(comma, _BEGINS[','])}{_SKIPPED})([{_SIGNS}])")
    while found := sign.search(cell):
        cell = f"{cell[: found.start(2)]}&#{ord(found[2])};{cell[found.end() :]}"
    return cell


def number(text: str) -> float | None:
    """The number in a cell, with a decimal point or comma, or None: '1,5' is 1.5, 'nan' is no number."""
    text = text.strip()
    return float(text.replace(",", ".")) if re.fullmatch(r"[+-]?(\d{1,9}([.,]\d*)?|[.,]\d+)", text) else None


def plain(value: float, digits: int = 4) -> str:
    """`value` with at most `digits` decimals and no idle zeros: '1', '1.5'."""
    return f"{value + 1e-9:.{digits}f}".rstrip("0").rstrip(".")  # 1e-9: halves go up, whatever their bits


def counted(count: float, noun: str) -> str:
    """'1 student', '2.5 points'."""
    return f"{plain(count, 2)} {noun}{'' if count == 1 else 's'}"


def listed(names: Iterable[str]) -> str:
    """'Ada, Bela' or, of many, the first ten 'and 7 more'."""
    names = list(names)
    return ", ".join(names[:SHOWN]) + (f" and {len(names) - SHOWN} more" if len(names) > SHOWN else "")
