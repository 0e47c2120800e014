import matplotlib

# Figures are drawn and no window opens. Not by MPLBACKEND, which kernels started by tests would inherit.
matplotlib.use("Agg")

# Those that take minutes, the longest first: two processes then end at about the same time.
LONG = ("test_labs", "test_grading_marks", "test_grading_class", "test_browser")


def pytest_collection_modifyitems(items):
    rank = {name: number for number, name in enumerate(LONG)}
    items.sort(key=lambda item: rank.get(item.path.stem, len(LONG)))
