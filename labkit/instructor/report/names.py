"""What each student is called: in the tables, and as a file."""

import hashlib
import re
import unicodedata
from collections import Counter
from collections.abc import Sequence

from ..records import Result
from .texts import clean, key, readable

_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d|conin|conout)", re.IGNORECASE)  # names of Windows


def labels(results: Sequence[Result]) -> list[str]:
    """What each of `results` is called, in order: its student's name, made to differ within one lab.

    Students who share a name get their identifier (or the name of their file) behind it: 'Ada (123)'.
    """
    names = [clean(result.student) or "no name" for result in results]
    count = Counter((result.lab, key(name)) for result, name in zip(results, names))
    taken, told = set(), []
    for result, name in zip(results, names):
        if count[result.lab, key(name)] > 1:
            mark = clean(result.identifier) or clean(re.split(r"[\\/]", result.source)[-1])
            name += f" ({mark})" if mark else ""
        label, number = name, 1
        while (result.lab, key(label)) in taken:
            number += 1
            label = f"{name} #{number}"
        taken.add((result.lab, key(label)))
        told.append(label)
    return told


def page_names(results: Sequence[Result]) -> dict[str, str]:
    """{label: file name of the page} of one lab's results, all of them, in the gradebook's order."""
    taken: set[str] = set()
    return {label: file_name(label, taken) for label in labels(results)}


def file_name(label: str, taken: set[str]) -> str:
    """A file name for a student's page, safe everywhere and not in the set `taken`, to which it is added.

    Letters of all scripts stay as they are; what could be a path, an ending or a device does not.
    """
    plain = unicodedata.normalize("NFKC", readable(label[:1000]))
    kept = "".join(c if unicodedata.category(c)[0] in "LMN" else "-" for c in plain)
    stem = _short(re.sub("-+", "-", kept).strip("-"))
    if not stem or _RESERVED.fullmatch(stem):
        stem = f"student-{stem}".rstrip("-")
    digest, tries = hashlib.sha256(label.encode("utf-8", "surrogatepass")).hexdigest(), 0
    found = stem
    while found.casefold() in taken:
        tries += 1
        found = f"{stem}-{digest[:8]}" + (f"-{tries}" if tries > 1 else "")
    taken.add(found.casefold())
    return f"{found}.html"


def _short(stem: str, characters: int = 60, octets: int = 180) -> str:
    """At most so many characters, and so many bytes in UTF-8, which is what file systems count."""
    return stem[:characters].encode("utf-8")[:octets].decode("utf-8", "ignore").strip("-")
