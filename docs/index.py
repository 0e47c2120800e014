"""The index at the end of docs/maintainers.md, from the code's own docstrings: `python docs/index.py` writes it."""

import ast

from house import PAGE, ROOT, WING, modules

MARK = "<!-- from here on: python docs/index.py -->\n"
TITLES = {
    "": "`labkit/`: the world and the run",
    "plots": "`labkit/plots/`: pictures of beliefs and runs",
    "legged": "`labkit/legged/`: the football field of labs 4 and 5",
    "team": "`labkit/team/`: the hall of labs 6 to 8",
    "mrclam": "`labkit/mrclam/`: real robots",
    "checks": "`labkit/checks/`: what tells a student what is wrong",
    "notebook": "`labkit/notebook/`: a student's notebook",
}


def page():
    """The whole page, with the index as the code is now."""
    return PAGE.read_text(encoding="utf-8").partition(MARK)[0] + MARK + "".join(_index())


def _index():
    folders = {}
    for name, path in modules().items():
        folder = path.parent.relative_to(ROOT / "labkit").as_posix().strip(".")
        folders.setdefault(folder, []).append((name, path))
    order = sorted(folders, key=lambda f: (f.startswith(WING), list(TITLES).index(f) if f in TITLES else 99, f))
    for folder in order:
        yield f"\n### {TITLES.get(folder, f'`labkit/{folder}/`')}\n\n"
        for _, path in sorted(folders[folder], key=lambda pair: (pair[1].stem != "__init__", pair[1].stem)):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            first = (ast.get_docstring(tree) or "").split("\n\n")[0].replace("\n", " ")
            kinds = ast.FunctionDef | ast.ClassDef
            names = [node.name for node in tree.body if isinstance(node, kinds) and not node.name.startswith("_")]
            yield f"- **{path.stem}** {first}" + (f" *{', '.join(names)}*" if names else "") + "\n"


if __name__ == "__main__":
    text = page()
    PAGE.write_text(text, encoding="utf-8", newline="\n")
    print(PAGE)
