"""What a function gave wrong, whatever the mistake: which number, row or table, at which inputs, and how."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .cells import alike, numbers, table
from .compare import ANY
from .identify import Told
from .regions import SHUFFLED, regions


def told(
    data: Mapping[str, Any], came: Mapping[str, Sequence], right: Mapping[str, Sequence], failed: Sequence[str]
) -> list[Told]:
    """What is wrong, the first to mend first; known mistakes in their own words.

    came, right: {scenario id: stored trace};  failed: the ids where they differ. [] where a result has no numbers.
    """
    shared = {id: right[id] for id in right if came[id][1] is None and alike(came[id][0], right[id][0])}
    if not set(failed) <= set(shared):
        return []
    all_cells = table(data, shared, came)
    mine = numbers(came[id][0] for id in shared)
    with np.errstate(all="ignore"):  # a student's numbers may be of any size
        return _Search(data, shared, all_cells, mine).told()


class _Search:
    """The known mistakes that show in a function's numbers, and what is off besides."""

    def __init__(self, data, shared, all_cells, mine):
        self.data, self.table, self.mine = data, all_cells, mine
        self.forms = []  # (the mistake's words, its numbers, which of them are wrong)
        for mistake in data["mistakes"]:
            for form in mistake["forms"]:
                traces = [form.get(id, right) for id, right in shared.items()]
                if all(t != ANY and t[1] is None and alike(t[0], r[0]) for t, r in zip(traces, shared.values())):
                    values = numbers(steps for steps, _ in traces)
                    self.forms.append((mistake["say"], values, all_cells.wrong(values, all_cells.right)))

    def told(self):
        base, said = self.table.right, []
        wrong = left = self.table.wrong(self.mine, base)
        nothing = (np.abs(self.mine) <= self.table.limits).all()  # which looks like any mistake that makes 0 of a part
        while left.any() and not nothing:
            fits = [(self._fit(form[2], form[1], wrong, left), form) for form in self.forms]
            fit, (say, values, changed) = max(fits, key=lambda one: one[0], default=((0, 0), ("", base, left)))
            if fit <= (0, 0):
                break
            said.append(Told(say, say, say) if fit[0] else Told(say, f"Perhaps: {say}"))
            base = np.where(changed & left, values, base)
            left = left & self.table.wrong(self.mine, values)
        if not said and left.any():
            base, said = self._below(wrong)
            left = self.table.wrong(self.mine, base)
        for region in regions(self.table, self.mine, base, left):
            said.append(self._named(region))
        return said

    def _fit(self, changed, values, wrong, left):
        """(how much of what is left a known mistake explains, wholly or not), or (0, 0)."""
        same = changed & ~self.table.wrong(self.mine, values)
        hits = int((same & left & np.isfinite(self.mine)).sum())
        if self.table.words or not hits or (changed & ~wrong).any() or hits == 1 < left.sum():
            return 0, 0  # of words, and of a single number among others, chance is no less likely
        whole = bool((same == changed).all())
        if not whole and not self._apart(changed, values):
            return 0, 0
        return int((same & left).sum()) if whole else 0, int((same & left).sum())

    def _apart(self, changed, values):
        """Whether a mistake shows as it is in a row, or a place of a vector, at all inputs, by different numbers."""
        parts: dict[tuple, list[int]] = {}
        for n, cell in enumerate(self.table.cells):
            parts.setdefault(cell.place[:3] if self.table.rank(cell.place) == 2 else cell.place, []).append(n)
        alike = ~self.table.wrong(self.mine, values)
        told = [cells for cells in parts.values() if changed[cells].any() and alike[cells].all()]
        return any(len(np.unique(values[cells][changed[cells]].round(6))) > 2 for cells in told)

    def _below(self, wrong):
        """A known mistake beside which all numbers differ in one way: (its numbers, what is told)."""
        if self.table.words or any(r.trait for r in regions(self.table, self.mine, self.table.right, wrong)):
            return self.table.right, []
        for say, values, changed in self.forms:
            if (changed & ~wrong).any():
                continue
            found = list(regions(self.table, self.mine, values, self.table.wrong(self.mine, values)))
            if len(found) == 1 and found[0].trait and "`" not in found[0].trait and changed.sum() > 2:
                return values, [Told(say, say, say)]
        return self.table.right, []

    def _named(self, region):
        """A region in the words of the known mistake that changes just that in the same way, or in its own."""
        for say, values, changed in self.forms if region.trait not in ("", SHUFFLED) else []:
            if set(np.flatnonzero(changed)) <= set(region.cells):
                others = list(regions(self.table, values, self.table.right, changed))
                if len(others) == 1 and others[0].trait == region.trait and len(others[0].cells) == len(region.cells):
                    return Told(say, say, say)
        return Told(str(region.scenario), region.text)
