"""`labkit mark`: from a graded class to marks of all written answers, and then to tables and pages."""

import contextlib
import os
import re
import secrets
import socket
import stat
import tempfile
import webbrowser
from argparse import Namespace
from contextlib import closing
from html import escape
from pathlib import Path
from urllib.parse import quote

from tornado.netutil import bind_sockets

from ..command import alone, run, write_out
from ..exam.paper import read as read_paper
from ..records import CommandError
from ..report import told
from ..report.gradebook import Gradebook
from ..report.taken import take_hand_marks
from ..report.texts import clean
from ..trouble import why
from .desk import Desk
from .server import name_of, serve

DOOR = "marking.html"  # leads a browser to the server, and keeps its token for the next time


def main(args: Namespace) -> int:
    """Run the command with parsed arguments; returns the exit status."""
    return run("mark", mark, args)


def mark(args: Namespace) -> int:
    """Serve the written answers in the folder args.out until Ctrl-C, then write out what has changed.

    Raises CommandError.
    """
    out = Path(args.out)
    book = out / "gradebook.db"
    if not book.is_file():
        raise CommandError(f"{out} holds no gradebook.db: name the folder that labkit grade wrote into (its --out).")
    if args.reader is not None and (not args.reader or name_of(args.reader) != args.reader):
        raise CommandError("--reader: write a name of 1 to 60 letters, such as --reader Ada.")
    with closing(Gradebook(book)) as grades:
        grades.db.execute("PRAGMA busy_timeout = 500")  # [ms] a page tries again by itself; others are not to wait
        desk = Desk(grades)
        if not desk.questions:
            raise CommandError(f"{out} holds no written answers: grade a lab that has a written question first.")
        listening = _listen(args.port)
        port = listening[0].getsockname()[1]
        token = _token(out / DOOR)
        address = f"http://127.0.0.1:{port}/{token}/" + (f"{quote(args.reader, safe='')}/" if args.reader else "")
        with contextlib.suppress(KeyboardInterrupt):
            _open_door(out / DOOR, token, address, not args.no_browser)
            print(f"Mark here: {address}")
            print("Whoever has this address may mark. Ctrl-C ends, and writes tables and pages.", flush=True)
            serve(desk, listening, token, args.reader or "")
    print()
    return finish(out)


def _listen(port: int) -> list[socket.socket]:
    try:
        return bind_sockets(port, "127.0.0.1", family=socket.AF_INET)
    except OSError as error:
        raise CommandError(
            f"Port {port} cannot be used: {why(error)}. Perhaps another labkit mark runs: go on in its page, or "
            f"choose another with --port {port + 1 if port < 65535 else 8600}."
        ) from None


def _token(door: Path) -> str:
    """The token of the time before, if nobody else can have read it: a page that is still open then goes on."""
    with contextlib.suppress(OSError, UnicodeDecodeError):
        about = door.stat()
        closed = os.name == "nt" or about.st_uid == os.getuid() and not stat.S_IMODE(about.st_mode) & 0o077
        found = re.search(r"http://127\.0\.0\.1:\d+/([\w-]{43})/", door.read_text(encoding="utf-8"))
        if closed and found:
            return found[1]
    return secrets.token_urlsafe(32)


def _open_door(door: Path, token: str, address: str, browser: bool) -> None:
    """Write the page that leads to the server, and show it: an address in a command line could be read by others."""
    page = f'<!DOCTYPE html><meta charset="utf-8"><meta http-equiv="refresh" content="0; url={escape(address)}">'
    try:
        file, part = tempfile.mkstemp(dir=door.parent, prefix=door.stem)  # nobody else may read it
        try:
            with open(file, "w", encoding="utf-8") as leaf:
                leaf.write(page)
            os.replace(part, door)  # in one step: another server that begins just now finds the token
        finally:
            Path(part).unlink(missing_ok=True)
    except OSError as error:
        raise CommandError(f"{door} cannot be written: {why(error)}.") from None
    if browser:
        webbrowser.open(door.resolve().as_uri())


def finish(out: Path) -> int:
    """Write tables, pages and the LMS's files anew where marks have changed since; returns the exit status."""
    status = 0
    with alone(out), closing(Gradebook(out / "gradebook.db")) as book:
        take_hand_marks(book, out / "grades.csv")
        labs = told.outdated(book)
        for lab in labs:
            args = told.recall(book, lab)
            for of in ("moodle", "canvas"):
                if (path := getattr(args, of)) and not Path(path).is_file():
                    print(f"Note: {clean(path)} is not there any more: it is filled in when labkit grade runs again.")
                    setattr(args, of, None)
            status = max(status, write_out(book, read_paper(lab), out, args))
    if not labs:
        print("No mark has changed since tables and pages were written.")
    return status
