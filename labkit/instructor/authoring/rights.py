"""What a right filter answers when it is probed."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ...checks.probing import Answer, answers, expanded
from ...checks.trace import Scenario, run
from ...geometry import Array


def rights(subject: Callable, kind: str, probes: Sequence[Scenario]) -> dict[str, Answer]:
    """{id: Answer} of a right filter to probes, with H where the gain is asked for."""
    found = _asked(subject, kind, probes)
    for probe in probes:
        if "step" in probe:
            found[probe["id"]] = replace(found[probe["id"]], H=_jacobian(subject, kind, probe))
    return found


def _asked(subject, kind, probes):
    return answers(probes, {one["id"]: run(subject, kind, one) for one in expanded(probes)})


def _jacobian(subject: Callable, kind: str, probe: Scenario) -> Array:
    """H (m, n) of a probe: beside a very large covariance, K is its inverse; one landmark or reading at a time."""
    given, options = probe["make"]
    size = len(np.ravel(given["x0"]))
    wide = (1e6 * np.eye(size)).tolist()
    *before, (method, shown) = probe["calls"]
    ((kind_of, entries),) = shown.items()
    H = []
    for entry in entries:
        single = {**probe, "make": [{**given, "P0": wide}, options], "calls": [*before, [method, {kind_of: [entry]}]]}
        single |= {"begin": {name: wide if name in ("Pk_k", "P") else value for name, value in probe["begin"].items()}}
        (answer,) = _asked(subject, kind, [single]).values()
        H.append(np.linalg.pinv(answer.gain))
    return np.vstack(H)
