"""`labkit handout`: labs as PDF, printed by a Chromium that is installed."""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from .. import files
from ..records import CommandError

ROOT = Path(__file__).resolve().parents[3]
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge")
PLACES = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
)
PATIENCE = 300  # [s] for one lab


def main(labs: Sequence[str], out: Path | str) -> int:
    """Write OUT/<lab>.pdf of these labs, of all if none is named; exit status.

    Where no browser can print, the pages are left there as HTML, for any browser, and the status is 1.
    """
    from .page import page

    out, known = Path(out), sorted(path.stem for path in (ROOT / "notebooks").glob("[0-9]*_*.ipynb"))
    made: list[Path] = []
    try:
        if not labs and out.name in known:
            raise CommandError(f"{out.name} is a lab: name the folder to write into behind it.")
        if out.is_file():
            raise CommandError(f"{out} is a file: name a folder.")
        pages = {out / f"{lab}.html": page(lab, ROOT) for lab in labs or known}
        out.mkdir(parents=True, exist_ok=True)
        for path, text in pages.items():
            files.write(path, text)
            made.append(path)
        for path in made:
            print_page(path, path.with_suffix(".pdf"))
            path.unlink()
            print(path.with_suffix(".pdf"))
    except CommandError as problem:
        print(f"labkit handout: {problem}", file=sys.stderr)
        return 1 if made else 2
    return 0


def find() -> str:
    """The path of a browser that prints: the one that LABKIT_CHROMIUM names, or the first that is installed.

    Raises CommandError if there is none.
    """
    told = os.environ.get("LABKIT_CHROMIUM")
    found = shutil.which(told) if told else next(filter(None, map(shutil.which, NAMES + PLACES)), None)
    if not found:
        where = (
            f"LABKIT_CHROMIUM names {told!r}, which cannot be run" if told else "no Chromium, Chrome or Edge is found"
        )
        raise CommandError(f"{where}: install one, or let LABKIT_CHROMIUM name it")
    return found


def print_page(page: Path, pdf: Path) -> None:
    """Print a page of HTML; nothing of it is fetched from elsewhere. Raises CommandError."""
    try:
        browser = find()
    except CommandError as problem:
        raise CommandError(f"{problem}. Or open {page} and its like in a browser, and print.") from None
    with tempfile.TemporaryDirectory(prefix="labkit-handout-", ignore_cleanup_errors=True) as profile:
        made = Path(profile) / "page.pdf"
        options = ["--headless", "--disable-gpu", "--no-first-run", "--disable-background-networking"]
        # The page is the kit's own, and its browser's sandbox does not work as root.
        options += ["--no-sandbox"] if getattr(os, "geteuid", lambda: 1)() == 0 else []
        options += [f"--user-data-dir={profile}", "--no-pdf-header-footer", f"--print-to-pdf={made}"]
        try:
            done = subprocess.run(
                [browser, *options, page.resolve().as_uri()], capture_output=True, timeout=PATIENCE, check=False
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise CommandError(f"{browser} did not print {page}: {error}") from None
        if not made.is_file():
            says = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
            raise CommandError(f"{browser} did not print {page}: {' '.join(says) or 'it made no PDF'}")
        files.write(pdf, made.read_bytes())
