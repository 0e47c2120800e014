"""What to say when the computer itself cannot: the cause, as the system names it, and the cure."""

import errno
import sys
from collections.abc import Callable

from .records import CommandError

CURES = {
    errno.ENOSPC: "there is no room left; make room on that disk",
    getattr(errno, "EDQUOT", errno.ENOSPC): "you may not use more of that disk; delete something of yours there",
    errno.EFBIG: "a file may not become as large; ask who runs this machine, or choose another place",
    errno.EROFS: "nothing can be written on that disk; choose a place on another one",
    errno.EISDIR: "a folder is where a file should be; move it away",
    errno.ENOTDIR: "a file is where a folder should be; move it away",
    errno.EEXIST: "something else is there; move it away",
    errno.EMFILE: "this process may not open more files; close what else runs here",
    errno.EPIPE: "nobody reads any more what this prints; let the other command read to the end",
}


def why(error: OSError) -> str:
    """'No space left on device: there is no room left; make room on that disk', without a full stop."""
    said = error.strerror or str(error) or type(error).__name__
    cure = CURES.get(error.errno or 0, "")
    return f"{said}: {cure}" if cure else said


def sentence(error: OSError) -> str:
    """The same with the file that it is about, where that is known."""
    return f"{error.filename}: {why(error)}." if error.filename else f"{why(error)}."


def ended(name: str, work: Callable[[], None]) -> int:
    """The exit status of a command whose work is this: 0, or 2 where a sentence has told what stopped it."""
    try:
        work()
    except CommandError as problem:
        print(f"{name}: {problem}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"{name}: {sentence(error)}", file=sys.stderr)
        return 2
    return 0
