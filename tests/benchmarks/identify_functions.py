"""How well the checks of functions find what is wrong: python tests/benchmarks/identify_functions.py [check ...].

Single known mistakes, pairs of them that touch different texts, and mutants of the solution, as in identify.py. A
mistake of a pair counts as named if its own sentence is said, or one about the part of the result that it alone makes
wrong. A mutant is named if a number, row, table or input that is wrong is said, or what it raises.
"""

import argparse
import ast
import itertools
import re
import time

import numpy as np
from identify import ROOT, both, mutants, said, source_of

from labkit.checks import CheckError, judge, stored
from labkit.checks.compare import gap
from labkit.checks.trace import run
from labkit.instructor.authoring.spec import build, definitions

CHECKS = {check.name: check for check in definitions(ROOT) if check.kind == "function"}
PLACE = re.compile(r"((?:Row|Column|Entry|Each|Block)[^:.;]*?`?\w+`?|The result|`\w+`) (?:acts as|is) ")
FREE = {"x", "u", "truth", "me", "slot", "velocity", "others", "alpha", "phi", "theta", "o", "p", "angles", "P1", "P2"}


def sentences(check, subject):
    """(all that is said, on one line, the sentences in it), or ('', []) if the check passes."""
    try:
        judge(stored(check.name), subject)
    except CheckError as error:
        also = " ".join(" ".join(error.details).split())
        told = [error.summary, *re.findall(r"Also: (.*?)(?= Also: |  call |$)", also)]
        return " ".join(str(error).split()), told
    return "", []


def places(text):
    return {place for place in PLACE.findall(text) if place != "The result"}


def pairs(check, source, show):
    """(pairs tried, both named, one named, with a false sentence)."""
    say = {m.id: " ".join(m.say.split()) for m in check.mistakes}
    forms = {(m.id, k): form for m in check.mistakes for k, form in enumerate(m.forms)}
    alone = {one: said(check, build(source, form, check.subject)) for one, form in forms.items()}
    parts = {one: places(unnamed(check, build(source, form, check.subject))) for one, form in forms.items()}
    counts = [0, 0, 0, 0]
    for a, b in itertools.combinations(forms, 2):
        form = both(forms[a], forms[b]) if a[0] != b[0] else None
        try:
            subject = form and build(source, form, check.subject)
        except Exception:
            continue
        text = said(check, subject) if form else ""
        if not form or text in (alone[a], alone[b]):
            continue  # one of the two has no effect beside the other
        if not text:
            print("  ACCEPTED", check.name, a, b)
            continue
        named = [say[one[0]] in text or bool(parts[one] & places(text)) for one in (a, b)]
        false = [id for id, words in say.items() if words in text and id not in (a[0], b[0])]
        false = [id for id in false if not shows(check, id, subject)]
        counts = [counts[0] + 1, counts[1] + all(named), counts[2] + any(named), counts[3] + bool(false)]
        if show and (not all(named) or false):
            print(f"  {a} + {b}: named {named}, false: {false}\n      {text[:500]}")
    return counts


def shows(check, id, subject):
    """Whether all numbers that a known mistake changes came as with that mistake, so that its sentence holds."""
    data, traces = stored(check.name), {}
    traces = {s["id"]: run(subject, "function", s) for s in data["scenarios"]}
    return any(_shows(form, data, traces) for m in data["mistakes"] if m["id"] == id for form in m["forms"])


def _shows(form, data, traces):
    for s in data["scenarios"]:
        if s["id"] in form and form[s["id"]] != "any" and form[s["id"]][1] is None:
            trace = [np.ravel(v) for step in traces[s["id"]].steps for v in step]
            other, right = ([np.ravel(v) for step in t[0] for v in step] for t in (form[s["id"]], s["right"][0]))
            if [v.shape for v in trace] != [v.shape for v in other]:
                return False
            trace, other, right = map(np.concatenate, (trace, other, right))
            if trace.dtype.kind != "f" or not np.allclose(
                *(v.astype(float)[other != right] for v in (trace, other)), rtol=2e-3, equal_nan=True
            ):
                return False
    return True


