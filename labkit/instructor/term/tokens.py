"""Python as tokens that do not change with names, comments and layout, of any text that a student handed in."""

import builtins
import keyword
import re
import zlib
from collections.abc import Collection
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_FIXED = {*keyword.kwlist, *dir(builtins)}
_NAME, _TEXT = "v", "s"  # what stands for all names, and for all strings
_DOUBLE, _SINGLE = r'"""(?:[^\\]|\\.)*?(?:"""|\Z)', r"'''(?:[^\\]|\\.)*?(?:'''|\Z)"
# Each form ends somewhere even where a string is not closed: no text takes longer than its length.
_TOKEN = re.compile(
    rf"""(?P<skip>\#[^\n]*|\\\n|[^\S\n]+)
    |(?P<text>[bBrRuUfFtT]{{0,3}}(?:{_DOUBLE}|{_SINGLE}|"(?:[^"\\\n]|\\.)*"?|'(?:[^'\\\n]|\\.)*'?))
    |(?P<number>\.?\d(?:[eE][+-]\d|[\w.])*)
    |(?P<name>[^\W\d]\w*)
    |(?P<line>\n)
    |(?P<sign>\*\*=?|//=?|<<=?|>>=?|->|:=|[-+*/%@&|^=!<>]=|.)""",
    re.VERBOSE | re.DOTALL,
)


class Code(NamedTuple):
    """A text and its tokens. words (n,): a number for each;  places (n, 2): where it begins and ends in the text."""

    text: str
    words: NDArray[np.uint64]
    places: NDArray[np.int64]


def read(text: str, fields: Collection[str] = ()) -> Code:
    """The Code of a text, without comments and texts that document.

    Names are one and the same, but for Python's own, for what stands behind a dot, and for those `fields` of `self`
    that cannot have another name.
    """
    words, places = [], []
    depth, fresh, last, before = 0, True, "", ""
    for found in _TOKEN.finditer(text):
        kind, word = found.lastgroup, found[0]
        if kind == "skip":
            continue
        if kind == "line":
            fresh = fresh or not depth
            continue
        if kind == "text":
            if fresh:
                continue
            word = _TEXT
        elif kind == "name" and word not in _FIXED and not (last == "." and (before != "self" or word in fields)):
            word = "self" if word == "self" else _NAME
        elif kind == "sign":
            depth = max(0, depth + (word in "([{") - (word in ")]}"))
        fresh, before, last = False, last, word
        words.append(zlib.crc32(_NAME.encode() if word == "self" else word.encode("utf-8", "replace")))
        places.append(found.span())
    return Code(text, np.array(words, dtype=np.uint64), np.array(places, dtype=np.int64).reshape(-1, 2))


def fields_of(text: str) -> set[str]:
    """The names that stand behind `self.`, or another name and a dot, in a text."""
    return set(re.findall(r"\.([^\W\d]\w*)", text))
