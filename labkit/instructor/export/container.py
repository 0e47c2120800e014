"""`labkit export gradescope`: an autograder for each lab, a zip that holds the full kit."""

import io
import json
import secrets
import stat
import zipfile
from collections.abc import Sequence
from pathlib import Path

from ..authoring.release import ROOT, Kit
from ..exam.paper import read
from . import SETTINGS

TEMPLATES = Path(__file__).with_name("templates")
SCRIPTS = ("setup.sh", "run_autograder")  # Gradescope wants them at the top of the zip
ALONE = ("LICENSE", "lab.py", "pyproject.toml", "requirements.txt", "tests/requirements.txt")


def files(labs: Sequence[str], allowed: Sequence[str]) -> Kit:
    """{LAB.zip: (content, mode)}. allowed: see `ALLOWED`. Raises CommandError for what is no lab with points."""
    return {f"{lab}.zip": (autograder(lab, allowed), 0o644) for lab in labs}


def autograder(lab: str, allowed: Sequence[str]) -> bytes:
    """The zip of a lab. Raises CommandError."""
    read(lab)
    settings = {"lab": lab, "seed": secrets.randbelow(2**31), "allowed": [*allowed]}
    content = {SETTINGS: (json.dumps(settings, indent=1).encode(), 0o644)}
    for name in SCRIPTS:
        content[name] = (TEMPLATES / f"{name}.txt").read_text(encoding="utf-8").encode(), 0o755
    content |= {f"kit/{path.relative_to(ROOT).as_posix()}": (path.read_bytes(), 0o644) for path in _kit(lab)}
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, (data, mode) in sorted(content.items()):
            info = zipfile.ZipInfo(path, date_time=(1980, 1, 1, 0, 0, 0))
            info.create_system, info.external_attr = 3, (stat.S_IFREG | mode) << 16  # as on Unix, wherever it is made
            archive.writestr(info, data, zipfile.ZIP_DEFLATED)
    return packed.getvalue()


def _kit(lab):
    """The files that grading a lab needs: of the other labs nothing but what their checks know."""
    wanted = [*(ROOT / "labkit").rglob("*"), *(ROOT / "solutions" / "checks").rglob("*")]
    wanted += [ROOT / folder / f"{lab}.ipynb" for folder in ("solutions", "notebooks")]
    wanted += [ROOT / name for name in ALONE]
    return [path for path in wanted if path.is_file() and "__pycache__" not in path.parts]
