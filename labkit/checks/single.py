"""A student's answers to probes with one landmark or reading in view, beside the right ones."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from ..geometry import Array, wrap
from .findings import Probed, close
from .forms import FORMS, Form
from .probing import Answer

STEPS = ("one", "one P", "one R", "one scaled", "one dt", "partial", "other")  # whose gains tell of H, R and S
Pair = tuple[Answer, Answer]


@dataclass(frozen=True)
class Part:
    """What a gain is made of at one probe: H (m, n), R (m, m) and S (m, m)."""

    H: Array
    R: Array
    S: Array

    @classmethod
    def of(cls, gain: Array, P: Array, H: Array) -> "Part":
        """What a gain (n, m) must be made of, if it is P H' S^-1 with this P (n, n) and H (m, n)."""
        S = np.linalg.pinv(gain) @ P @ H.T
        return cls(H, S - H @ P @ H.T, S)


class Single:
    """The student's and the right answers to all probes with one landmark in view."""

    def __init__(self, probed: Probed) -> None:
        self.probed = probed
        self.pairs: dict[str, Pair] = {}
        for id, (a, r) in probed.both("").items():
            if a.gain.size and r.gain.shape[1] == 2 and close(a.x, r.x) and close(a.P, r.P):
                self.pairs[id] = (a, r)
        self._without_what_a_gate_left_out()
        self.moved = self.pairs.pop("moved", None)  # what an update after `predict` shows
        self.tight = {id: pair for id, pair in self.pairs.items() if not id.endswith(("wide", "narrow", "bent"))}
        self.gains = all(close(a.gain, r.gain) for a, r in self.pairs.values())
        self.covariances = all(close(a.after, r.after) for a, r in self.tight.values())
        self.blind = all(close(a.gain, 0 * a.gain) for a, _ in self.pairs.values())
        self.stacks = all(probe.get("first", 1) == 1 for probe in probed.probes.values())  # all readings of a step
        self.replaced = False  # whether the correction stands in the place of the estimate
        self.steps = {id for id in STEPS if id in probed.right}
        self.taken: dict[str, str] = {}  # {probe: one that shows the landmark which is taken there instead}
        self.scale = 1.0  # of the correction, where that alone is larger than the gain
        self.whole = 1.0  # of the gain, where that is larger than its parts
        self.share = 1.0  # of H P H' in S
        self.way = np.eye(2)  # what the innovation goes through
        self.form: Form = FORMS[0]  # of the gain's line
        self.parts: Mapping[str, Part] = {id: self.right(id) for id in STEPS if id in self.pairs} if self.gains else {}

    def _without_what_a_gate_left_out(self):
        """Of a filter that was told a gate: it may keep another one."""
        still = {id for id, (a, _) in self.pairs.items() if close(a.gain, 0 * a.gain) and close(a.after, a.P, 1e-9)}
        for id in still if still != self.pairs.keys() else ():
            if "gate" in self.probed.probes[id]["make"][1]:
                del self.pairs[id]

    @property
    def straight(self) -> bool:
        """Whether the gain is the same for all that may be measured."""
        near, bent = (self.pairs.get(id) for id in ("near", "bent"))
        columns = zip(bent[0].gain.T, near[0].gain.T) if near and bent else ()
        return all(close(one, other, 2e-2) for one, other in columns)

    def forget(self, *ids: str) -> None:
        """Leave these probes aside."""
        for id in ids:
            self.pairs.pop(id, None)
            self.tight.pop(id, None)

    @staticmethod
    def part(answer: Answer) -> Part:
        """H, R and S of a right answer."""
        return Part.of(answer.gain, answer.P, answer.H)

    def right(self, id: str) -> Part:
        """H, R and S of the right answer to one of STEPS: where another landmark is taken, that has another H."""
        answer = self.probed.right[id]
        part = self.part(answer)
        taken = self.taken.get("other" if id == "other" else "one")
        H = self.probed.right[taken].H if taken else part.H
        return Part(H, part.R, H @ answer.P @ H.T + part.R)

    def seconds(self, ids: Iterable[str]) -> list[float]:
        """The length of a step dt at these probes."""
        return [self.probed.probes[id]["make"][1].get("dt", 1.0) for id in ids]

    def entry(self, id: str) -> list:
        """The landmark or reading that a probe shows, as it is stored."""
        ((entries,),) = [list(self.probed.probes[id]["calls"][-1][1].values())]
        return entries[0]

    def name(self, id: str) -> str:
        """What is seen there: "landmark 'a'", or "the reading (1, 0)" of observer and target."""
        first = self.probed.probes[id].get("first", 1)
        return f"landmark {self.entry(id)[0]!r}" if first == 1 else f"the reading {tuple(self.entry(id)[:first])}"

    @property
    def thing(self) -> str:
        """What is seen: 'landmark' or 'reading'."""
        return "landmark" if self.probed.probes["one"].get("first", 1) == 1 else "reading"

    def seen(self, id: str) -> Array:
        """What is measured there (m,)."""
        first = self.probed.probes[id].get("first", 1)
        return np.array(self.entry(id)[first : first + 2], dtype=float)

    def off(self, id: str) -> Array:
        """The innovation (m,) that explains how the student's estimate moves."""
        answer = self.pairs[id][0]
        return np.linalg.pinv(answer.gain) @ (answer.moved + self.replaced * answer.x)

    def expected(self, id: str) -> Array:
        """What should be expected there (m,)."""
        answer = self.pairs[id][1]
        return self.seen(id) - np.linalg.pinv(answer.gain) @ answer.moved

    def turned(self, difference: Array) -> Array:
        """The difference (m,) of two measurements, its bearing within half a turn."""
        angles = np.array([row == "bearing" for row in self.probed.rows])
        return np.where(angles, wrap(difference), difference)
