"""The site's pages as Markdown: the labs, the project's own pages, licence, how to cite, the reference."""

import importlib.resources
import shutil
from pathlib import Path, PurePosixPath
from typing import Any

from ..records import CommandError
from . import api, lab, links

# Groups of the menu: these first, and what else docs/ has with the second.
LABS = ("notebooks/index.md", "notebooks/glossary.md")
READERS = ("docs/students.md", "docs/instructors.md", "docs/plan.md")
ABOUT = ("docs/sources.md", "cite.md", "licence.md", "CHANGELOG.md", "CONTRIBUTING.md")
LICENCE = """# Licence

```text
{}
```

The font of the formulas on these pages is STIX Two Math, under the SIL Open Font License 1.1.
"""
LOOK = Path(__file__).with_name("look")


def write(root: Path, folder: Path, lite: bool = False) -> None:
    """Write the pages of the project in `root` into a new folder, with pictures and notebooks beside them.

    lite: whether the labs' pages lead to JupyterLite. Raises CommandError and OSError.
    """
    scripts = sorted((root / "solutions").glob("[0-9]*_*.py"))
    if not scripts:
        raise CommandError(f"{root} holds no solutions/NN_name.py: a site is made from the full kit.")
    names = [script.stem for script in scripts]
    texts = {path: _text(root / path) for path in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", LABS[1])}
    texts |= {f"docs/{path.name}": _text(path) for path in sorted((root / "docs").glob("*.md"))}
    students = {name: root / "notebooks" / f"{name}.ipynb" for name in names}
    for name, student in students.items():
        pictures = folder / "notebooks" / name
        texts[f"notebooks/{name}.ipynb"] = lab.page(student, root / "solutions" / student.name, pictures, lite)
    texts[LABS[0]] = overview(students)
    texts |= {"LICENSE": LICENCE.format(_text(root / "LICENSE")), "CITATION.cff": citation(root)}
    texts |= api.pages(root / "labkit")
    shutil.copytree(root / "docs" / "pictures", folder / "docs" / "pictures")
    shutil.copytree(LOOK, folder / "look")
    with importlib.resources.path("ziamath.fonts", "STIXTwoMath-Regular.ttf") as font:
        shutil.copy(font, folder / "look" / "formulas.ttf")
    for path in students.values():
        shutil.copy(path, folder / "notebooks" / path.name)
    shutil.copy(root / "CITATION.cff", folder / "CITATION.cff")
    copied = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    known = copied | {links.page_of(path) for path in texts}
    made = {links.page_of(path): links.turned(text, path, known) for path, text in texts.items()}
    made["index.md"] += menu(made)
    for page, text in made.items():
        (folder / page).parent.mkdir(parents=True, exist_ok=True)
        (folder / page).write_text(text, encoding="utf-8")


def overview(students: dict[str, Path]) -> str:
    """The page of all labs: time, what each builds on, what one can do in the end. {name: students' notebook}."""
    parts = ["# The labs at a glance", "How they fit into a term is on [a page of its own](../docs/plan.md)."]
    for name, path in students.items():
        found = lab.head(path)
        told = [text for text in found.rest.split("\n\n") if text.startswith(("**By the end", "**You will write", "|"))]
        parts += [f"## [{found.title}]({name}.ipynb)", f"*{found.time}*", *told]
    return "\n\n".join(parts) + "\n"


def menu(pages: dict[str, str]) -> str:
    """The menu of {path: Markdown}, as Sphinx reads it."""
    here = sorted(PurePosixPath(page).with_suffix("").as_posix() for page in pages)
    first = [page.removesuffix(".md") for page in (LABS[0], *READERS, LABS[1], *ABOUT)]
    rest = [page for page in here if page not in (*first, "index")]
    groups = {
        "The labs": [first[0], *(p for p in rest if p.startswith("notebooks/")), LABS[1].removesuffix(".md")],
        "For whom": [*first[1:4], *(p for p in rest if p.startswith("docs/"))],
        "Reference": [*(p for p in rest if p.startswith("api/")), *first[5:]],
    }
    trees = [
        "\n".join(["```{toctree}", ":hidden:", ":maxdepth: 1", f":caption: {caption}", "", *found, "```"])
        for caption, found in groups.items()
    ]
    return "\n\n".join(["", *trees]) + "\n"


def citation(root: Path) -> str:
    """The page on how to cite, from CITATION.cff. Raises CommandError if that cannot be read."""
    import yaml

    try:
        cff: dict[str, Any] = yaml.safe_load(_text(root / "CITATION.cff"))
        works = [f"- {_authors(work)}: *{work['title']}*{_where(work)}" for work in cff["references"]]
        head = f"*{cff['title']}*, version {cff['version']}, by {_authors(cff)}."
        return "\n\n".join(
            ["# How to cite", cff["message"], head, "They grew from:", "\n".join(works), "{download}`CITATION.cff`"]
        )
    except (yaml.YAMLError, KeyError, TypeError) as error:
        raise CommandError(f"CITATION.cff cannot be read: {error}") from None


def _authors(work):
    names = [one.get("name") or f"{one['given-names']} {one['family-names']}" for one in work["authors"]]
    return ", ".join(names[:-1]) + (" and " if names[:-1] else "") + names[-1]


def _where(work):
    journal = f", {work['journal']} {work['volume']}({work['issue']})" if "journal" in work else ""
    year = f", {work['year']}" if "year" in work else ""
    return f"{journal}{year}. {work['notes'][0].upper()}{work['notes'][1:]}."


def _text(path):
    return path.read_text(encoding="utf-8")
