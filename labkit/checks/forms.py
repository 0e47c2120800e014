"""The line of the gain, right and wrong: what gain each form makes of S, and what S a gain must have come from."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..geometry import Array

Three = Callable[[Array, Array, Array], Array]


@dataclass(frozen=True)
class Form:
    """A form of the line: gain(P, H, S) -> K (n, m), taken_from(P, H, K) -> S (m, m), and a sentence if it is wrong."""

    gain: Three
    taken_from: Three
    text: str = ""
    flips: bool = False  # rows and columns
    inverts: bool = True  # S, so that a gain so many times as large comes of an S so many times smaller


def _flipped(K):
    return K.T if K.shape[0] == K.shape[1] else np.full(K.shape, np.nan)


def _inverse(A):
    return np.linalg.pinv(A) if np.isfinite(A).all() else np.full(A.T.shape, np.nan)


FORMS = (
    Form(lambda P, H, S: P @ H.T @ _inverse(S), lambda P, H, K: _inverse(K) @ P @ H.T),
    Form(
        lambda P, H, S: H.T @ _inverse(S), lambda P, H, K: _inverse(K) @ H.T, "P is missing in the gain: K = P H' S^-1."
    ),
    Form(
        lambda P, H, S: P @ H.T @ S,
        lambda P, H, K: _inverse(P @ H.T) @ K,
        "S is not inverted in the gain: K = P H' S^-1, so that a noisy sensor has little weight.",
        inverts=False,
    ),
    Form(
        lambda P, H, S: P @ H.T @ (1 / S),
        lambda P, H, K: 1 / (_inverse(P @ H.T) @ K),
        "1 / S takes the reciprocal of each entry: the gain needs the inverse of the matrix.",
    ),
    Form(
        lambda P, H, S: _inverse(P) @ H.T @ _inverse(S),
        lambda P, H, K: _inverse(K) @ _inverse(P) @ H.T,
        "The gain takes the inverse of P: in K = P H' S^-1 only S is inverted.",
    ),
    Form(
        lambda P, H, S: _flipped(P @ H.T @ _inverse(S)),
        lambda P, H, K: _inverse(_flipped(K)) @ P @ H.T,
        "The gain is transposed: its rows are those of the estimate, its columns those of the measurement.",
        True,
    ),
    Form(
        lambda P, H, S: P @ H.T / S if S.shape == H.T.shape else np.full(H.T.shape, np.nan),
        lambda P, H, K: P @ H.T / K if K.shape == (len(H), len(H)) else np.full((len(H),) * 2, np.nan),
        "In the gain P H' is divided by S entry by entry: it needs the inverse of the matrix S, K = P H' S^-1.",
    ),
)


def covariances(P: Array, K: Array, H: Array, R: Array, S: Array) -> list[Array]:
    """What may stand for the covariance after an update, (n, n) each: K S K' less, (I - K H) P, Joseph's form."""
    A = np.eye(len(P)) - K @ H
    return [P - K @ S @ K.T, P - K @ (H @ P @ H.T + R) @ K.T, A @ P, A @ P @ A.T + K @ R @ K.T]
