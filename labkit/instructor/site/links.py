"""Links between the project's files, turned to the pages that the site has of them."""

import posixpath
import re
from collections.abc import Collection

# A link or picture of Markdown, in whose words code may hold brackets.
_LINK = re.compile(r"(!?)\[((?:`[^`]*`|\\.|[^\[\]\\`])*)\]\(([^\s()<>]+)\)")
_LAB = re.compile(r"(?:solutions|notebooks)/(\d\w+)\.ipynb")
PAGES = {"README.md": "index.md", "LICENSE": "licence.md", "CITATION.cff": "cite.md"}


def turned(text: str, path: str, known: Collection[str]) -> str:
    """The Markdown of the file `path` with links to files of the project as the site has them.

    known: the site's own files. A link to what the site does not have is left as its words.
    """

    def turn(link: re.Match[str]) -> str:
        picture, words, address = link.groups()
        file, hash_, place = address.partition("#")
        if not file or ":" in file or not re.search(r"[./]|^[A-Z]+$", file):
            return link[0]
        target = posixpath.normpath(posixpath.join(posixpath.dirname(path), file))
        target = page_of(target)
        if target not in known:
            return words
        here = posixpath.dirname(PAGES.get(path, path)) or "."
        return f"{picture}[{words}]({posixpath.relpath(target, here)}{hash_}{place})"

    return _LINK.sub(turn, text)


def page_of(file: str) -> str:
    """The site's page for a file of the project: a lab for either of its notebooks, a package for its modules."""
    if lab := _LAB.fullmatch(file):
        return f"notebooks/{lab[1]}.md"
    if file.startswith("labkit/") and file.endswith(".py"):
        return f"api/{posixpath.dirname(file).replace('/', '.')}.md"
    return PAGES.get(file, file)
