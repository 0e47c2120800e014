"""Notebooks for tests, made of the released ones and the solutions' answers."""

import json
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LAB1, LAB2 = "01_cartesian_ekf", "02_noise_mismatch"


def released(lab, *edits, fill=True, extra=()):
    """Setup, answers and checks of a released lab, filled in and edited, or blank; extra: (before id, source)."""
    answers = {cell["id"]: cell["source"] for cell in _cells("solutions", lab) if fill}
    kept = [cell for cell in _cells("notebooks", lab) if cell["metadata"]["labkit"] in ("setup", "answer", "check")]
    made = []
    for cell in (cell for cell in kept if cell["cell_type"] == "code"):
        made += [code(source, f"{len(made):08x}") for before, source in extra if before == cell["id"]]
        made.append(code("".join(answers.get(cell["id"], cell["source"])), cell["id"]))
    for old, new in edits:
        (holder,) = [cell for cell in made if cell["source"].count(old) == 1]
        holder["source"] = holder["source"].replace(old, new)
    return {"nbformat": 4, "nbformat_minor": 5, "metadata": {}, "cells": made}


def _cells(folder, lab):
    return json.loads((ROOT / folder / f"{lab}.ipynb").read_text(encoding="utf-8"))["cells"]


def code(source, id="", **metadata):
    return {
        "cell_type": "code",
        "id": id,
        "source": source,
        "metadata": metadata,
        "outputs": [],
        "execution_count": None,
    }


def save(path, content):
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return path
