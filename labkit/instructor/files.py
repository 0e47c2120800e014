"""Files for people, written whole or not at all."""

import contextlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from .records import CommandError
from .trouble import why


def write(path: Path | str, content: str | bytes | Callable[[BinaryIO], object]) -> None:
    """Write a file in one step: whatever interrupts it leaves the old file or the new one.

    content: text, to be written as UTF-8 with '?' for halves of characters; bytes; or a function that writes into
    the open file it is given. Raises CommandError if the file cannot be written.
    """
    path = Path(path)
    part = path.with_name(path.name + ".part")  # always this name: what a kill leaves is written over
    try:
        with open(part, "wb") as file:
            if callable(content):
                content(file)
            else:
                file.write(content.encode("utf-8", "replace") if isinstance(content, str) else content)
            file.flush()
            os.fsync(file.fileno())  # else the power may fail between the new name and the new content
        os.replace(part, path)
    except OSError as error:
        reason = why(error)
        if isinstance(error, PermissionError):
            reason = f"{reason}; is it open in a spreadsheet or another program? Close it there and run this again"
        raise CommandError(f"{part if part.is_dir() else path} cannot be written: {reason}.") from None
    finally:
        with contextlib.suppress(OSError):  # it is not there when all went well
            part.unlink()
