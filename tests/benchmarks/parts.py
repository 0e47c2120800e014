"""How many points of a filter one mistake leaves: python tests/benchmarks/parts.py [check ...] [--draws N] [--pairs N].

For every known mistake of every filter: which parts are shown to be right, on inputs drawn for some students, and the
share of the points of all checks of that filter, visible and hidden, that it keeps. And of pairs of mistakes, whether
two keep more than one of them does.
"""

import argparse
import itertools
import random
import statistics
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from labkit.instructor.authoring.spec import build  # noqa: E402
from labkit.instructor.exam.bite import room  # noqa: E402
from labkit.instructor.exam.mistakes import caught  # noqa: E402
from labkit.instructor.exam.paper import read  # noqa: E402

from helpers.parts import CHECKS, here, mistakes, source_of  # noqa: E402


def failed(check):
    """({mistake: the points of the checks in which it fails}, points of all checks) of a filter."""
    cells = [cell for cell in read(check.lab).cells if check.subject in cell.uses and cell.points is not None]
    names = room(check.lab)
    exam = names["exam"]
    lost = dict.fromkeys(exam.wrong(check.subject), 0.0)
    for cell in cells:
        exam.current = cell.id
        exam.place = cell.draws[0] if cell.draws else None
        found = caught(exam, cell.source, names, [check.subject]) if cell.hidden else lost
        for mistake in found:
            lost[mistake] += cell.points
    return lost, sum(cell.points for cell in cells)


def both(form, other):
    """Two lists of replacements as one, or None if they touch the same text."""
    if isinstance(form, str) or isinstance(other, str):
        return None
    olds = [old for old, _ in [*form, *other]]
    return None if any(a in b or b in a for a, b in itertools.combinations(olds, 2)) else [*form, *other]


def singles(check, draws):
    """{mistake: share of the filter's points that it keeps}, with what is printed of it."""
    source = source_of(check.lab)
    lost, most = failed(check)
    kept, weights = {}, check.divided.weights
    forms = {name: form for name, form in mistakes(check).items() if name in lost}
    differ = 0
    for name, form in forms.items():
        subject = build(source, form, check.subject)
        told = [here(check, subject, f"student {n}") for n in range(draws)]
        differ += len({tuple(parts) for parts in told}) > 1
        share = min(sum(weights[part] for part in parts) for parts in told) / 100
        points = lost.get(name, most)
        kept[name] = (most - points + points * share) / most
        wrong = [part for part in weights if part not in told[0] and part != "runs"]
        if kept[name] < 0.5 - 1e-9:
            print(f"  {kept[name]:4.0%}  {name}: fails in {points:g} of {most:g} points; not shown right: {wrong}")
    print(f"{check.name}: other parts with another draw: {differ} of {len(forms)}")
    return kept


def pairs(check, most):
    """(pairs, those that keep more than the mistake of the two that keeps less, more than each of the two)."""
    source, weights = source_of(check.lab), check.divided.weights
    forms = mistakes(check)

    def share(form):
        return sum(weights[part] for part in here(check, build(source, form, check.subject), "student 0"))

    alone = {one: share(form) for one, form in forms.items()}
    todo = list(itertools.combinations(forms, 2))
    random.Random(1).shuffle(todo)
    count = more = most_of_all = 0
    for a, b in todo:
        form = both(forms[a], forms[b]) if a.rpartition(" ")[0] != b.rpartition(" ")[0] else None
        if form is None or count >= most:
            continue
        try:
            two = share(form)
        except Exception:
            continue
        count += 1
        more += two > min(alone[a], alone[b])
        if two > max(alone[a], alone[b]):
            most_of_all += 1
            print(f"  {a} + {b} keep {two}, alone {alone[a]} and {alone[b]}")
    return count, more, most_of_all


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("checks", nargs="*", default=list(CHECKS))
    parser.add_argument("--draws", type=int, default=1)
    parser.add_argument("--pairs", type=int, default=0)
    given = parser.parse_args()
    for name in given.checks:
        start = time.process_time()
        kept = singles(CHECKS[name], given.draws)
        below = sum(share < 0.5 - 1e-9 for share in kept.values())
        middle = statistics.median(kept.values())
        print(
            f"{name}: {len(kept)} mistakes keep {min(kept.values()):.0%} or more, half of them {middle:.0%} or more; ",
            end="",
        )
        print(f"{below} keep less than half")
        if given.pairs:
            print(
                "{}: {} pairs; {} keep more than the worse of the two, {} than each".format(
                    name, *pairs(CHECKS[name], given.pairs)
                )
            )
        print(f"{name}: {time.process_time() - start:.0f} s of the processor", flush=True)


if __name__ == "__main__":
    main()
