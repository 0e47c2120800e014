"""`labkit release`: what students get, as a folder or a zip, proven to hold no answer.

Nothing is written before all of it is read and searched, so what was searched is what is handed out.
"""

import re
import stat
import sys
import zipfile
from collections.abc import Collection
from pathlib import Path
from typing import TypeAlias

from ...notebook import variant
from .. import files
from ..records import CommandError
from ..trouble import why
from . import glossary
from .leaks import leaks, released

ROOT = Path(__file__).resolve().parents[3]
TOP = "localization-labs"  # the folder in the zip

Kit: TypeAlias = dict[str, tuple[bytes, int]]  # path: content and mode of a file

# What is in, rather than what is out: a file that nobody thought of stays at home.
FILES = (
    "LICENSE",
    "environment.yml",
    "lab.py",
    "pyproject.toml",
    "requirements.txt",
    "docs/students.md",
    glossary.PAGE,
    "docs/pictures/lab1-explore.png",
    "labkit/jupyter/overrides.json",
    "labkit/notebook/given.json",
)
# For those who put the kit where git, Binder, Codespaces or VS Code find it; a project may be without.
ELSEWHERE = (
    ".gitignore",
    ".binder/postBuild",
    ".binder/requirements.txt",
    ".binder/runtime.txt",
    ".devcontainer/devcontainer.json",
    ".vscode/extensions.json",
)
# Of labkit everything is in but what instructors and maintainers run.
WING = "labkit/instructor"
README = "labkit/instructor/authoring/student_readme.md"

CHECK = re.compile(r"""^check\(\s*["']([\w-]+)["']""", re.M)


def main(out: Path | str, force: bool = False, course: str = "") -> int:
    """Make the students' kit of the project that this file is in; returns the exit status.

    course: whose students are asked for their number, and get numbers of their own; '' if all have the same.
    """
    try:
        paths = release(ROOT, out, force, variant.text(course, "") if course else "")
    except CommandError as problem:
        print(f"labkit release: {problem}", file=sys.stderr)
        return 2
    print(f"{out}: {len(paths)} files. No line of a solution or of a hidden cell is in them.")
    return 0


def release(root: Path | str, out: Path | str, force: bool = False, own: str = "") -> list[str]:
    """Write the students' kit of the project in `root` to `out`; the sorted paths in it. Raises CommandError.

    out: a folder, new or empty, or a new file that ends in .zip; force: write over a zip; own: the text of a
    variant.toml beside the notebooks, '' for none.
    """
    root, out = Path(root), Path(out)
    zipped = out.name.lower().endswith(".zip")
    try:
        _refuse_taken(out, zipped, force)
        kit = proven(root)
        if own:
            kit[f"notebooks/{variant.FILE}"] = own.encode(), 0o644
        out.parent.mkdir(parents=True, exist_ok=True)
        (_write_zip if zipped else _write_folder)(kit, out)
    except OSError as error:
        what = f"{error.filename or out} cannot be read or written"
        raise CommandError(f"{what}: {why(error)}.") from None
    return sorted(kit)


def proven(root: Path, labs: Collection[str] = ()) -> Kit:
    """The students' kit, searched: all of it, or with no other labs than these. Raises CommandError and OSError."""
    kit = collect(root)
    if problems := list(leaks(_scripts(root), kit)):
        raise CommandError("\n".join(["Nothing was written, as students would get too much:", *problems]))
    return collect(root, labs) if labs else kit


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


def collect(root: Path, labs: Collection[str] = ()) -> Kit:
    """All that students get, by default of all labs. Raises CommandError and OSError."""
    labs = [script.stem for script in _scripts(root) if not labs or script.stem in labs]
    own = [
        path.relative_to(root).as_posix() for path in (root / "labkit").rglob("*") if path.suffix in (".py", ".toml")
    ]
    modules = [path for path in own if not path.startswith(f"{WING}/")]
    notebooks = [f"notebooks/{lab}.ipynb" for lab in labs]
    paths = [*FILES, *(name for name in ELSEWHERE if (root / name).is_file()), *modules, *notebooks]
    kit = {path: _take(root / path) for path in paths}
    cells = {path: released(path, kit[path][0]) for path in notebooks}
    # Only the checks that the notebooks call: what the graded ones know stays here.
    for check in {name for each in cells.values() for cell in each for name in CHECK.findall(cell.source)}:
        path = f"labkit/checks/data/{check}.json"
        kit[path] = _take(root / path)
    titles = [cells[path][0].source.partition("\n")[0].lstrip("# ") for path in notebooks]
    links = "\n".join(f"- [{title}]({path})" for title, path in zip(titles, notebooks))
    readme, mode = _take(root / README)
    for word, text in (("{labs}", links), ("{first}", notebooks[0])):
        readme = readme.replace(word.encode(), text.encode())
    return kit | {"README.md": (readme, mode)}


def _scripts(root):
    scripts = sorted((root / "solutions").glob("[0-9]*_*.py"))
    if not scripts:
        raise CommandError(f"{root} holds no solutions/NN_name.py: a release is made from the full kit.")
    for name in (script.stem for script in scripts):
        if not (root / "notebooks" / f"{name}.ipynb").is_file():  # as after `labkit new`
            raise CommandError(f"{name} has no notebook yet: run `labkit build {name}` first.")
    return scripts


def _take(path):
    # Only whether a file can be run is its own; the rest of its mode is that of whoever checked it out.
    return path.read_bytes(), 0o755 if path.stat().st_mode & stat.S_IXUSR else 0o644


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
