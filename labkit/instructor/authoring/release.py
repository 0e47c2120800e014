"""`labkit release`: what students get, as a folder or a zip, proven to hold no answer.

Nothing is written before all of it is read and searched, so what was searched is what is handed out.
"""

import ast
import json
import re
import stat
import sys
import textwrap
import zipfile
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

from .. import files
from ..records import CommandError

ROOT = Path(__file__).resolve().parents[3]
TOP = "localization-labs"  # the folder in the zip

# What is in, rather than what is out: a file that nobody thought of stays at home.
FILES = (
    "LICENSE",
    "environment.yml",
    "lab.py",
    "pyproject.toml",
    "requirements.txt",
    "docs/students.md",
    "docs/pictures/lab1-explore.png",
    "labkit/jupyter/overrides.json",
)
# Of labkit everything is in but what instructors and maintainers run.
WING = "labkit/instructor"
README = "labkit/instructor/authoring/student_readme.md"

# Shorter pieces, counted without white space, stand in much that gives nothing away.
TELLING = 20

_BLOCK = re.compile(r"^[ \t]*### BEGIN (SOLUTION|HIDDEN TESTS)\n(.*?)^[ \t]*### END \1[ \t]*\n?", re.M | re.S)
_STUB = re.compile(r"^[ \t]*raise NotImplementedError\(.*\)$|^\*Write your answer here.*\*$", re.M)
_CHECK = re.compile(r"""^check\(\s*["']([\w-]+)["']""", re.M)


def main(out, force=False):
    """Make the students' kit of the project that this file is in; returns the exit status."""
    try:
        paths = release(ROOT, out, force)
    except CommandError as problem:
        print(f"labkit release: {problem}", file=sys.stderr)
        return 2
    print(f"{out}: {len(paths)} files. No line of a solution or of a hidden cell is in them.")
    return 0


def release(root, out, force=False):
    """Write the students' kit of the project in `root` to `out`; the sorted paths in it. Raises CommandError.

    out: a folder, new or empty, or a new file that ends in .zip; force: write over a zip.
    """
    root, out = Path(root), Path(out)
    zipped = out.name.lower().endswith(".zip")
    try:
        _refuse_taken(out, zipped, force)
        kit = collect(root)
        if problems := list(leaks(root, kit)):
            raise CommandError("\n".join(["Nothing was written, as students would get too much:", *problems]))
        out.parent.mkdir(parents=True, exist_ok=True)
        (_write_zip if zipped else _write_folder)(kit, out)
    except OSError as error:
        what = f"{error.filename or out} cannot be read or written"
        raise CommandError(f"{what}: {error.strerror or error}.") from None
    return sorted(kit)


def _refuse_taken(out, zipped, force):
    if zipped and out.is_dir():
        raise CommandError(f"{out} is a folder: give the zip another name.")
    if zipped and out.exists() and not force:
        raise CommandError(f"{out} is there already: give the zip another name, or use --force.")
    if not zipped and out.exists() and not out.is_dir():
        raise CommandError(f"{out} is a file: name a new folder, or a file that ends in .zip.")
    if not zipped and out.exists() and any(out.iterdir()):
        raise CommandError(f"{out} is not empty: name a new folder. No file is deleted, not even with --force.")


# What is in it --------------------------------------------------------------------------------


def collect(root):
    """{path: (its bytes, its mode)} of all that students get. Raises CommandError and OSError."""
    labs = [script.stem for script in _scripts(root)]
    modules = [path.relative_to(root).as_posix() for path in (root / "labkit").rglob("*.py")]
    modules = [path for path in modules if not path.startswith(f"{WING}/")]
    notebooks = [f"notebooks/{lab}.ipynb" for lab in labs]
    paths = [*FILES, *modules, *notebooks]
    kit = {path: _take(root / path) for path in paths}
    cells = {path: _notebook(path, kit[path][0])["cells"] for path in notebooks}
    # Only the checks that the notebooks call: what the graded ones know stays here.
    for check in {name for each in cells.values() for cell in each for name in _CHECK.findall(_source(cell))}:
        path = f"labkit/checks/data/{check}.json"
        kit[path] = _take(root / path)
    titles = [_source(cells[path][0]).partition("\n")[0].lstrip("# ") for path in notebooks]
    links = "\n".join(f"- [{title}]({path})" for title, path in zip(titles, notebooks))
    readme, mode = _take(root / README)
    for word, text in (("{labs}", links), ("{first}", notebooks[0])):
        readme = readme.replace(word.encode(), text.encode())
    return kit | {"README.md": (readme, mode)}


def _scripts(root):
    scripts = sorted((root / "solutions").glob("[0-9]*_*.py"))
    if not scripts:
        raise CommandError(f"{root} holds no solutions/NN_name.py: a release is made from the full kit.")
    return scripts


def _take(path):
    # Only whether a file can be run is its own; the rest of its mode is that of whoever checked it out.
    return path.read_bytes(), 0o755 if path.stat().st_mode & stat.S_IXUSR else 0o644


def _notebook(path, data):
    try:
        notebook = json.loads(data)
        [_source(cell) for cell in [notebook["cells"][0], *notebook["cells"]]]
    except (ValueError, KeyError, TypeError, IndexError):
        raise CommandError(f"{path} is not a notebook with cells: `labkit build` makes it anew.") from None
    return notebook


def _source(cell):
    return "".join(cell["source"])  # one text, or a list of lines


# What must not be in it -----------------------------------------------------------------------


@dataclass(frozen=True)
class Cell:
    """A cell of solutions/NN_name.py: what students see of it, and the texts that they must not see."""

    name: str
    code: bool
    hidden: bool
    visible: str
    secrets: list


