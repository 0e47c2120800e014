"""How fast the kit is, as ratios within one run: `python tests/benchmarks/kernel.py [--quick]`.

The two sides of a ratio take turns, and medians are compared, so that a machine that slows down in
between slows both. --quick only shows that everything runs.
"""

import subprocess
import sys
import time
from pathlib import Path
from statistics import median

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))

import numpy as np  # noqa: E402
from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402

from labkit import Robot, make_filter, random_map, replay, simulate  # noqa: E402
from labkit.plots import plot_run  # noqa: E402
from labkit.widgets import RunExplorer  # noqa: E402

from helpers.reference import Q, R, history, record, solution  # noqa: E402


def paired(one, other, rounds):
    """Median seconds of two functions called in turns."""
    times = ([], [])
    for _ in range(rounds):
        for work, kept in zip((one, other), times):
            start = time.perf_counter()
            work()
            kept.append(time.perf_counter() - start)
    return median(times[0]), median(times[1])


def row(what, value, target, detail):
    print(f"{what:44s} {value:8s} target {target:14s} {detail}", flush=True)


def replay_over_bare_loop(rounds):
    log, KF = record(), solution("xy")
    controls, measurements = log.controls, log.measurements()

    def bare():
        kf = make_filter(KF, log)
        for u, y in zip(controls, measurements):
            kf.predict(u)
            kf.update(y)

    kit, loop = paired(lambda: replay(make_filter(KF, log), log), bare, rounds)
    row(
        "replay / bare loop of predict and update",
        f"{kit / loop:.2f}",
        "at most 1.15",
        f"{kit * 1e3:.2f} ms, {loop * 1e3:.2f} ms",
    )


def simulate_against_the_loop(rounds):
    m = random_map(25, rng=1)

    def loop():
        r = Robot((2, -2), Q, R["xy"], rng=1)
        for _ in range(160):
            r.action()
            r.measure(m)

    slow, fast = paired(loop, lambda: simulate(Robot((2, -2), Q, R["xy"], rng=1), m), rounds)
    row(
        "step-by-step loop / simulate", f"{slow / fast:.1f}", "at least 10", f"{slow * 1e3:.2f} ms, {fast * 1e3:.3f} ms"
    )


def redraw_against_a_fresh_figure(rounds):
    log = record()
    box = RunExplorer(solution("xy"), log, "xy", ("Q", "R"), "nees", 25, 2.5, 1, None, None, np.zeros(2), 3 * np.eye(2))

    def fresh():
        figure = Figure((9.2, 3.9), dpi=100, layout="constrained")
        plot_run(figure.subplots(1, 3), log, run)
        FigureCanvasAgg(figure).draw()

    run = history(log)
    slow, fast = paired(fresh, box.canvas._draw, rounds)
    row(
        "fresh figure / redraw of what moves",
        f"{slow / fast:.1f}",
        "at least 20",
        f"{slow * 1e3:.1f} ms, {fast * 1e3:.2f} ms",
    )


def python(code):
    return lambda: subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def import_over_numpy(rounds):
    kit, plain = paired(python("import labkit"), python("import numpy"), rounds)
    row(
        "import labkit / import numpy",
        f"{kit / plain:.2f}",
        "at most 1.3",
        f"{kit * 1e3:.0f} ms, {plain * 1e3:.0f} ms, each with Python's start",
    )


def check_one_notebook(rounds):
    for notebook in sorted((ROOT / "solutions").glob("*.ipynb")):
        command = [sys.executable, "-m", "labkit", "check", str(notebook)]
        check, start = paired(
            lambda: subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL),
            python("import numpy, matplotlib.pyplot"),
            rounds,
        )
        row(
            f"labkit check {notebook.stem}",
            f"{check:.2f} s",
            "at most 3 s",
            f"of it imports and Python's start {start:.2f} s",
        )


if __name__ == "__main__":
    quick = "--quick" in sys.argv
    replay_over_bare_loop(2 if quick else 41)
    simulate_against_the_loop(2 if quick else 41)
    redraw_against_a_fresh_figure(2 if quick else 21)
    import_over_numpy(1 if quick else 15)
    check_one_notebook(1 if quick else 5)
