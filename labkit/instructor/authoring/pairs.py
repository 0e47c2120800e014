"""Two known mistakes at once: what comes of them, where what comes of each alone does not tell both."""

import itertools
from collections.abc import Mapping
from typing import Any

from ...checks import CheckError, decide, wrong
from ...checks.compare import fits
from ...checks.probing import expanded
from ...checks.trace import run
from .spec import Check, Form, build
from .stored import pack

MOST = 40  # forms of known mistakes whose pairs are all tried: those of the filters of labs 1 and 3 would take an hour
DIGITS = 4  # off by a quarter of a tolerance of `compare` at most; a pair is recognised by many numbers


def of(check: Check, source: str, data: Mapping[str, Any]) -> list[dict]:
    """[{"ids": both, "form": {scenario id: stored trace}}] of pairs that change different texts of a solution."""
    found: list[dict] = []
    say = {mistake.id: mistake.say for mistake in check.mistakes}
    forms = [(mistake.id, form) for mistake in check.mistakes for form in mistake.forms]
    if check.kind != "function" and len(forms) > MOST:
        return []
    probes = expanded(check.probing["probes"]) if check.probing else []
    alone = [form for mistake in data["mistakes"] for form in mistake["forms"]]
    for (a, one), (b, other) in itertools.combinations(forms, 2):
        form = both(one, other) if a != b else None
        try:
            subject = build(source, form, check.subject) if form else None
        except Exception:  # no Python any more
            continue
        if subject is None:
            continue
        traces = {s["id"]: run(subject, check.kind, s) for s in (*check.scenarios, *probes)}
        failed = {s["id"]: traces[s["id"]] for s in wrong(dict(data), traces)}
        if not failed or any(fits(failed, known) for known in [*alone, *(pair["form"] for pair in found)]):
            continue
        said, more = _said(data, traces)
        if more or not {say[a], say[b]} <= said:
            found.append({"ids": [a, b], "form": {id: pack(trace, DIGITS) for id, trace in failed.items()}})
    return found


def both(one: Form, other: Form) -> list[tuple[str, str]] | None:
    """Two lists of replacements as one, or None if they touch the same text."""
    if isinstance(one, str) or isinstance(other, str):
        return None
    olds = [old for old, _ in [*one, *other]]
    if any(a in b or b in a for a, b in itertools.combinations(olds, 2)):
        return None
    return [*one, *other]


def _said(data, traces):
    """(the sentences of known mistakes that are said without a doubt, whether more than two things are said)."""
    try:
        decide(dict(data), traces)
    except CheckError as error:
        text = " ".join(str(error).split())
        own = {mistake["say"]: " ".join(mistake["say"].split()) for mistake in data["mistakes"]}
        said = {say for say, words in own.items() if words in text and f"Perhaps: {words}" not in text}
        return said, text.count("Also: ") > 1
    return set(), False
