"""What the gradebook keeps of a mark's texts and of a figure: a student's code decides how large they come."""

import io
import json
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from .texts import cut

SENTENCE, LINE, LINES = 2000, 400, 60  # characters of a text and of a line, and lines: what pages show of them
LARGEST = 4_000_000  # bytes of a figure's arrays: the lab's own have some thousand


def fit(reason: str, lines: Iterable[str], mistake: str) -> tuple[str, str, str]:
    """(reason, lines as JSON, mistake) of a mark, cut: a student's code decides how long they are."""
    lines = [str(line) for line in lines]
    more = [f"… (cut here: {len(lines) - LINES} more lines)"] if len(lines) > LINES else []
    kept = [cut(line, LINE) for line in lines[:LINES]] + more
    return cut(reason, SENTENCE), json.dumps(kept), cut(mistake, SENTENCE)


def pack(figure: Mapping[str, Any] | None) -> bytes | None:
    """The bytes of a figure {name: array}, None if there is none or it is larger than any that a lab draws."""
    if not figure or sum(np.asarray(array).nbytes for array in figure.values()) > LARGEST:
        return None
    packed = io.BytesIO()
    np.savez_compressed(packed, **figure)
    return packed.getvalue()


def unpack(packed: bytes) -> dict[str, Any]:
    """The figure that `pack` made bytes of."""
    with np.load(io.BytesIO(packed), allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files}
