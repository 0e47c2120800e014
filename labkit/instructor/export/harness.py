"""What the autograder of `labkit export gradescope` runs in its container: one submission, one results.json."""

import json
import os
import sys
import time
from pathlib import Path
from typing import Any

from .. import files
from ..exam.paper import read
from ..records import Check, Result
from ..trouble import ended
from . import SETTINGS
from .single import graded, told

# Students see what their own notebook tells them at once, and what hidden checks say when the grades are published:
# before that, they could try until all is right.
VISIBLE, LATER = "visible", "after_published"


def main() -> int:
    """Grade what is in the submission's folder; exit status. What is not graded leaves no results, and no score."""
    return ended("labkit", lambda: grade(Path(os.environ.get("AUTOGRADER", "/autograder"))))


def grade(root: Path) -> None:
    """Grade the submission in Gradescope's folder `root`. Raises CommandError and OSError."""
    start = time.monotonic()
    settings = json.loads((root / "source" / SETTINGS).read_text(encoding="utf-8"))
    about = settings["lab"], root / "submission", student(root / "submission_metadata.json")
    result = graded(*about, settings["seed"], settings["allowed"])
    found = results(result, read(settings["lab"]).checks)
    found["execution_time"] = round(time.monotonic() - start, 1)
    (root / "results").mkdir(exist_ok=True)
    files.write(root / "results" / "results.json", json.dumps(found, indent=1))


def student(metadata: Path) -> str:
    """Who handed in, as Gradescope's numbers: those of a group together; '' where it does not say."""
    try:
        users = json.loads(metadata.read_text(encoding="utf-8"))["users"]
        return " ".join(sorted(str(user["id"]) for user in users))
    except (OSError, ValueError, LookupError, TypeError):
        return ""


def results(result: Result, checks: list[Check]) -> dict[str, Any]:
    """What results.json says: a test for each check that is not read by a person, and the written answers as text."""
    if result.problem:
        return {"score": 0, "output": result.problem, "tests": []}
    marks = {mark.check: mark for mark in result.marks}
    tests = [
        {
            "name": check.title,
            "score": marks[check.id].points or 0,
            "max_score": check.points,
            "output": told(marks[check.id]),
            "visibility": LATER if check.hidden else VISIBLE,
        }
        for check in checks
        if not check.hand
    ]
    return {"output": _said(result, checks), "tests": tests}


def _said(result, checks):
    """Notes on the hand-in, and its written answers: who reads them needs not open the notebook."""
    lines = list(result.notes)
    for check in (check for check in checks if check.hand):
        answer = result.answers.get(check.id, "").strip()
        lines += ["", f"{check.title} ({check.points:g} points, read by a person)", answer or "No answer was found."]
    return "\n".join(lines).strip()


if __name__ == "__main__":
    sys.exit(main())
