"""`labkit export github-classroom`: a template repository, with the checks that students see and no other."""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..authoring.release import CHECK, ROOT, Kit, proven
from ..exam.paper import CheckCell, Paper, read
from ..records import CommandError

WORKFLOW = Path(__file__).with_name("templates") / "classroom.yml.txt"
SETUP = "python3 lab.py setup"
# What the students' README says of handing in, and what it says here.
HAND_IN = (
    "check it, and hand in the file itself, such as",
    "check it, and hand it in: `git add -A`, `git commit -m Lab`, `git push`. The tests run under *Actions*. It is",
)
MINUTES = 10  # for one check: a notebook is run for it


def files(labs: Sequence[str], allowed: Sequence[str]) -> Kit:
    """The files of the repository. Raises CommandError for what is no lab with points, or would tell too much.

    allowed: of no use, as what runs there runs on GitHub's machines, which are thrown away.
    """
    tests = [test for lab in labs for test in visible(read(lab))]
    text = {
        ".github/classroom/autograding.json": json.dumps({"tests": tests}, indent=2, ensure_ascii=False) + "\n",
        ".github/workflows/classroom.yml": workflow(tests),
    }
    kit = proven(ROOT, labs)
    readme = kit["README.md"][0].decode().replace(*HAND_IN)
    return kit | {path: (content.encode(), 0o644) for path, content in (text | {"README.md": readme}).items()}


def visible(paper: Paper) -> list[dict[str, Any]]:
    """The checks in students' notebooks, as tests of GitHub Classroom. Raises CommandError for what cannot be one."""
    return [_test(paper, cell) for cell in paper.cells if cell.points is not None and not cell.hidden]


def _test(paper: Paper, cell: CheckCell) -> dict[str, Any]:
    where = f"{paper.lab}: the check '{cell.id}'"
    names = CHECK.findall(cell.source)
    if len(names) != 1:
        raise CommandError(f"{where} has to call check(...) once to be a test on GitHub.")
    if cell.points != int(cell.points or 0):
        raise CommandError(f"{where} gives {cell.points:g} points, and GitHub Classroom counts whole ones.")
    checked = f"python3 lab.py check notebooks/{paper.lab}.ipynb"
    return {
        "name": f"{paper.lab}: {cell.title}",
        "setup": SETUP,
        # All that is said goes to the log, and what decides is the line of this check.
        "run": f"{checked} 2>&1 | tee /dev/stderr | grep -cx 'PASS  {paper.lab}  {names[0]}'",
        "input": "",
        "output": "",
        "comparison": "included",
        "timeout": MINUTES,
        "points": int(cell.points),
    }


def workflow(tests: Sequence[dict[str, Any]]) -> str:
    """The workflow that runs these tests and tells GitHub Classroom the points."""
    steps, results = [], []
    ids = [f"test-{number}" for number in range(1, len(tests) + 1)]
    for id, test in zip(ids, tests):
        told = {"test-name": test["name"], "command": test["run"], "timeout": MINUTES, "max-score": test["points"]}
        rows = "".join(f"          {key}: {json.dumps(value, ensure_ascii=False)}\n" for key, value in told.items())
        steps.append(
            f"      - name: {json.dumps(test['name'], ensure_ascii=False)}\n        id: {id}\n"
            f"        uses: classroom-resources/autograding-command-grader@v1\n        with:\n{rows}"
        )
        results.append(f'          {id.upper()}_RESULTS: "${{{{steps.{id}.outputs.result}}}}"\n')
    words = {"STEPS": "".join(steps), "RESULTS": "".join(results), "RUNNERS": ",".join(ids), "SETUP": SETUP}
    text = WORKFLOW.read_text(encoding="utf-8")
    return re.sub(r"\b(STEPS|RESULTS)\n|\b(RUNNERS|SETUP)\b", lambda found: words[found[0].strip()], text)
