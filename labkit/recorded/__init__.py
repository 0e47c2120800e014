"""Recorded runs as files: where they are, and the forms in which a Log is saved and loaded."""

import os
from pathlib import Path
from typing import Any

from ..checks.feedback import LabError


class DataError(LabError):
    """A data file or folder is not what it should be; the text says what, where and what to do."""


def folder() -> Path:
    """The data folder (which need not exist): $LABKIT_DATA, or `data` in the project or current folder."""
    named = os.environ.get("LABKIT_DATA")
    if named:
        return Path(named).expanduser()
    project = Path(__file__).resolve().parents[2]
    return (project if (project / "notebooks").is_dir() else Path.cwd()) / "data"


def text_of(path: Path) -> str:
    """The text of a file; DataError if it cannot be read or is none."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise DataError(f"{path} is no text in UTF-8: save it as UTF-8, or get the original file again") from None
    except OSError as error:
        raise DataError(f"{path} cannot be read: {error.strerror or error}") from None


def fields(place: str | Path) -> dict[str, Any]:
    """The fields of the Log in a folder, or in the data folder's of that name, in whichever form it is."""
    from . import freiburg, plain

    path = Path(place).expanduser()
    path = path if path.is_dir() else folder() / path
    if not path.is_dir():
        raise DataError(f"There is no folder {place}, neither here nor in {folder()}: `labkit data` says what is there")
    form = freiburg if any((path / name).is_file() for name in freiburg.FILES) else plain
    return form.fields(path)
