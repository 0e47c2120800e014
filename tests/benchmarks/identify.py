"""How well the checks of a filter find the wrong line: python tests/benchmarks/identify.py [check ...] [--pairs N].

Single known mistakes, pairs of them that touch different lines, right forms, and mutants of the solution made over
its syntax tree. A mistake counts as named if its own sentence stands in what is said, or one about its quantity, or if
the function in which it lies is said to be mended first (the check of that tells the line). A pair whose filter does
on all inputs what one of the two alone does is left out: the other cannot be seen. A sentence is false if it tells of
a quantity that neither changes; where two cancel in the estimate and only the covariance is off, that is no such one,
nor are the words of a third mistake that does on all inputs what the two do together.
"""

import argparse
import ast
import copy
import itertools
import random
import re
import sys
import time
import warnings
from functools import cache
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from benchmarks.roles import function, is_named, role  # noqa: E402

from labkit import Robot, make_filter, random_map, replay, simulate  # noqa: E402
from labkit.checks import CheckError, judge, observe, stored  # noqa: E402
from labkit.checks.compare import gap  # noqa: E402
from labkit.checks.identify import findings, probed  # noqa: E402
from labkit.checks.probing import ask  # noqa: E402
from labkit.geometry import wrap  # noqa: E402
from labkit.instructor.authoring.spec import answers, build, definitions  # noqa: E402
from labkit.legged import LeggedRobot  # noqa: E402
from labkit.notebook.read import read  # noqa: E402
from labkit.team import Team, TeamNoise  # noqa: E402

CHECKS = {check.name: check for check in definitions(ROOT) if check.probing}


def source_of(check):
    return answers(read(ROOT / "solutions" / f"{check.lab}.ipynb"))


def said(check, subject):
    """What the check says, on one line, or '' if it passes."""
    data = stored(check.name)
    try:
        judge(data, subject)
    except CheckError as error:
        return " ".join(str(error).split())
    return ""


def wrong_parts(check, subject):
    data = stored(check.name)
    return findings(probed(data["probing"], ask(subject, data["kind"], data["probing"]["probes"])))


def both(form, other):
    """Two lists of replacements as one, or None if they touch the same text."""
    if isinstance(form, str) or isinstance(other, str):
        return None
    olds = [old for old, _ in [*form, *other]]
    if any(a in b or b in a for a, b in itertools.combinations(olds, 2)):
        return None
    return [*form, *other]


def singles(check, source):
    """The share of known mistakes whose own sentence is said."""
    total = named = 0
    for mistake in check.mistakes:
        for form in mistake.forms:
            text = said(check, build(source, form, check.subject))
            total += 1
            named += " ".join(mistake.say.split()) in text
    return total, named


def about(check, source):
    """{mistake: how each of its forms may rightly be told}: its sentence, or what probing alone finds."""
    told = {}
    for mistake in check.mistakes:
        for k, form in enumerate(mistake.forms):
            told[mistake.id, k] = {f.part for f in wrong_parts(check, build(source, form, check.subject))}
    return told


def pairs(check, source, most, show):
    """(pairs tried, both named, one named, with a false sentence)."""
    parts = about(check, source)
    say = {m.id: " ".join(m.say.split()) for m in check.mistakes}
    forms = {(m.id, k): form for m in check.mistakes for k, form in enumerate(m.forms)}
    todo = list(itertools.combinations(forms, 2))
    random.Random(1).shuffle(todo)
    counts = [0, 0, 0, 0]
    data = stored(check.name)
    alone = {one: seen(data, build(source, form, check.subject)) for one, form in forms.items()}
    for a, b in todo:
        form = both(forms[a], forms[b]) if a[0] != b[0] else None
        if form is None or counts[0] >= most:
            continue
        try:
            subject = build(source, form, check.subject)
        except Exception:
            continue
        text = said(check, subject)
        if not text:
            print("  ACCEPTED", a, b)
            continue
        came = seen(data, subject)
        if came and any(_same(came, alone[one]) for one in (a, b)):
            continue  # one of the two has no effect beside the other
        rest = wrong_parts(check, subject)
        named = [
            _is_named(one, text, say, parts, rest)
            or any(f"`{name}`" in _sends(text) for name in lies_in(source, forms[one]))
            for one in (a, b)
        ]
        cancel = {"P"} if {f.part for f in rest} - {"several"} == {"P"} else set()
        like = [one for one in alone if came and _same(came, alone[one])]
        false = _false(text, (a, b, *like), say, parts, rest, cancel)
        counts = [counts[0] + 1, counts[1] + all(named), counts[2] + any(named), counts[3] + bool(false)]
        if show and (not all(named) or false):
            print(f"  {a[0]} + {b[0]}: named {named}, false: {false}\n      {text[:400]}")
    return counts


