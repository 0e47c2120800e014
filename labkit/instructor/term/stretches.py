"""Where two codes are the same: the longest stretches first, as Wise's greedy string tiling takes them."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .fingerprints import NONE, RUN, among, hashes
from .tokens import Code

MOST = 5  # places of a run of tokens at which a stretch may begin: what comes more often is a table, or a trap


class Stretch(NamedTuple):
    """`length` tokens from the token `first` on in one code, and from `second` on in the other."""

    first: int
    second: int
    length: int


class Piece(NamedTuple):
    """A part of a text. number: of the stretch that it is, else 0;  given: whether it came with the lab."""

    text: str
    number: int
    given: bool


def marked(code: Code, given: NDArray[np.uint64]) -> NDArray[np.bool_]:
    """Which of the tokens, (n,), are in a run whose hash is one of those `given`, (k,) sorted."""
    runs = among(hashes(code), given)
    edges = np.zeros(len(code.words) + 1, dtype=int)
    np.add.at(edges, np.flatnonzero(runs), 1)
    np.add.at(edges, np.flatnonzero(runs) + RUN, -1)
    return np.cumsum(edges)[:-1] > 0


def stretches(one: Code, other: Code, given: NDArray[np.uint64]) -> list[Stretch]:
    """What two codes share and was not given, in the order of the first; given (k,): as for `marked`."""
    taken = [[False] * len(code.words) for code in (one, other)]
    found = []
    for first, second, length in sorted(_runs(one, other, given), key=lambda run: (-run[2], run)):
        free = [not (taken[0][first + n] or taken[1][second + n]) for n in range(length)]
        if not any(free):
            continue
        skip = free.index(True)
        size = (free[skip:] + [False]).index(False)
        if size >= RUN:
            found.append(Stretch(first + skip, second + skip, size))
            for of, start in zip(taken, found[-1][:2]):
                of[start : start + size] = [True] * size
    return sorted(found)


def _runs(one: Code, other: Code, given: NDArray[np.uint64]) -> Iterator[Stretch]:
    """All stretches that cannot be made longer."""
    ours, theirs = (np.where(among(of, given), NONE, of).tolist() for of in (hashes(one), hashes(other)))
    places: dict[int, list[int]] = {}
    for place, run in enumerate(theirs):
        places.setdefault(run, []).append(place)
    for place, run in enumerate(ours):
        starts = places.get(run, ())
        for start in starts if run != NONE and len(starts) <= MOST else ():
            if place and start and ours[place - 1] == theirs[start - 1] != NONE:
                continue  # it began before
            length = 1
            while (
                place + length < len(ours)
                and start + length < len(theirs)
                and ours[place + length] == theirs[start + length] != NONE
            ):
                length += 1
            yield Stretch(place, start, length + RUN - 1)


def pieces(code: Code, found: Sequence[tuple[int, int]], given: NDArray[np.bool_]) -> list[Piece]:
    """The text in pieces. found: (first token, tokens) of each stretch, whose number is its place from 1 on;
    given: of `marked`.
    """
    kind = np.where(given, -1, 0)
    for number, (first, length) in enumerate(found, 1):
        kind[first : first + length] = number
    cuts = [0, *(np.flatnonzero(np.diff(kind)) + 1).tolist(), len(kind)] if len(kind) else [0]
    parts, end = [], 0
    for first, after in pairwise(cuts):
        start, stop = int(code.places[first][0]), int(code.places[after - 1][1])
        parts += [Piece(code.text[end:start], 0, False)] * (start > end)
        parts.append(Piece(code.text[start:stop], max(0, int(kind[first])), kind[first] < 0))
        end = stop
    return [*parts, Piece(code.text[end:], 0, False)]
