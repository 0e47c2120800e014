"""From one page about the class to the others."""

from urllib.parse import quote

TERM = "term.html"
HERE = {"class": "class-{}.html", "marking": "to-mark-{}.html", "term": TERM}
WORDS = {"class": "The class", "marking": "Written answers", "term": "The term"}


def ways(lab: str, here: str, up: str = "") -> list[tuple[str, str]]:
    """(address, words) of the pages about the class in this lab, but the one that is `here`.

    up: what leads to their folder. `labkit grade` writes all of them each time.
    """
    return [(up + quote(HERE[to].format(lab), errors="replace"), WORDS[to]) for to in HERE if to != here]
