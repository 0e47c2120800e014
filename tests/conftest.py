import matplotlib

from helpers.drawings import drawn  # noqa: F401 - a fixture of several folders

# Figures are drawn and no window opens. Not by MPLBACKEND, which kernels started by tests would inherit.
matplotlib.use("Agg")

# Those that take minutes, the longest first: two processes then end at about the same time.
LONG = ("test_labs", "test_marks", "test_command", "test_browser")


def pytest_collection_modifyitems(items):
    rank = {name: number for number, name in enumerate(LONG)}
    items.sort(key=lambda item: rank.get(item.path.stem, len(LONG)))
