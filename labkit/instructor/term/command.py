"""`labkit term` and `labkit similar`: what a gradebook tells of a term, and whose code is alike."""

from argparse import Namespace
from contextlib import closing
from pathlib import Path

from ...notebook.read import NotebookError
from .. import files
from ..exam.exam import ROOT
from ..records import CommandError
from ..report import code
from ..report.gradebook import Gradebook
from ..report.names import labels
from ..report.tables import written_for_excel
from ..report.texts import counted, listed
from ..report.ways import TERM
from . import similar as alike
from .overview import read
from .page import SIMILAR, links, others, term_page
from .points import groups
from .similar_page import similar_page
from .tables import write_csv, write_xlsx


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
    files.write(out / TERM, term_page(term, links(out, term), others(out, term)))
    write_csv(out / "term.csv", term, written_for_excel(out / "grades.csv"))
    write_xlsx(out / "term.xlsx", term)
    return len(term.rows)


def term(args: Namespace) -> int:
    """Write the term of the gradebook in args.out; returns the exit status. Raises CommandError."""
    out = Path(args.out)
    with closing(book_in(out)) as book:
        count = write_term(book, out)
    print(f"{counted(count, 'student')}: see {out / TERM}; the same is in term.csv and term.xlsx.")
    return 0


def similar(args: Namespace) -> int:
    """Write the page of similar code of one lab; returns the exit status. Raises CommandError."""
    out = Path(args.out)
    with closing(book_in(out)) as book:
        if args.lab not in book.labs():
            raise CommandError(f"{out} holds no lab {args.lab!r}; there are: {listed(book.labs()) or 'none'}.")
        kept, results = code.kept(book, args.lab), [*book.results(args.lab)]
        who = {result.id: label for label, result in zip(labels(results), results) if not result.problem}
        try:
            given = alike.given(ROOT, args.lab)
        except NotebookError as error:
            raise CommandError(f"{error} `labkit build` makes it anew.") from None
        label = {(result.student, result.identifier): who.get(result.id, "") for result in results}
        together = [[label.get(person, "") for person in members] for members in groups(book, args.lab)]
        found = alike.compare({who[id]: kept[id] for id in who if id in kept}, given, together)
        path = out / SIMILAR.format(args.lab)
        files.write(path, similar_page(args.lab, found, len(who.keys() - kept.keys())))
        write_term(book, out)
    told = len(found.pairs) + len(found.more)
    print(f"{counted(found.students, 'student')}; {counted(told, 'pair')} to look at: see {path}.")
    if found.students < len(who):
        print("Some were graded before the gradebook kept code: run the same `labkit grade` once more, then this.")
    return 0
