"""Answers that are the same, or nearly: they are read together.

Nearly means the same words in nearly the same order, and exactly the same numbers, signs and negations: what is
"400 steps" in one answer and "40 steps" in the other is read apart. Whoever reads is shown each word that differs.
"""

import hashlib
import re
from collections import Counter
from collections.abc import Sequence
from difflib import SequenceMatcher
from itertools import pairwise

from ..report.texts import is_blank, readable, squash

NEARLY = 0.8  # share of the pairs of neighbouring words that two answers have in common
MOST = 12  # different answers that are shown together
LONGEST = 8000  # characters; a longer answer is together with its like only
_PICTURE = re.compile(r"data:image/[^\s()<>]*")
_NEGATIONS = {"not", "no", "never", "cannot", "t", "without", "nor", "neither", "nothing", "none"}
_LIGHT = set(".,;:!?'\"`()*_-–…’“”")


def normal(text: str) -> str:
    """A text as it is compared: without what is not seen, pictures by their digests; '' where nobody wrote anything."""
    if is_blank(text):
        return ""
    named = _PICTURE.sub(lambda found: f"picture{hashlib.sha256(found[0].encode()).hexdigest()}", text)
    return squash(readable(named))


def groups(texts: Sequence[str]) -> list[list[list[int]]]:
    """Groups of alike texts, the largest first; each holds its different texts, each by its places in `texts`."""
    same: dict[str, list[int]] = {}
    for place, text in enumerate(texts):
        same.setdefault(normal(text), []).append(place)
    order = sorted(same, key=lambda text: -len(same[text]))
    found: list[list[list[int]]] = []
    leaders: list[tuple[tuple[str, ...], set, list]] = []  # of the groups that may still grow
    for text in order:
        exact, pairs = _marks(text) if text and len(text) <= LONGEST else ((), set())
        near = (group for known, others, group in leaders if known == exact and _share(pairs, others) >= NEARLY)
        group = next((group for group in near if len(group) < MOST), None)
        if group is None:
            group = []
            found.append(group)
            if pairs:
                leaders.append((exact, pairs, group))
        group.append(same[text])
    return sorted(found, key=lambda group: -sum(map(len, group)))


def _marks(text: str) -> tuple[tuple[str, ...], set]:
    """(what must be the same in both, the pairs of neighbouring words, each numbered)."""
    words = [word for word in re.findall(r"\w+|[^\w\s]", text.casefold()) if word not in _LIGHT]
    plain = [word for word in words if word.isalpha() and (len(word) > 1 or word in "ai")]
    exact = tuple(w for w in words if w in _NEGATIONS or not (w.isalpha() and (len(w) > 1 or w in "ai")))
    seen: Counter[tuple[str, str]] = Counter()
    pairs = set()
    for pair in pairwise(["", *plain, ""]):
        seen[pair] += 1
        pairs.add((pair, seen[pair]))
    return exact, pairs


def _share(one: set, other: set) -> float:
    if 2 * min(len(one), len(other)) < NEARLY * (len(one) + len(other)):
        return 0.0
    return 2 * len(one & other) / (len(one) + len(other))


def differences(one: str, other: str) -> list[tuple[str, str]]:
    """What is said differently: pairs (words of `one`, words of `other` in their place); either may be ''."""
    a, b = normal(one).split(), normal(other).split()
    codes = SequenceMatcher(None, a, b, autojunk=False).get_opcodes()
    return [(" ".join(a[i:j]), " ".join(b[k:m])) for kind, i, j, k, m in codes if kind != "equal"]
