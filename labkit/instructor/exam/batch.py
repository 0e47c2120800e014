"""Grade a batch of submissions in a process of its own: pytest with nbval over one check notebook.

`python -m labkit.instructor.exam.batch` reads folders from its standard input, a line for each batch, and writes
marks to its standard output, a JSON line for each, as soon as nbval knows them; it ends when its input
does, so that it never outlives the grader.
"""

import contextlib
import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Container, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...notebook.usage import FAR

if TYPE_CHECKING:  # what grades needs no papers, and is there sooner without
    from .paper import Paper

SPARE = 20  # seconds that a check cell may take beyond all of one student's time
LOOK = 1  # seconds between two looks at whether the kernel lives


def notebook(paper: "Paper", done: Sequence[Container[str]], folder: str | Path) -> dict[str, Any]:
    """The check notebook: the set-up once, then each check cell of a Paper for each student.

    folder: the batch's;  done: for each student the ids of the checks that have a mark already and are left out.
    """
    # The first worker starts before the exam does.
    start = f"from labkit.instructor.exam.kernel import Batch\nbatch = Batch({str(folder)!r}, get_ipython())"
    cells = [_setup(start, "start"), _setup(f"{paper.setup}\nbatch.hold(exam)", "setup")]
    for number, marked in enumerate(done):
        for cell in paper.cells:
            if cell.id in marked:
                continue
            source = f"batch.begin({number}, {cell.id!r}, globals())\n{cell.source}"
            about = {"grading": {"number": number, "check": cell.id}}
            cells.append(_code(source, f"s{number}-{cell.id}", about, cell.printed))
    cells.append(_setup("batch.end()", "end"))
    return {"cells": cells, "metadata": {}, "nbformat": 4, "nbformat_minor": 5}


def _setup(source, id):
    return _code(source, id, {"tags": ["nbval-ignore-output"]})


def _code(source, id, metadata, printed=""):
    outputs = [{"output_type": "stream", "name": "stdout", "text": printed}] if printed else []
    # nbval compares only cells that have been run once.
    return {
        "cell_type": "code",
        "id": id,
        "metadata": metadata,
        "source": source,
        "outputs": outputs,
        "execution_count": 1,
    }


def grade(folder: str | Path, news: Callable[[dict], None]) -> int:
    """Run the check notebook in `folder` and give each mark to `news`."""
    import pytest

    from .recorder import Recorder

    batch = json.loads((Path(folder) / "batch.json").read_text(encoding="utf-8"))
    points = {check["id"]: check["points"] for check in batch["checks"] if check["points"] is not None}
    parts = {check["id"]: check["parts"] for check in batch["checks"]}
    arguments = [
        str(Path(folder, "checks.ipynb")),
        "--nbval",
        "--nbval-current-env",
        f"--nbval-cell-timeout={FAR * (batch['time']['total'] + SPARE)}",
        "-p",
        "nbval.plugin",
        "-p",
        "no:cacheprovider",
        "--color=no",
        "--tb=line",
        "-c",
        os.devnull,
        f"--rootdir={folder}",
    ]
    return pytest.main(arguments, plugins=[Recorder(folder, points, news, parts)])


def ready() -> None:
    """Load what grading needs, once in a process, and start a first kernel meanwhile."""
    # jsonschema looks for it to check internet addresses, which notebooks' metadata have none of; that it reads
    # its grammar takes longer than all else here.
    sys.modules.setdefault("rfc3987_syntax", None)  # type: ignore[arg-type]  # None: there is none
    import nbval.kernel

    first = _Started(nbval.kernel.start_new_kernel, nbval.kernel.CURRENT_ENV_KERNEL_NAME)
    nbval.kernel.start_new_kernel = first.take
    import nbval.plugin

    get_message = nbval.kernel.RunningKernel.get_message

    def patient(kernel, stream, timeout=None):
        """As nbval's own, which waits 5 s for output, too short on a busy machine, and minutes for a dead kernel."""
        stop = time.monotonic() + max(timeout or 0, SPARE * FAR)
        while True:
            try:
                return get_message(kernel, stream, timeout=LOOK)
            except queue.Empty:
                if not kernel.is_alive() or time.monotonic() > stop:
                    raise

    nbval.kernel.RunningKernel.get_message = patient


class _Started:
    """A kernel that starts while the grader still looks at what was handed in; later ones as nbval starts them."""

    def __init__(self, start: Callable, name: str) -> None:
        self._start, self._name, self._found = start, name, None
        self._thread: threading.Thread | None = threading.Thread(target=self._begin)
        self._thread.start()

    def _begin(self):
        with contextlib.suppress(RuntimeError):  # take starts another
            self._found = self._start(kernel_name=self._name, stderr=subprocess.DEVNULL)

    def take(self, **options: Any) -> tuple:
        """The manager and the client of a kernel, as of nbval's own function."""
        if self._thread:
            self._thread.join()
        found, self._found, self._thread = self._found, None, None
        return found if found and found[0].is_alive() else self._start(**options)


def main() -> None:
    """Serve the grader."""
    os.environ.update(PYTEST_DISABLE_PLUGIN_AUTOLOAD="1", JUPYTER_PLATFORM_DIRS="1")
    out = os.fdopen(os.dup(1), "w", encoding="utf-8", buffering=1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)

    def news(item):
        try:
            out.write(json.dumps(item) + "\n")
        except OSError:  # the grader is gone
            os._exit(1)

    os.environ["IPYTHONDIR"] = _profile(tempfile.mkdtemp(prefix="ipython-", dir=os.getcwd()))
    ready()  # while the grader is still looking at what was handed in
    lines = iter(sys.stdin.readline, "")
    for line in lines:
        folder = json.loads(line)["folder"]
        code = grade(folder, news)
        news({"end": folder, "code": int(code)})
    os._exit(0)


def _profile(folder):
    """A folder for IPython: no start-up files of the person's own, no database of what was run, and a kernel that ends
    with this process, by whomever orphans are taken in.
    """
    profile = Path(folder, "profile_default")
    profile.mkdir()
    (profile / "ipython_kernel_config.py").write_text(
        f"c.HistoryManager.enabled = False\nfrom labkit.instructor.exam.batch import watch\nwatch({os.getpid()})\n",
        encoding="utf-8",
    )
    return str(profile.parent)


def watch(parent: int) -> None:
    """End this process when its parent is gone."""

    def look():
        while os.getppid() == parent:
            threading.Event().wait(0.5)
        os._exit(1)

    threading.Thread(target=look, daemon=True).start()


if __name__ == "__main__":
    watch(os.getppid())
    main()
