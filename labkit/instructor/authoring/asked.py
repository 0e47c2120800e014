"""What is wrong in solutions/checks, each in a sentence with the check's name, before anything is made from it."""

from collections.abc import Collection, Iterator
from difflib import get_close_matches
from typing import Any

from .spec import Check

KINDS = ("filter", "function")
CASE = ("id", "title", "look", "calls")


def problems(checks: Collection[Check], labs: Collection[str]) -> list[str]:
    """Sentences on the checks, such as "solutions/checks, check 'my-lab-bearing': ...". labs: those that there are."""
    names = [check.name for check in checks]
    found = []
    for check in checks:
        told = [*_of(check, labs)] + ["two checks have this name."] * (names.count(check.name) > 1)
        found += [f"solutions/checks, check {check.name!r}: {says}" for says in told]
    return [*dict.fromkeys(found)]


def _of(check: Check, labs: Collection[str]) -> Iterator[str]:
    if check.lab not in labs:
        near = get_close_matches(check.lab, labs, 1)
        yield f"there is no lab {check.lab!r}" + (f": is {near[0]!r} meant?" if near else ".")
    if check.kind not in KINDS:
        yield f"its kind is {check.kind!r}, and should be one of {', '.join(KINDS)}."
    if not isinstance(check.scenarios, list) or not all(isinstance(case, dict) for case in check.scenarios):
        yield "its cases should be a list of dictionaries."
    else:
        yield from _cases(check)
    for what, ones in (("right forms", check.right), ("mistakes", check.mistakes)):
        yield from _once(what, [one.id for one in ones])
    for right in check.right:
        yield from _form(f"the right form {right.id!r}", right.form)
    for mistake in check.mistakes:
        if not isinstance(mistake.say, str) or not mistake.say.strip():
            yield f"the mistake {mistake.id!r} has no sentence for the student."
        for form in mistake.forms:
            yield from _form(f"the mistake {mistake.id!r}", form)


def _cases(check: Check) -> Iterator[str]:
    yield from _once("cases", [case.get("id") for case in check.scenarios])
    for case in check.scenarios:
        needed = (*CASE, *["make"] * (check.kind == "filter"))
        if missing := [key for key in needed if key not in case or case[key] == ""]:
            yield f"the case {case.get('id')!r} lacks {', '.join(missing)}."
        elif not isinstance(case["calls"], list) or not all(isinstance(call, list) and call for call in case["calls"]):
            yield f"the calls of the case {case['id']!r} should be lists, a name and what it is called with each."


def _once(what: str, ids: list) -> Iterator[str]:
    for id in dict.fromkeys(map(repr, ids)):
        if [*map(repr, ids)].count(id) > 1:
            yield f"two of its {what} have the id {id}."


def _form(whose: str, form: Any) -> Iterator[str]:
    pairs = [] if isinstance(form, str) else form if isinstance(form, list | tuple) else [None]
    if not all(isinstance(p, tuple | list) and len(p) == 2 and all(isinstance(t, str) for t in p) for p in pairs):
        yield f"{whose} should be a list of edits, each (what stands in the solution, what comes instead)."
