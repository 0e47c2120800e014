"""Whose code is more alike than the class's is among itself, or nearly all the same."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...notebook.read import read as read_notebook
from .fingerprints import hashes, shared, winnowed
from .stretches import Piece, marked, pieces, stretches
from .tokens import Code, fields_of, read

LEAST = 12.0  # rare fingerprints that two must share, some five lines: less comes about by itself
BY_CHANCE = 0.1  # pairs of a class that are told although nothing is behind them, were all spread as most are
FEW = 10  # pairs, below which a class has no spread
NEARLY = 0.8  # of one's own fingerprints that a copy shares, since another order of the parts loses some at each joint
MANY = 4, 10  # students, or one of so many of a class: what more than these have is nobody's own
BELOW = 3  # pairs that are named although they are not told
SHOWN = 30  # pairs side by side
BREAK = "\n\n"


class Given(NamedTuple):
    """What is not a student's own. runs (k,): sorted hashes of the release's code;  cells: its cells, as written;
    fields: names behind a dot in it;  usual (m,): hashes of the model solution.
    """

    runs: NDArray[np.uint64]
    cells: frozenset[str]
    fields: frozenset[str]
    usual: NDArray[np.uint64]


class Side(NamedTuple):
    """One of two codes. same: tokens in stretches;  own: tokens that were not given."""

    label: str
    same: int
    own: int
    pieces: Sequence[Piece]


class Pair(NamedTuple):
    """Two who share more than is likely. amount: see `shared`;  alone: fingerprints that nobody else has."""

    first: Side
    second: Side
    amount: float
    alone: int
    stretches: int


class Likeness(NamedTuple):
    """A class compared. amounts: of all pairs;  threshold: from which on they are told;  pairs: the most alike first;
    more: labels and amounts of those that are not shown;  below: of the most alike of those that are not told;
    spread: whether the threshold comes from this class.
    """

    students: int
    amounts: Sequence[float]
    threshold: float
    spread: bool
    pairs: Sequence[Pair]
    more: Sequence[tuple[str, str, float]]
    below: Sequence[tuple[str, str, float]] = ()


def given(root: Path, lab: str) -> Given:
    """What came with a lab, and what its solution has. Raises NotebookError."""
    books = {path.stem: read_notebook(path) for path in sorted((root / "notebooks").glob("[0-9]*.ipynb"))}
    cells = {name: [cell.source for cell in book if cell.code] for name, book in books.items()}
    modules = [path for path in (root / "labkit").rglob("*.py") if "instructor" not in path.parts]
    texts = [BREAK.join(sources) for sources in cells.values()]
    fields = frozenset().union(*map(fields_of, texts))
    texts += [path.read_text(encoding="utf-8") for path in modules]
    runs = np.unique(np.concatenate([hashes(read(text, fields)) for text in texts]))
    solved = BREAK.join(cell.source for cell in read_notebook(root / "solutions" / f"{lab}.ipynb") if cell.code)
    own = frozenset(source.strip() for source in cells.get(lab, ()))
    return Given(runs, own, fields, hashes(read(solved, fields)))


def compare(sources: Mapping[str, Mapping[str, str]], of: Given, together: Iterable[Collection[str]] = ()) -> Likeness:
    """Compare all with all. sources: {label: {name of a cell or module: its text}};  together: labels of who works
    together, who are not compared with each other.
    """
    codes = [read(_own(cells, of), of.fields) for cells in sources.values()]
    prints = [winnowed(hashes(code), of.runs) for code in codes]
    found = shared(prints, of.usual)
    labels, group = [*sources], {label: n for n, members in enumerate(together) for label in members}
    groups = np.array([group.get(label, -1 - n) for n, label in enumerate(labels)])
    first, second = np.triu_indices(len(codes), 1)
    apart = groups[first] != groups[second]
    first, second = first[apart], second[apart]
    amounts = found[first, second]
    threshold = likely(amounts)
    every = [int(at) for at in np.argsort(-amounts, kind="stable")]
    own = _own_prints(prints, of)
    copied = {at for at in every if _nearly(*([has[first[at]], has[second[at]]] for has in (prints, own)))}
    order = [at for at in every if amounts[at] > threshold or at in copied]
    pairs = [_pair(labels, codes, prints, found, of, int(first[at]), int(second[at])) for at in order[:SHOWN]]
    below = [at for at in every if 0 < amounts[at] <= threshold and at not in copied][:BELOW]
    names = [(labels[one], labels[two]) for one, two in zip(first, second)]
    more, less = ([(*names[at], float(amounts[at])) for at in some] for some in (order[SHOWN:], below))
    return Likeness(len(codes), amounts.tolist(), threshold, len(amounts) >= FEW, pairs, more, less)


def _own_prints(prints: Sequence[NDArray[np.uint64]], of: Given) -> list[NDArray[np.uint64]]:
    """Of each one's fingerprints those that neither the model solution nor many have."""
    every, count = np.unique(np.concatenate([*prints, np.zeros(0, np.uint64)]), return_counts=True)
    usual = np.union1d(every[count > max(MANY[0], len(prints) // MANY[1])], of.usual)
    return [np.setdiff1d(has, usual) for has in prints]


def _nearly(prints: Sequence[NDArray[np.uint64]], own: Sequence[NDArray[np.uint64]]) -> bool:
    """Whether nearly all that one of two wrote is the other's, and enough of it is what few have.

    prints: the fingerprints of each of the two;  own: those of `_own_prints`.
    """
    if min(map(len, own)) < LEAST:
        return False
    rare, every = (len(np.intersect1d(one, other, True)) for one, other in (own, prints))
    return rare >= max(LEAST, NEARLY * min(map(len, own))) and every >= NEARLY * min(map(len, prints))


def likely(amounts: NDArray[np.float64]) -> float:
    """What pairs of a class share at most if they share it as most pairs do. amounts: of all pairs, (n,).

    The roots of the amounts are taken for normal; their median and their median distance from it say which normal
    distribution most pairs have, whatever a few copies are like.
    """
    if len(amounts) < FEW:
        return LEAST
    roots = np.sqrt(amounts)
    middle = np.median(roots)
    scale = np.median(np.abs(roots - middle)) / NormalDist().inv_cdf(0.75)
    return max(LEAST, float(middle + NormalDist().inv_cdf(1 - BY_CHANCE / len(amounts)) * scale) ** 2)


def _own(cells: Mapping[str, str], of: Given) -> str:
    return BREAK.join(text for text in cells.values() if text.strip() not in of.cells)


def _pair(
    labels: Sequence[str], codes: Sequence[Code], prints: Sequence, found: NDArray, of: Given, one: int, other: int
) -> Pair:
    same = stretches(codes[one], codes[other], of.runs)
    first = _side(labels[one], codes[one], [(run.first, run.length) for run in same], of)
    second = _side(labels[other], codes[other], [(run.second, run.length) for run in same], of)
    others = [has for at, has in enumerate(prints) if at not in (one, other)]
    common = np.intersect1d(prints[one], prints[other])
    alone = int((~np.isin(common, np.concatenate([*others, np.zeros(0, np.uint64)]))).sum())
    return Pair(first, second, float(found[one, other]), alone, len(same))


def _side(label: str, code: Code, where: Sequence[tuple[int, int]], of: Given) -> Side:
    known, covered = marked(code, of.runs), np.zeros(len(code.words), dtype=bool)
    for start, length in where:
        covered[start : start + length] = True
    return Side(label, int(covered.sum()), int((~known | covered).sum()), pieces(code, where, known))