def leaks(root, kit):
    """Sentences on what stands in the kit although students must not see it."""
    scripts = {script.stem: _cells(script) for script in _scripts(root)}
    for lab, cells in scripts.items():
        path = f"notebooks/{lab}.ipynb"
        yield from _unlike_source(path, lab, cells, _notebook(path, kit[path][0]))
    secrets = _secrets(scripts)
    for path, (data, _) in kit.items():
        if path.endswith(".png"):
            continue
        texts = _texts(path, data)
        bare = _bare("\n".join(texts))
        for piece, (where, told) in secrets.items():
            if piece in bare:
                yield f"{path} holds `{told}`, which is secret in {where}."
        if "labkit/checks/data/" in path:
            code = [text for text in texts if _is_code(text)]
            yield from (f"{path} holds code, `{text}`: checks store numbers and sentences." for text in code)


def _cells(script):
    """The list of Cell of a script in jupytext's percent format."""
    found = []
    for number, part in enumerate(re.split(r"^# %%", script.read_text(encoding="utf-8"), flags=re.M)[1:], 1):
        head, _, source = part.partition("\n")
        code = "[markdown]" not in head
        if not code:
            source = re.sub(r"^# ?", "", source, flags=re.M)
        id = re.search(r'\bid="([^"]*)"', head)
        name = f"cell '{id[1]}'" if id else f"cell {number}"
        hidden = bool(re.search(r'\btags=\[[^\]]*"hidden"', head))
        visible = _BLOCK.sub("\n", source)
        secrets = [source] if hidden else [match[2] for match in _BLOCK.finditer(source)]
        if not hidden and ("SOLUTION" in visible or "HIDDEN TESTS" in visible):
            raise CommandError(f"solutions/{script.name}, {name}: a solution or hidden marker lacks its partner.")
        found.append(Cell(name, code, hidden, "" if hidden else visible, secrets))
    return found


def _secrets(scripts):
    """{a piece without white space: (where it stands, the piece)} of all that students must not see.

    A piece that a lab also shows outside of its solutions and hidden cells is no secret: its author
    says there, mostly in a hint, what to write.  The script decides on that and not the notebook,
    so that a notebook cannot excuse itself.
    """
    shown = _bare("".join(cell.visible for cells in scripts.values() for cell in cells))
    secrets = {}
    for lab, cells in scripts.items():
        for cell in cells:
            for piece in (piece for text in cell.secrets for piece in _pieces(text, cell.code)):
                if _bare(piece) not in shown:
                    secrets.setdefault(_bare(piece), (f"solutions/{lab}.py, {cell.name}", piece))
    return secrets


def _pieces(text, code):
    """The lines of a text, and the sentences of one that is not code: it may have been wrapped anew."""
    pieces = text.splitlines() + ([] if code else re.split(r"(?<=[.:;?!])\s+", text))
    telling = [" ".join(piece.split()) for piece in pieces if len(_bare(piece)) >= TELLING]
    # A solution of short lines only tells as a whole.
    return telling or [" ".join(text.split())] * (len(_bare(text)) >= TELLING)


def _unlike_source(path, lab, cells, notebook):
    """Sentences on outputs in a notebook, and on cells that are not what the script leaves for students.

    That finds what a search for known lines cannot: an answer that someone tried out in the notebook.
    """
    anew = "`labkit build` makes it anew."
    if "widgets" in notebook.get("metadata", {}):
        yield f"{path} holds the states of widgets: {anew}"
    for cell in notebook["cells"]:
        if cell.get("outputs") or cell.get("execution_count") is not None or cell.get("attachments"):
            yield f"{path}, cell '{cell.get('id')}' was run and holds outputs: {anew}"
    seen = [cell for cell in cells if not cell.hidden]
    for due, cell in zip_longest(seen, notebook["cells"]):
        if due is None or cell is None or _visible(due.visible) != _visible(_source(cell)):
            name = due.name if due else f"cell '{cell.get('id')}'"
            yield f"{path}, {name} is not what solutions/{lab}.py leaves for students: {anew}"
            return


def _visible(source):
    return _bare(_STUB.sub("", source))


def _bare(text):
    """The text without white space, so that neither indenting nor wrapping makes another line of it."""
    return "".join(text.split())


def _texts(path, data):
    """The texts in a file: all strings of a JSON file, whose quotes and line breaks are escaped there."""
    try:
        text = data.decode("utf-8")
        return list(_strings(json.loads(text))) if path.endswith((".json", ".ipynb")) else [text]
    except ValueError:
        raise CommandError(f"{path} cannot be searched: it is not UTF-8 text, or not JSON.") from None


def _strings(value):
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for key, item in value.items():
            yield key
            yield from _strings(item)
    elif isinstance(value, list):
        for item in value:
            yield from _strings(item)


def _is_code(text):
    """Whether a text is a Python statement; single words and names with dashes are just expressions."""
    try:
        tree = ast.parse(textwrap.dedent(text).strip())
    except (SyntaxError, ValueError):
        return False
    return any(not isinstance(node, ast.Expr) for node in tree.body)


# Writing --------------------------------------------------------------------------------------


def _write_folder(kit, out):
    for path, (data, mode) in kit.items():
        target = out / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(data)
        target.chmod(mode)


def _write_zip(kit, out):
    """The same kit gives the same bytes, on any machine."""

    def pack(file):
        with zipfile.ZipFile(file, "w") as archive:
            for path in sorted(kit):
                data, mode = kit[path]
                # Stored and not compressed, as compressors differ from one Python to the next.
                info = zipfile.ZipInfo(f"{TOP}/{path}", date_time=(1980, 1, 1, 0, 0, 0))
                info.create_system, info.external_attr = 3, (stat.S_IFREG | mode) << 16
                archive.writestr(info, data)

    files.write(out, pack)
