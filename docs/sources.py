"""Where each thing of the three source documents stands in the labs: `python docs/sources.py` writes docs/sources.md.

Made from docs/sources.toml: there an item names a lab and a phrase that stands in one cell of its solution, or says why
it is in no lab.
"""

import json
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TABLE, PAGE = ROOT / "docs" / "sources.toml", ROOT / "docs" / "sources.md"
HEAD = """# What became of the sources

The labs grew from three documents. This page says for each equation, figure, table, experiment, claim and future-work
item of theirs where it stands. It is made by `python docs/sources.py` from `docs/sources.toml`.
"""


def cells(lab):
    """[(id, text, heading above it)] of the cells of a lab's solution."""
    found, heading = [], ""
    for cell in json.loads((ROOT / "solutions" / f"{lab}.ipynb").read_text(encoding="utf-8"))["cells"]:
        text = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            headings = [line.lstrip("# ") for line in text.splitlines() if line.startswith("#")]
            heading = headings[0] if headings else heading
        found.append((cell["id"], text, heading))
    return found


def problems(sources):
    """Sentences about phrases that stand in no cell, or in several."""
    for name, source in sources.items():
        for item in source["items"]:
            if "why" not in item:
                count = len(_places(item))
                if count != 1:
                    yield f"{name}, {item['item']}: {item['phrase']!r} stands in {count} cells of {item['lab']}"


def page(sources):
    """The Markdown of the page. Raises ValueError for a phrase that does not stand in exactly one cell."""
    if wrong := list(problems(sources)):
        raise ValueError("\n".join(wrong))
    text = HEAD
    for source in sources.values():
        text += f"\n## {source['title']}\n\n| item | what | where |\n|---|---|---|\n"
        text += "".join(f"| {item['item']} | {item['what']} | {_where(item)} |\n" for item in source["items"])
    return text


def _places(item):
    return [(id, heading) for id, text, heading in cells(item["lab"]) if item["phrase"] in " ".join(text.split())]


def _where(item):
    if "why" in item:
        return f"in no lab: {item['why']}"
    ((id, heading),) = _places(item)
    return f"[lab {int(item['lab'][:2])}](../solutions/{item['lab']}.ipynb), “{heading}”, cell `{id}`"


def load():
    """{name: {title, items}} of docs/sources.toml."""
    return tomllib.loads(TABLE.read_text(encoding="utf-8"))


if __name__ == "__main__":
    try:
        PAGE.write_text(page(load()), encoding="utf-8")
    except ValueError as error:
        sys.exit(str(error))
    print(PAGE)
