"""`labkit term` and `labkit similar`: what a gradebook tells of a term, and whose code is alike."""

from argparse import Namespace
from contextlib import closing
from pathlib import Path

from .. import files
from ..records import CommandError
from ..report.gradebook import Gradebook
from ..report.tables import written_for_excel
from ..report.texts import counted
from .overview import read
from .page import links, others, term_page
from .tables import write_csv, write_xlsx

PAGE = "term.html"


def book_in(out: Path) -> Gradebook:
    """The gradebook in a folder. Raises CommandError if there is none."""
    path = out / "gradebook.db"
    if not path.is_file():
        raise CommandError(f"{out} holds no gradebook.db: name the folder that labkit grade wrote into (its --out).")
    return Gradebook(path)


def write_term(book: Gradebook, out: Path) -> int:
    """Write page and tables of the term into the folder `out`; returns how many students there are.

    Raises CommandError: a file cannot be written.
    """
    term = read(book)
    files.write(out / PAGE, term_page(term, links(out, term), others(out, term)))
    write_csv(out / "term.csv", term, written_for_excel(out / "grades.csv"))
    write_xlsx(out / "term.xlsx", term)
    return len(term.rows)


def term(args: Namespace) -> int:
    """Write the term of the gradebook in args.out; returns the exit status. Raises CommandError."""
    out = Path(args.out)
    with closing(book_in(out)) as book:
        count = write_term(book, out)
    print(f"{counted(count, 'student')}: see {out / PAGE}; the same is in term.csv and term.xlsx.")
    return 0
