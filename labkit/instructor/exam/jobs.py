"""What is graded, with what, and how it gets into a batch's folder."""

import contextlib
import json
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..intake.submission import Work
from ..sandbox.launch import Sandbox
from . import batch
from .paper import Paper

CHECK = ("id", "points", "hidden", "uses", "draws", "divided", "parts")  # what the kernel knows of a check cell
LARGEST = 40  # submissions in a batch: more would cost memory, fewer a kernel start each


@dataclass(frozen=True)
class Job:
    """One submission to grade. key: what its inputs are drawn from;  work: the file of `keep`, or what is in it, which
    can travel;  done: checks that have a mark.
    """

    id: int
    key: str
    work: str | bytes
    done: frozenset[str] = frozenset()

    def packed(self) -> "Job":
        """The same for another machine."""
        return replace(self, work=Path(self.work).read_bytes()) if isinstance(self.work, str) else self


def keep(path: Path, work: Work) -> str:
    """Write what of a submission is run to a file, so that the memory for a class does not grow with it; its path."""
    files = {name: b64encode(content).decode("ascii") for name, content in work.files.items()}
    path.write_text(json.dumps({"cells": work.cells, "sources": work.sources, "files": files}), encoding="utf-8")
    return str(path)


@dataclass(frozen=True)
class Room:
    """What a batch is graded with, the same for all batches; plain data, so that it can travel."""

    paper: Paper
    seed: int
    way: dict[str, Any]  # of the Sandbox
    time: dict[str, float]  # seconds: {"call", "total"}

    def at(self, sandbox: Sandbox) -> "Room":
        """The same with another machine's sandbox."""
        return replace(self, way=way(sandbox))


def batches(jobs: Sequence[Job], workers: int) -> list[Sequence[Job]]:
    """Lists of jobs, as many for each worker, none above LARGEST: each costs the start of a kernel."""
    size = max(1, min(LARGEST, -(-len(jobs) // workers)))
    return [jobs[i : i + size] for i in range(0, len(jobs), size)]


def write_batch(folder: str | Path, room: Room, jobs: Sequence[Job], runtime: str) -> None:
    """Put a batch's files into `folder`: batch.json and the check notebook."""
    paper = room.paper
    content = {
        "seed": room.seed,
        "subjects": paper.subjects,
        "time": room.time,
        "sandbox": {**room.way, "runtime": runtime},
        "checks": [{key: getattr(c, key) for key in CHECK} for c in paper.cells],
        "given": given(paper),
        "students": [{"key": job.key, "work": _unpacked(job, Path(folder, f"{n}.json"))} for n, job in enumerate(jobs)],
    }
    Path(folder, "batch.json").write_text(json.dumps(content), encoding="utf-8")
    notebook = batch.notebook(paper, [job.done for job in jobs], folder)
    Path(folder, "checks.ipynb").write_text(json.dumps(notebook), encoding="utf-8")


def _unpacked(job, path):
    if isinstance(job.work, bytes):
        path.write_bytes(job.work)
    return str(path) if isinstance(job.work, bytes) else job.work


def given(paper: Paper) -> list[dict[str, Any]]:
    """The code of the students' notebook as it was handed out: it supplies what a student's lacks."""
    return [
        {"number": cell.number, "id": cell.id, "role": cell.role, "code": True, "source": cell.source}
        for cell in paper.released
        if cell.code and cell.role != "answer"
    ]


def take_figures(folder: str | Path, jobs: Sequence[Job]) -> dict[int, dict[str, np.ndarray]]:
    """{job id: {name: array (...,)}} of the figures that a batch left in its folder."""
    found = {}
    for number, job in enumerate(jobs):
        path = Path(folder, f"figure-{number}.npz")
        with contextlib.suppress(OSError, ValueError), np.load(path, allow_pickle=False) as stored:
            found[job.id] = {name: stored[name] for name in stored.files}
    return found


def way(sandbox: Sandbox) -> dict[str, Any]:
    """A Sandbox as plain data, without the folder of this machine."""
    return {**asdict(sandbox), "runtime": ""}