def seen(data, subject):
    """{id: Trace} of all that a check asks, or {} where it can ask nothing."""
    try:
        return observe(data, subject)
    except CheckError:
        return {}


def _same(first, second):
    """Whether two filters give the same on all that a check asks, the same error counting as the same."""
    return bool(second) and all(
        gap(first[id], (second[id].steps, second[id].stop and second[id].stop.key)) < 1e-3 for id in first
    )


def lies_in(source, form):
    """The names of the functions in which a mistake lies, or () if it is in the class, too."""
    if isinstance(form, str):
        return ()
    changed = source
    for old, new in form:
        changed = changed.replace(old, new)
    before, after = ({getattr(n, "name", ""): ast.dump(n) for n in ast.parse(text).body} for text in (source, changed))
    names = {name for name in before if before[name] != after.get(name)}
    functions = {n.name for n in ast.parse(source).body if isinstance(n, ast.FunctionDef)}
    return names if names <= functions else ()


def _sends(text):
    """The line that sends to functions with checks of their own, which tell the line."""
    return text.partition("First mend ")[2].partition(":")[0]


def _is_named(one, text, say, parts, rest):
    quantities = _with_family(parts[one])
    return say[one[0]] in text or any(f.part in quantities and _in(f.text, text) for f in rest)


def _in(sentence, text):
    return " ".join(sentence.split())[-60:] in text


def _false(text, both, say, parts, rest, cancel):
    """Sentences that name a known mistake that is none of the two, nor tells the same quantity; or another quantity."""
    allowed = set().union(*(parts[one] for one in both))
    allowed = _with_family(allowed)
    same = {say[one[0]] for one in both}
    others = [id for (id, k), p in parts.items() if say[id] in text and say[id] not in same and not p & allowed]
    quantities = [f.part for f in rest if f.part not in allowed | cancel and _in(f.text, text)]
    return sorted({*others, *quantities})


def _with_family(parts):
    return parts.union(*(family for family in FAMILIES if parts & family))


FAMILIES = (
    {"estimate", "gain", "innovation", "sign"},  # of one line: what the estimate makes of the innovation
    {"R", "Q in update"},  # Q in place of R
    {"gain", "H P H'"},  # missing in what the gain inverts: whether in S itself only d2 and the covariance show
)


class Mutate(ast.NodeTransformer):
    """Changes the n-th place that can be changed, in its k-th way."""

    def __init__(self, place):
        self.place, self.count, self.what = place, -1, ""

    def choose(self, node, others):
        new = []
        for other in others:
            self.count += 1
            if self.count == self.place:
                self.what = f"line {node.lineno}: {ast.unparse(node)} -> {ast.unparse(other)}"
                new.append(ast.copy_location(other, node))
        return new[0] if new else node

    def visit_BinOp(self, node):
        self.generic_visit(node)
        swaps = {
            ast.Add: [ast.Sub],
            ast.Sub: [ast.Add],
            ast.Mult: [ast.Div],
            ast.Div: [ast.Mult],
            ast.MatMult: [ast.Mult],
            ast.Pow: [ast.Mult],
        }
        others = [ast.BinOp(node.left, op(), node.right) for op in swaps.get(type(node.op), [])]
        others += [ast.BinOp(node.right, node.op, node.left)] * (type(node.op) in (ast.Sub, ast.Div, ast.MatMult))
        return self.choose(node, [*others, node.left, node.right])

    def visit_UnaryOp(self, node):
        self.generic_visit(node)
        return self.choose(node, [node.operand])

    def visit_Constant(self, node):
        if isinstance(node.value, bool) or not isinstance(node.value, int | float):
            return node
        return self.choose(node, [ast.Constant(node.value + 1), ast.Constant(-node.value - 1)])

    def visit_Compare(self, node):
        self.generic_visit(node)
        swaps = {ast.Lt: ast.Gt, ast.Gt: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.In: ast.NotIn}
        op = swaps.get(type(node.ops[0]))
        return self.choose(node, [ast.Compare(node.left, [op()], node.comparators)] if op else [])

    def visit_Attribute(self, node):
        self.generic_visit(node)
        if not isinstance(node.ctx, ast.Load):
            return node
        swaps = {
            "Q": "R",
            "R": "Q",
            "T": None,
            "sin": "cos",
            "cos": "sin",
            "arctan2": "hypot",
            "hypot": "arctan2",
            "vstack": "hstack",
            "xk_k": None,
        }
        other = swaps.get(node.attr, "")
        if other:
            return self.choose(node, [ast.Attribute(node.value, other, node.ctx)])
        return self.choose(node, [node.value]) if other is None and node.attr == "T" else node

    def visit_Call(self, node):
        self.generic_visit(node)
        others = []
        if len(node.args) == 2 and not node.keywords:
            others.append(ast.Call(node.func, node.args[::-1], []))
        if len(node.args) == 1 and not node.keywords:
            others.append(node.args[0])
        return self.choose(node, others)


