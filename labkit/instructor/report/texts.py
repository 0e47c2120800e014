"""Texts and numbers of people: cleaned, compared, and as cells of tables."""

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
    "\u061c\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\uffff]"
)


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
    return re.sub(r"[\x00-\x1f\x7f\ud800-\udfff]", "", " ".join(_TERMINAL.sub("", str(text)).split()))


def squash(text: str) -> str:
    """`text` for comparing: composed letters, one space for each gap."""
    return unicodedata.normalize("NFC", " ".join(text.split()))


def key(text: str) -> str:
    """`text` for looking up: no capitals, and no leading zeros, which a spreadsheet drops of a number."""
    text = squash(clean(text)).casefold()
    return text.lstrip("0") or "0" if text.isdigit() else text


def guard(text: object) -> str:
    """`text`, clean, as a cell that no spreadsheet takes for a formula."""
    cell = clean(text)
    return "'" + cell if re.match("'*[=+@-]", cell) else cell


def unguard(text: str) -> str:
    """The text that `guard` made a cell of; a tab or line end that a person added counts too."""
    return text[1:] if re.match("'+[=+@\t\r-]", text) else text


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
