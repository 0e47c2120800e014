"""A class in the hands of other graders: each as its own documentation says, and what it gives each student."""

import csv
import json
import os
import shutil
import sqlite3
import subprocess
import sys
import zipfile
from pathlib import Path

from helpers.classroom import LAB, as_file
from helpers.reference import ROOT

NBGRADER = os.environ.get("LABKIT_NBGRADER") or sys.executable  # the Python that has it, with what labkit needs
STUB = "is still to be written"
AUTO = (
    "SELECT s.student_id, c.name, g.auto_score FROM grade g JOIN base_cell c ON c.id = g.cell_id "
    "JOIN submitted_notebook n ON n.id = g.notebook_id JOIN submitted_assignment s ON s.id = n.assignment_id"
)


def run(command, cwd=None, **more):
    """Run a program as in its own environment, with the kit of these tests; what it printed."""
    path = f"{Path(command[0]).parent}{os.pathsep}{os.environ['PATH']}"  # nbgrader starts alembic, which is beside it
    env = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUTF8": "1", "PATH": path, **more}
    done = subprocess.run(list(map(str, command)), cwd=cwd, env=env, capture_output=True, text=True, encoding="utf-8")
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout + done.stderr


def export(kind, *labs, out):
    run([sys.executable, "-m", "labkit", "export", kind, *labs, out])
    return out


def labkit(folder, books, *options):
    """{(student, check): points, None where a person reads} of `labkit grade`. books: {student: notebook}."""
    for student, book in books.items():
        as_file(folder / "class" / student / f"{LAB}.ipynb", book)
    out = folder / "graded"
    run([sys.executable, "-m", "labkit", "grade", folder / "class", "--lab", LAB, "--out", out, *options])
    with open(out / "grades.csv", encoding="utf-8-sig", newline="") as file:
        rows = list(csv.DictReader(file))
    return {(row["student"], row["check"]): float(row["points"]) if row["points"] else None for row in rows}


def nbgrader(course, books, python=NBGRADER):
    """The same of nbgrader: the course is exported, and the class's answers are put into what it releases."""
    tool = [python, "-m", "nbgrader"]
    export("nbgrader", LAB, out=course)
    run([*tool, "generate_assignment", LAB], course)
    given = (course / "release" / LAB / f"{LAB}.ipynb").read_text(encoding="utf-8")
    for student, book in books.items():
        as_file(course / "submitted" / student / LAB / f"{LAB}.ipynb", answered(json.loads(given), book))
    run([*tool, "autograde", LAB], course)
    with sqlite3.connect(course / "gradebook.db") as db:
        return {(student, check): points for student, check, points in db.execute(AUTO)}


def answered(handed, book):
    """nbgrader's copy of a lab, filled in as a notebook of ours."""
    own = {cell["id"]: cell for cell in book["cells"]}
    for cell in handed["cells"]:
        mine = own.pop(cell["id"], cell)
        if cell["metadata"].get("labkit") == "answer" and STUB not in "".join(mine["source"]):
            cell["source"] = mine["source"]
    handed["cells"] += [cell for cell in own.values() if cell["cell_type"] == "code"]
    return handed


def container(folder, packed, python=sys.executable):
    """A folder as Gradescope's container has it, from the zip that is uploaded, set up by its own script.

    No package is fetched here: `apt-get` does nothing, and the environment that lab.py would make is this one's.
    """
    root, tools = folder / "auto grader", folder / "tools"
    for name in ("source", "submission", "results"):
        (root / name).mkdir(parents=True)
    with zipfile.ZipFile(packed) as archive:
        archive.extractall(root / "source")
    shutil.copyfile(root / "source" / "run_autograder", root / "run_autograder")
    program(tools / "apt-get", 'echo "apt-get $@"')
    program(tools / "environment", f'PYTHONPATH="{root}/source/kit" exec "{python}" "$@"')
    made = f'mkdir -p "$LABKIT_VENV/bin" && cp "{tools}/environment" "$LABKIT_VENV/bin/python"'
    program(tools / "python3", f'case "$1" in *lab.py) {made};; *) exec "{python}" "$@";; esac')
    run(["bash", root / "source" / "setup.sh"], AUTOGRADER=str(root), PATH=f"{tools}{os.pathsep}{os.environ['PATH']}")
    return root


def program(path, line):
    path.parent.mkdir(exist_ok=True)
    path.write_text(f"#!/usr/bin/env bash\n{line}\n", encoding="utf-8")
    path.chmod(0o755)


def gradescope(root, book, student=17):
    """What results.json says of a notebook in a container."""
    shutil.rmtree(root / "submission")
    as_file(root / "submission" / f"{LAB}.ipynb", book)
    as_file(root / "submission_metadata.json", {"users": [{"id": student, "email": "x@example.org"}]})
    (root / "results" / "results.json").unlink(missing_ok=True)
    run(["bash", root / "run_autograder"], AUTOGRADER=str(root), PYTHONPATH="")
    return json.loads((root / "results" / "results.json").read_text(encoding="utf-8"))


def passed(root, tests, python=sys.executable):
    """Whether each test of a template repository passes there; the environment that lab.py would make is this one's."""
    tools = root.parent / "tools"
    program(tools / "python3", f'[ "$1" = lab.py ] && shift && PYTHONPATH="{root}" exec "{python}" -m labkit "$@"')
    env = {"PATH": f"{tools}{os.pathsep}{os.environ['PATH']}", "HOME": str(root.parent)}
    return [subprocess.run(test["run"], cwd=root, env=env, shell=True).returncode == 0 for test in tests]
