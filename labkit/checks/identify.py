"""Which line of a student's filter is wrong, whatever the mistake: probes, read in the order of the code."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .find_predict import predict, start
from .find_update import update
from .findings import Finding, Probed, alike, close
from .probing import answers, stops, unpacked, with_noise
from .trace import Trace


def probed(probing: Mapping[str, Any], traces: Mapping[str, Trace]) -> Probed:
    """The answers to a check's probes, beside the right ones."""
    probes = {probe["id"]: probe for probe in probing["probes"]}
    mine = answers(probing["probes"], traces)
    right = {id: unpacked(stored) for id, stored in probing["right"].items()}
    for id, answer in mine.items():  # where the constructor keeps another R, what follows from that is no mistake
        R, own = right[id].fields.get("R"), answer.fields.get("R")
        if R is not None and own is not None and own.shape == R.shape and not close(own, R):
            right[id] = with_noise(right[id], own)
    x, P = probing["probes"][-1]["look"][:2]
    known: dict[str, list] = {}
    for part, *value in (entry for forms in probing["known"].values() for form in forms for entry in form):
        known.setdefault(part, []).append(value)
    return Probed(probes, mine, right, probing["rows"], x, P, stops(probing["probes"], traces), known)


def findings(asked: Probed) -> list[Finding]:
    """The wrong quantities that the answers to probes show, the first to mend first; [] where none is sure."""
    with np.errstate(all="ignore"):
        try:
            made = start(asked)
            swapped = any(finding.part == "R in __init__" for finding in made)  # with Q, which then stands in R's place
            found = [*made, *predict(asked), *update(asked)]
            return [finding for finding in found if finding.part != "Q in update" or not swapped]
        except (np.linalg.LinAlgError, ValueError):  # a student's numbers may be of any size and shape
            return []


@dataclass(frozen=True)
class Told:
    """What is said of one wrong quantity;  known: the known mistake whose words these are, or ''."""

    part: str
    text: str
    known: str = ""


def told(data: Mapping[str, Any], traces: Mapping[str, Trace], named: Sequence[Mapping]) -> list[Told]:
    """The wrong quantities of a filter, each in the words of a known mistake where its numbers are those.

    named: known mistakes that were recognised by what comes of a check's own inputs.
    """
    asked = probed(data["probing"], traces)
    known = data["probing"]["known"]
    say = {mistake["id"]: mistake["say"] for mistake in data["mistakes"]}
    predicts = all(id in asked.mine for id in asked.right if id.startswith(("predict", "noise")))
    silent = [mistake["say"] for mistake in named if not known[mistake["id"]]]  # what stops shows no numbers
    said: list[Told] = []
    left = findings(asked)
    while left:
        fits = [(id, covered) for id, forms in known.items() if (covered := _fits(left, forms))]
        id, covered = max(fits, key=lambda fit: len(fit[1]), default=("", left[:1]))
        words = "" if _may_be_another(left, id, known) else say.get(id, "")
        if not words and not left[0].value and silent:
            words = silent.pop(0)
        said.append(Told(left[0].part, words or _sentence(left[0], not said, asked.fine, predicts), words))
        left = [finding for finding in left if finding not in covered]
    return said


def _may_be_another(found, id, known):
    """Whether the first finding is as much that of a known mistake that shows in H or R, too, which a gain hides."""
    if "gain" not in [finding.part for finding in found[1:]]:
        return False
    others = [form for other, forms in known.items() if other != id for form in forms]
    more = [form for form in others if {"H", "R"} & {part for part, *_ in form} - {found[0].part}]
    return any(part == found[0].part and alike(found[0].value, value) for form in more for part, *value in form)


def _fits(found, forms):
    """Those of the findings, the first among them, that one form of a known mistake shows, or []."""
    for form in forms:
        covered = [next((f for f in found if f.part == part and alike(f.value, value)), None) for part, *value in form]
        if found[0] in covered and None not in covered:
            return covered
    return []


def _sentence(finding, first, fine, predicts):
    """A finding's text; that of the first one says before what is right, where that is something of its own."""
    text = finding.text
    if not first or finding.part.endswith(("__init__", "predict", "motion")):
        return text
    right = ["`predict`"] * predicts + fine
    if not right:
        return text
    names = f"{', '.join(right[:-1])} and {right[-1]} are" if len(right) > 1 else f"{right[0]} is"
    start = text.split()[0]
    text = text[0].lower() + text[1:] if len(start) > 1 and start.isalpha() else text
    return f"{names[0].upper() + names[1:]} right; {text}"
