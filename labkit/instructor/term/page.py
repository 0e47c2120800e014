"""The term as a page for the instructor."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

from ..report.names import page_names
from ..report.pages import environment
from ..report.ways import HERE
from .overview import BINS, Got, Lab, Term

WIDE, TALL = 160, 36  # of the small picture of a lab's spread, in units of its drawing
SIMILAR = "similar-{}.html"
_ENVIRONMENT = environment(__package__, "labkit.instructor.report")


class Cell(NamedTuple):
    """A lab of a student in the table: points as text, '' if there is nothing; signs and what they say."""

    points: float | None
    link: str
    signs: Sequence[tuple[str, str]]


class Picture(NamedTuple):
    """A lab's spread: (left, top, width, height) of each bar, and in words."""

    bars: Sequence[tuple[float, float, float, float]]
    words: str


SIGNS = {
    "waiting": ("…", "not marked to the end"),
    "late": ("◷", "late"),
    "ruled": ("*", "after a rule of the course"),
    "unfit": ("✗", "not graded"),
    "missing": ("–", "not handed in"),
}


def term_page(term: Term, links: Mapping[tuple[str, str], str], more: Mapping[str, Sequence[tuple[str, str]]]) -> str:
    """The HTML of a term.

    links: {(lab, label): address} of students' pages;  more: {lab: (address, words)} of other pages.
    """
    template = _ENVIRONMENT.get_template("term.html.j2")
    totals = sorted(row.total for row in term.rows if row.total is not None)
    return template.render(
        term=term,
        signs=[*SIGNS.values()],
        rows=[(row, [_cell(lab.name, row.got.get(lab.name), links) for lab in term.labs]) for row in term.rows],
        labs=[(lab, picture(lab), more.get(lab.name, ())) for lab in term.labs],
        short={lab.name: lab.short for lab in term.labs},
        totals=totals,
        top=max((slip.students for slip in term.slips), default=1),
    )


def links(out: Path, term: Term) -> dict[tuple[str, str], str]:
    """{(lab, label): address} of the students' pages that are in the folder `out`."""
    found = {}
    for lab in term.labs:
        got = sorted((row.got[lab.name] for row in term.rows if lab.name in row.got), key=lambda one: one.place)
        folder = out / "feedback" / lab.name
        there = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
        names = page_names([one.result for one in got])
        found.update({(lab.name, label): quote(f"feedback/{lab.name}/{n}") for label, n in names.items() if n in there})
    return found


def others(out: Path, term: Term) -> dict[str, list[tuple[str, str]]]:
    """{lab: (address, words)} of the pages about a lab that are in the folder `out`."""
    pages = {"the class": HERE["class"], "written answers": HERE["marking"], "similar code": SIMILAR}
    names = {lab.name: [(page.format(lab.name), words) for words, page in pages.items()] for lab in term.labs}
    return {lab: [(quote(name), words) for name, words in of if (out / name).is_file()] for lab, of in names.items()}


def picture(lab: Lab) -> Picture:
    """The small picture of how a lab's points are spread."""
    top, each = max(*lab.bins, 1), WIDE / BINS
    bars = [(at * each + 1, TALL - TALL * n / top, each - 2, TALL * n / top) for at, n in enumerate(lab.bins) if n]
    told = [f"{100 * at // BINS} to {100 * (at + 1) // BINS} %: {count}" for at, count in enumerate(lab.bins) if count]
    return Picture([tuple(round(side, 1) for side in bar) for bar in bars], "; ".join(told))  # type: ignore[misc]


def _cell(lab: str, got: Got | None, links: Mapping[tuple[str, str], str]) -> Cell:
    if got is None:
        return Cell(None, "", [SIGNS["missing"]])
    states = {"unfit": bool(got.result.problem), "late": got.result.late, "ruled": got.result.raw != got.points}
    states["waiting"] = not got.final and not states["unfit"]
    points = None if states["unfit"] else got.points
    return Cell(points, links.get((lab, got.label), ""), [SIGNS[name] for name in SIGNS if states.get(name)])
