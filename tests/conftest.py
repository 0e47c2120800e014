import os
import signal
import sys

# One thread for each process, kernels and graders included: there are as many processes as cores, and threads that
# wait for one another burn a sixth of the time.
for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")
# jsonschema looks for it to check internet addresses, which notebooks have none of; it takes 2 s to read its grammar.
sys.modules.setdefault("rfc3987_syntax", None)

# A shell that starts tests in the background lets them ignore it, and a loop without an end would not be stopped.
signal.signal(signal.SIGINT, signal.default_int_handler)

import matplotlib  # noqa: E402 - after the number of threads
import pytest  # noqa: E402

from helpers.browser import browser  # noqa: E402, F401 - a fixture of several folders
from helpers.drawings import drawn  # noqa: E402, F401 - another

# Figures are drawn and no window opens. Not by MPLBACKEND, which kernels started by tests would inherit.
matplotlib.use("Agg")

# Those that take long, the longest first: two processes then end at about the same time.
LONG = [
    "anywhere",
    "front_ends",
    "command",
    "processors",
    "corpus",
    "browser",
    "labs",
    "marks",
    "team",
    "checks",
    "localizers",
    "handed_in",
]
LONG += ["lab", "benchmarks", "pictures", "release", "worker", "figures", "honesty", "house"]
# Files that as a whole take more than a few seconds, although each of their tests is quick.
SLOW = {
    "test_pictures",
    "test_figures",
    "test_release",
    "test_handed_in",
    "test_honesty",
    "test_worker",
    "test_markdown",
    "test_held",
    "test_promises",
    "test_alike",
    "test_identity",
}


@pytest.fixture(autouse=True)
def fault(caplog):
    """What is said beside a verdict may fail without a word to students: here it is heard. Tests may clear it."""
    yield caplog
    assert not [one for one in caplog.get_records("call") if one.name == "labkit.checks"], caplog.text


def pytest_itemcollected(item):
    if item.path.stem in SLOW:
        item.add_marker(pytest.mark.slow)


def pytest_collection_modifyitems(items):
    rank = {f"test_{name}": number for number, name in enumerate(LONG)}
    items.sort(key=lambda item: rank.get(item.path.stem, len(LONG)))