def mutants(source, subject):
    """(what was changed, the changed source) of each mutant of the answer cells."""
    place = 0
    while True:
        tree = ast.parse(source)
        change = Mutate(place)
        names = {n.name for n in tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef)}
        tree.body = [change.visit(n) if getattr(n, "name", None) in names else n for n in tree.body]
        if not change.what:
            return
        place += 1
        yield change.what, ast.unparse(ast.fix_missing_locations(copy.deepcopy(tree)))


@cache
def world(name, seed):
    """A log of the lab that a check belongs to, and the options of a filter in it."""
    return WORLDS[name.split("-")[0]](name, np.random.default_rng(seed))


def same_on_runs(check, right, subject, runs=200):
    """Whether a filter gives what the right one does over random runs in the world of its lab."""
    for seed in range(runs if check.name.endswith("-kf") else runs // 10):
        log, options = world(check.name, seed)
        try:
            a, b = (replay(_filter(KF, log, options), log) for KF in (right, subject))
        except Exception:
            return False
        for name in ("x", "P", "x_prior"):
            one, other = getattr(a, name), getattr(b, name)
            if one.shape != other.shape:
                return False
            apart = other - one
            if name != "P" and one.shape[-1] == 3:
                apart[..., 2] = wrap(apart[..., 2])  # a turn on is the same heading
            if not np.allclose(one, one + apart, rtol=0.05, atol=2e-3 * np.abs(one).max()):
                return False
        kept = [np.array([number for d2 in one.d2 for number in (len(d2), *d2[:1])]) for one in (a, b)]
        if kept[0].shape != kept[1].shape or not np.allclose(*kept, rtol=0.05, atol=1e-3):
            return False
    return True


def _filter(KF, log, options):
    return KF(**options) if hasattr(log, "logs") else make_filter(KF, log, **options)


def _landmarks(name, rng):
    """A run of labs 1 and 3."""
    sensor = "xy" if name.startswith("cartesian") else "rb"
    robot = Robot([0.0, 0.0], np.eye(2) * 0.05, np.diag([0.04, 0.0076]), type=sensor, rng=rng)
    return simulate(robot, random_map(8, rng), steps=30), {}


def _field(name, rng):
    """A walk on the field of lab 4: false alarms, landmarks that are cut off, a kidnapping now and then."""
    log = LeggedRobot(str(rng.choice(["paper", "real", "harsh"])), rng=rng).record(
        60, kidnap=[40] * (rng.random() < 0.3)
    )
    start = {"x0": log.truth[0] + rng.normal(0, 0.05, 3), "P0": np.diag([0.1, 0.1, 0.1]) ** 2}
    return log, {**start, "noise": log.noise.told(), "gate": rng.uniform(3, 14)}


def _hall(name, rng):
    """A run in the hall of lab 6, with false readings: robots that drive in circles, or one that does."""
    n = int(rng.integers(2, 5))
    around = 2 * np.pi * np.arange(n) / n + rng.uniform(0, 6)
    poses = np.column_stack([5 * np.cos(around), 5 * np.sin(around), rng.uniform(-3.1, 3.1, n)])
    noise = TeamNoise(range=rng.uniform(0.03, 0.1), bearing=rng.uniform(0.01, 0.03))
    team = Team(poses, noise, fov=2 * np.pi, rng=rng, spurious=(-9, -9, 18, 18, 0.15))
    commands = np.column_stack([rng.uniform(0.1, 0.3, n), rng.uniform(-0.5, 0.5, n)])
    commands[1:] *= name == "team-ekf"  # elsewhere all but one stand and watch
    log = team.record(lambda team: commands, 60)
    sigma = np.tile([0.1, 0.1, 0.02], (n, 1))
    x0 = poses + sigma * rng.standard_normal(sigma.shape)
    options = {"x0": x0, "P0": np.diag(sigma.ravel() ** 2), "noise": noise}
    return log, {**options, "gate": rng.uniform(4, 14), "inflate": rng.uniform(1, 6)}


WORLDS = {"cartesian": _landmarks, "range": _landmarks, "legged": _field, "team": _hall}  # by the first word of a check


def mutated(check, source, show):
    """(mutants, refused, accepted that differ, named, with their words, {quantity: [refused, named]})."""
    right = build(source, (), check.subject)
    total = refused = accepted = named = 0
    strict: dict[str, list[int]] = {}
    told = about(check, source)
    say = {
        " ".join(m.say.split()): (_roles(source, m.forms), set().union(*(told[m.id, k] for k in range(len(m.forms)))))
        for m in check.mistakes
    }
    for what, text in mutants(source, check.subject):
        try:
            subject = build(text, (), check.subject)
        except Exception:
            continue
        total += 1
        sentence = said(check, subject)
        if not sentence:
            if not same_on_runs(check, right, subject):
                accepted += 1
                print("  ACCEPTED", what)
            continue
        refused += 1
        what_line = int(re.match(r"line (\d+)", what)[1])
        quantity = role(source, what_line)
        parts = {f.part for f in wrong_parts(check, subject) if _in(f.text, sentence)}
        parts |= set().union(*(shown for words, (_, shown) in say.items() if words in sentence))
        known = set().union(*(roles for words, (roles, _) in say.items() if words in sentence))
        right_one = is_named(quantity, function(source, what_line), sentence, parts, known, text)
        counts = strict.setdefault(quantity, [0, 0])
        counts[:] = counts[0] + 1, counts[1] + right_one
        if show and not right_one:
            print("  OTHER", quantity, "|", what, "\n     ", parts, sentence.split("passed.", 1)[1][:240])
        vague = "Not yet right" in sentence and not any(word in sentence for word in ("Error", "shape", "NaN"))
        named += not vague
        if show and vague:
            print("  VAGUE", what, "\n     ", sentence[:300])
        elif show == 2:
            print("  MUTANT", what, "\n     ", sentence.split("passed.", 1)[1][:260])
    return total, refused, accepted, named, strict


def _roles(source, forms):
    """The quantities of the lines that the forms of a known mistake change."""
    found = set()
    for form in (form for form in forms if not isinstance(form, str)):
        for old, _ in form:
            start = source.count("\n", 0, source.index(old)) + 1
            found |= {role(source, start + n) for n, text in enumerate(old.split("\n")) if text.strip()}
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("checks", nargs="*", default=list(CHECKS))
    parser.add_argument("--pairs", type=int, default=2000)
    parser.add_argument("--show", type=int, default=0)
    parser.add_argument("--only", default="singles,right,pairs,mutants")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    for name in given.checks:
        check = CHECKS[name]
        source = source_of(check)
        start = time.process_time()
        if "singles" in given.only:
            print(name, "mistakes one by one: {}, named {}".format(*singles(check, source)))
        if "right" in given.only:
            refused = [r.id for r in check.right if said(check, build(source, r.form, check.subject))]
            print(name, f"right forms: {len(check.right)}, refused {refused}")
        if "pairs" in given.only:
            n, two, one, false = pairs(check, source, given.pairs, given.show)
            print(name, f"pairs: {n}, both named {two / n:.1%}, one named {one / n:.1%}, false sentence in {false}")
        if "mutants" in given.only:
            n, refused, accepted, named, strict = mutated(check, source, given.show)
            right = sum(count for _, count in strict.values())
            of_each = ", ".join(f"{quantity} {b} of {a}" for quantity, (a, b) in sorted(strict.items()))
            print(
                name,
                f"mutants: {n}, refused {refused}, accepted that differ {accepted}, named {named / refused:.1%}, "
                f"with the right quantity {right / refused:.1%} ({of_each})",
            )
        print(name, f"{time.process_time() - start:.0f} s of the processor", flush=True)


if __name__ == "__main__":
    main()
