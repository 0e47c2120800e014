"""Grade a batch of submissions in a process of its own: pytest with nbval over one check notebook.

`python -m labkit.grading.batch` reads folders from its standard input, a line for each batch, and writes
marks to its standard output, a JSON line for each, as soon as nbval knows them; it ends when its input
does, so that it never outlives the grader.
"""

import json
import os
import sys
import threading
from pathlib import Path

import nbformat

CELL_SECONDS = 120  # more than all of one student's time


def notebook(paper, done):
    """The check notebook: the set-up once, then each check cell of a Paper for each student.

    done: for each student the ids of the checks that have a mark already and are left out.
    """
    start = (
        f"from labkit.grading.examination import Examination\n"
        f"examination = Examination('.', {paper.exam}, get_ipython())"
    )
    cells = [_setup(paper.setup), _setup(start)]
    for number, marked in enumerate(done):
        for cell in paper.cells:
            if cell.id in marked:
                continue
            source = f"examination.begin({number}, {cell.id!r}, globals())\n{cell.source}"
            outputs = [nbformat.v4.new_output("stream", name="stdout", text=cell.printed)] if cell.printed else []
            cells.append(
                nbformat.v4.new_code_cell(
                    source, outputs=outputs, execution_count=1, id=f"s{number}-{cell.id}",
                    metadata={"grading": {"number": number, "check": cell.id}},
                )
            )  # fmt: skip
    cells.append(_setup("examination.end()"))
    made = nbformat.v4.new_notebook(cells=cells)
    made.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return made


def _setup(source):
    return nbformat.v4.new_code_cell(source, execution_count=1, metadata={"tags": ["nbval-ignore-output"]})


def grade(folder, news):
    """Run the check notebook in `folder` and give each mark to `news`."""
    import pytest

    from .recorder import Recorder

    batch = json.loads((Path(folder) / "batch.json").read_text(encoding="utf-8"))
    points = {check["id"]: check["points"] for check in batch["checks"] if check["points"] is not None}
    arguments = [
        str(Path(folder, "checks.ipynb")), "--nbval", "--nbval-current-env", f"--nbval-cell-timeout={CELL_SECONDS}",
        "-p", "nbval.plugin", "-p", "no:cacheprovider", "--color=no", "--tb=line", "-c", os.devnull, f"--rootdir={folder}",
    ]  # fmt: skip
    return pytest.main(arguments, plugins=[Recorder(folder, points, news)])


def main():
    """Serve the grader."""
    os.environ.update(PYTEST_DISABLE_PLUGIN_AUTOLOAD="1", JUPYTER_PLATFORM_DIRS="1")
    out = os.fdopen(os.dup(1), "w", encoding="utf-8", buffering=1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)

    def news(item):
        try:
            out.write(json.dumps(item) + "\n")
        except OSError:  # the grader is gone
            os._exit(1)

    lines = iter(sys.stdin.readline, "")
    for line in lines:
        folder = json.loads(line)["folder"]
        os.environ["IPYTHONDIR"] = os.path.join(folder, "ipython")  # no start-up files of the person's own
        code = grade(folder, news)
        news({"end": folder, "code": int(code)})
    os._exit(0)


def watch(parent):
    """End this process when its parent is gone."""

    def look():
        while os.getppid() == parent:
            threading.Event().wait(0.5)
        os._exit(1)

    threading.Thread(target=look, daemon=True).start()


if __name__ == "__main__":
    watch(os.getppid())
    main()
