"""Names that others chose, as they can be told: of files, folders, students and cells."""

import unicodedata
from collections.abc import Sequence


def readable(name: str) -> str:
    """`name` as it can be printed: what has no glyph becomes U+FFFD, any white space a space."""
    name = unicodedata.normalize("NFC", " ".join(name.split()))
    # Two joiners have no glyph but belong to words of Persian and of Indian languages.
    return "".join(c if c.isprintable() or c in "\u200c\u200d" else "\ufffd" for c in name)


def listed(names: Sequence[str]) -> str:
    """'a, b, c, ...': the first three of some names."""
    return ", ".join(shorten(name) for name in names[:3]) + (", ..." if len(names) > 3 else "")


def several(names: Sequence[str], noun: str) -> str:
    """'2 files (a, b)'."""
    return f"{len(names)} {noun}{'s' if len(names) > 1 else ''} ({listed(names)})"


def shorten(name: str, width: int = 80) -> str:
    """`name` with its middle left out if it is longer than `width`."""
    return name if len(name) <= width else f"{name[: width // 2]}...{name[3 - width // 2 :]}"
