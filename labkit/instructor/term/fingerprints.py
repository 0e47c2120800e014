"""Fingerprints of code by winnowing, and how much of them two have in common that few others have.

Winnowing: Schleimer, Wilkerson, Aiken, "Winnowing: local algorithms for document fingerprinting", SIGMOD 2003. Of each
`WINDOW` neighbouring runs of `RUN` tokens the one with the smallest hash is kept: whatever two texts share for
RUN + WINDOW - 1 tokens, a line and a half of Python, leaves a fingerprint that both have.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy import sparse

from .tokens import Code

RUN, WINDOW = 12, 5  # tokens of a run, runs of a window
BASE = np.uint64(0x9E3779B97F4A7C15)  # odd and large: hashes of like runs lie far apart
UNIT = math.log(2 * 59)  # how surprising what two of 60 share is
USUAL = 0.2  # how rare at most a fingerprint is that the model solution has too
NONE = np.uint64(2**64 - 1)  # of a run that is given


def hashes(code: Code) -> NDArray[np.uint64]:
    """The hash of each run of RUN tokens, (m,), where m is RUN - 1 less than there are tokens."""
    if len(code.words) < RUN:
        return np.zeros(0, dtype=np.uint64)
    found = np.zeros(len(code.words) - RUN + 1, dtype=np.uint64)
    for words in sliding_window_view(code.words, len(found)):
        found = (found + words) * BASE
        found ^= found >> np.uint64(29)
    return np.minimum(found, NONE - np.uint64(1))


def among(found: NDArray[np.uint64], given: NDArray[np.uint64]) -> NDArray[np.bool_]:
    """Which of `found`, (n,), are in `given`, (k,), which are sorted: many more, so that they are not sorted anew."""
    if not len(given):
        return np.zeros(len(found), dtype=bool)
    return given[np.minimum(np.searchsorted(given, found), len(given) - 1)] == found


def winnowed(found: NDArray[np.uint64], given: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The fingerprints, (n,) sorted, of runs with hashes `found`, (m,), but for those `given`, (k,) sorted."""
    own = np.where(among(found, given), NONE, found)
    if len(own) > WINDOW:
        own = sliding_window_view(own, WINDOW).min(axis=1)
    return np.setdiff1d(own, [NONE])


def shared(prints: Sequence[NDArray[np.uint64]], usual: NDArray[np.uint64]) -> NDArray[np.float64]:
    """The fingerprints that each two of n share, (n, n), each by how surprising that is: 0 if all have it.

    The measure is minus the logarithm of the share of the others who have it, with half a person more, so that a small
    class can say less; 1 is one that nobody else has in a class of 60. prints: (m,) each, of `winnowed`;  usual (k,):
    hashes of the model solution's runs, which count little, since who has them wrote what is right.
    """
    count = len(prints)
    every, number = np.unique(np.concatenate([*prints, np.zeros(0, np.uint64)]), return_inverse=True)
    rows = np.repeat(np.arange(count), [len(one) for one in prints])
    has = sparse.csr_matrix((np.ones(len(rows)), (rows, number)), shape=(count, len(every)))
    others = np.maximum(0, np.asarray(has.sum(axis=0)).ravel() - 2)
    rare = -np.log((others + 0.5) / max(count - 1, 1)) / UNIT
    rare = np.where(np.isin(every, usual), np.minimum(rare, USUAL), rare)
    return np.asarray((has.multiply(rare).tocsr() @ has.T).todense())
