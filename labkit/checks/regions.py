"""Which number, row, column or table of a function's results is off, at which inputs, and how: in a sentence each."""

from dataclasses import dataclass

import numpy as np

from ..geometry import Array
from .cells import Table
from .findings import acts
from .kinds import number_text
from .traits import ANGLES, how, moved

SHUFFLED = "the right numbers in another order"  # which order, it does not say


@dataclass(frozen=True)
class Region:
    """What is off: its cells (N,) by count, how they differ or '', the sentence, and where it shows first."""

    cells: Array
    trait: str
    text: str
    scenario: int  # by count


def regions(table: Table, came: Array, base: Array, left: Array) -> list[Region]:
    """The parts of a result that are off;  came, base: what came and what should have (N,), left (N,): what counts."""
    places: dict[tuple, list[int]] = {}
    for n, cell in enumerate(table.cells):
        places.setdefault(cell.place, []).append(n)
    found = []
    for out in dict.fromkeys(place[:2] for place in places):
        own = {place: np.array(n) for place, n in places.items() if place[:2] == out}
        found += _Parts(table, came, base, left).of(own)
    return found


@dataclass(frozen=True)
class _Parts:
    """The search in one output; `own` is always {place: cells}, of a table, a row, a column or a number."""

    table: Table
    came: Array
    base: Array
    left: Array

    def of(self, own):
        off = [place for place, cells in own.items() if self.left[cells].any()]
        if not off:
            return []
        trait = self._trait(own) if len(own) == 1 or len(off) > 1 else ""
        if trait or len(own) == 1:
            return [self._region(own, trait)]
        axis = next(axis for axis in (2, 3) if len({place[axis] for place in own}) > 1)
        if len({place[3] for place in off}) == 1 < min(len(off), len({place[3] for place in own})):
            axis = 3  # all in one column
        parts = {}
        for place, cells in own.items():
            parts.setdefault(place[axis], {})[place] = cells
        inner = {n: self.of(part) for n, part in parts.items()}
        found = [region for regions in inner.values() for region in regions]
        plain = [region for region in found if not region.trait]
        if all(inner.values()) and len(plain) == len(found) > 1:
            return [self._region(own, "")]
        return found

    def _trait(self, own):
        cells = np.sort(np.concatenate(list(own.values())))
        few = (self.came[cells], self.base[cells], self.table.limits[cells])
        given = [self.table.cells[n].given for n in cells]
        names = self._names(next(iter(own)))
        angle = len(own) == 1 and any(name in ANGLES for name in names[-1:]) and len(names) < 2
        words = how(*few, given, angle or self._is_angle(own))
        if words or len(own) == 1 or not np.isfinite(few[:2]).all():
            return words
        rows = len({place[2] for place in own})
        tables = [part.reshape(-1, rows, len(own) // rows) for part in few] if self._in_order(cells, own) else []
        return (moved(*tables) if tables else "") or self._shuffled(cells, own)

    def _is_angle(self, own):
        return len(own) == 1 and self.table.parts.get(next(iter(own))[0]) == "angle"

    def _shuffled(self, cells, own):
        calls = np.array([self.table.cells[n].at[:2] for n in cells])
        if len(own) < len(self._all(*next(iter(own))[:2])):
            return ""
        for call in np.unique(calls, axis=0):
            few = cells[(calls == call).all(axis=1)]
            if (np.abs(np.sort(self.came[few]) - np.sort(self.base[few])) > self.table.limits[few]).any():
                return ""
        return SHUFFLED

    def _in_order(self, cells, own):
        """Whether the cells are whole tables one after the other."""
        places = [self.table.cells[n].place for n in cells]
        return len(places) % len(own) == 0 and places == sorted(own) * (len(places) // len(own))

    def _names(self, place):
        """The names of the row and the column of a number, or of its place in a vector."""
        axes = self.table.parts.get(place[0], ())
        index = place[4 - len(axes) :] if axes and not isinstance(axes, str) else ()
        return [names[i] for names, i in zip(axes, index)]

    def _region(self, own, trait):
        cells = np.sort(np.concatenate(list(own.values())))
        off = cells[self.left[cells]]
        first = self.table.cells[off[0]]
        shown = [n for n in cells if self.table.cells[n].at == first.at]
        size = [len({self.table.cells[n].place[axis] for n in shown}) for axis in (2, 3)]
        shape = [n for n in size if n > 1] if np.prod(size) == len(shown) else [-1]
        name = self._name(own)
        if trait and (self.base != self.table.right)[off].any():
            text = f"{name} differs, besides, in the same way at all inputs: {trait}."
            return Region(cells, trait, text, first.at[0])
        if self.table.words:
            said = [self.table.words.get(part[off[0]], "another text") for part in (self.came, self.table.right)]
            spelled = said[0].lower().strip() == said[1].lower()
            text = f"{name} is {said[0]}, right is {said[1]}" + " (only the spelling differs)" * spelled
        else:
            values = [part[shown].reshape(shape) for part in (self.came, self.table.right)]
            text = f"{name} {_beside(*values, trait)}"
        return Region(cells, trait, f"{text} {self._where(cells, off)}.", first.at[0])

    def _where(self, cells, off):
        bad = list(dict.fromkeys(self.table.cells[n].label for n in off))
        good = [label for label in dict.fromkeys(self.table.cells[n].label for n in cells) if label not in bad]
        at, count = f"at {bad[0]}", len(bad) + len(good)
        if not good:
            return at if count == 1 else f"{at}; it is off at {'both' if count == 2 else f'all {count}'} inputs"
        if len(bad) < min(4, len(good)):
            also = f"off at {_list(bad[1:])} too, " if len(bad) > 1 else ""
            return f"{at}; it is {also}right elsewhere"
        return f"{at}; it is off at {len(bad)} of {count} inputs, right at {_list(good)}"

    def _name(self, own):
        (out, off, row, column), *_ = own
        axes = self.table.parts.get(out, ())
        all_of = "the result" if not out or out.endswith("?") else f"`{out}`"
        if out in self.table.repeats:
            square = len(axes) == 2 and axes[0] == axes[1]
            which = f"block {'off' if off else 'on'} the diagonal" if square else "part"
            all_of = f"each {which} of {all_of}"
        rows, columns = ({place[axis] for place in own} for axis in (2, 3))
        names = self._names(next(iter(own)))
        if isinstance(axes, str) or not axes or len(own) == len(self._all(out, off)) > 1:
            text = all_of
        elif len(axes) == 1:
            text = f"entry {column + 1} ({names[0]}) of {all_of}"
        else:
            told = [f"row {row + 1} ({names[0]})"] * (len(rows) == 1)
            told += [f"column {column + 1} ({names[1]})"] * (len(columns) == 1)
            text = f"{', '.join(told)} of {all_of}"
        return text[0].upper() + text[1:]

    def _all(self, out, off):
        return {cell.place for cell in self.table.cells if cell.place[:2] == (out, off)}


def _beside(came, right, trait):
    if np.isnan(came).all():
        return f"is not-a-number, right is {number_text(right)},"
    if np.isnan(right).all():
        return f"is {number_text(came)}, right is not-a-number,"
    return acts(came, right, trait)


def _list(labels):
    told = [*labels[:2], f"{len(labels) - 2} more"] if len(labels) > 3 else labels
    return " and ".join(part for part in (", ".join(told[:-1]), told[-1]) if part)