def unnamed(check, subject):
    """What is said if no mistake is known."""
    data = {**stored(check.name), "mistakes": []}
    try:
        judge(data, subject)
    except CheckError as error:
        return " ".join(str(error).split())
    return ""


def wide(stored_input, name, rng):
    """A stored input with quite other numbers; what is positive stays so, unless it may be negative by its name."""
    if isinstance(stored_input, float):
        return stored_input * rng.uniform(0.3, 2.5) * (rng.choice([-1, 1]) if name in FREE else 1)
    if (
        isinstance(stored_input, list)
        and np.ndim(stored_input) == 2
        and np.array_equal(stored_input, np.transpose(stored_input))
    ):
        return (np.array(stored_input) * rng.uniform(0.3, 2.5)).tolist()
    if isinstance(stored_input, list):
        return [wide(one, name, rng) for one in stored_input]
    if isinstance(stored_input, dict):
        return {key: wide(one, "p" if key == "landmark" else key, rng) for key, one in stored_input.items()}
    return stored_input


def differs(check, subject, right, times=20):
    """Whether a function gives something else than the right one somewhere, at the check's inputs changed at random."""
    data, rng = stored(check.name), np.random.default_rng(1)
    for s in data["scenarios"] * times:
        calls = [[name, *(wide(v, arg, rng) for arg, v in zip(data["args"], given))] for name, *given in s["calls"]]
        one, other = (run(f, "function", {**s, "calls": calls}) for f in (subject, right))
        if other.stop is None and gap(one, (other.steps, None)) > 3:
            return str(calls)[:300]
    return ""


def mutated(check, source, show):
    """(mutants, refused, accepted that differ, refused with what is wrong named)."""
    right = build(source, (), check.subject)
    body = ast.parse(source).body
    own = next(ast.unparse(node) for node in body if getattr(node, "name", "") == check.subject)
    total = refused = accepted = named = 0
    for what, text in mutants(own, check.subject):
        try:
            subject = build(f"{source}\n{text}", (), check.subject)
        except Exception:
            continue
        total += 1
        sentence, told = sentences(check, subject)
        if not sentence:
            if where := differs(check, subject, right):
                accepted += 1
                print("  ACCEPTED", check.name, what, where)
            continue
        refused += 1
        vague = told[0].startswith(("Not yet right", "Perhaps")) and not re.search(
            "Error|shape|NaN|single number", sentence
        )
        named += not vague
        if show and vague:
            print("  VAGUE", what, "\n     ", sentence[:400])
        elif show > 1:
            print("  MUTANT", what, "\n     ", " | ".join(told))
    return total, refused, accepted, named


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("checks", nargs="*", default=list(CHECKS))
    parser.add_argument("--show", type=int, default=0)
    parser.add_argument(
        "--without-pairs", action="store_true", help="as if the pairs of known mistakes were not stored"
    )
    parser.add_argument("--only", default="singles,pairs,mutants")
    given = parser.parse_args()
    sums = np.zeros(10, dtype=int)
    for name in given.checks:
        check, start, line = CHECKS[name], time.process_time(), np.zeros(10, dtype=int)
        source = source_of(check)
        if given.without_pairs:
            stored(name).pop("pairs", None)
        if "singles" in given.only:
            forms = [(m.say, form) for m in check.mistakes for form in m.forms]
            own = [" ".join(say.split()) in said(check, build(source, form, check.subject)) for say, form in forms]
            line[:2] = len(own), sum(own)
        if "right" in given.only and (
            refused := [r.id for r in check.right if said(check, build(source, r.form, check.subject))]
        ):
            print(name, "REFUSES", refused)
        if "pairs" in given.only:
            line[2:6] = pairs(check, source, given.show)
        if "mutants" in given.only:
            line[6:] = mutated(check, source, given.show)
        report(name, line, time.process_time() - start)
        sums += line
    report("all", sums, 0)


def report(name, line, seconds):
    singles, own, tried, two, one, false, total, refused, accepted, named = line.tolist()
    print(
        f"{name}: known {own} of {singles}; pairs {tried}: both {two}, one {one}, false {false}; "
        f"mutants {total}: refused {refused}, named {named}, accepted that differ {accepted} ({seconds:.0f} s)",
        flush=True,
    )


if __name__ == "__main__":
    main()
