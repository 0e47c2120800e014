"""How well, how soon and how cheaply the localizers of labs 4 and 5 find a robot: the figures, over many runs.

python tests/benchmarks/legged.py [--runs 60] [--presets real harsh] [--all]
"""

import argparse
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from labkit.legged import LeggedRobot, race, table  # noqa: E402

from helpers.localizers import CONTESTANTS  # noqa: E402


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=60)
    parser.add_argument("--presets", nargs="+", default=["real", "harsh"])
    parser.add_argument("--all", action="store_true", help="the rivals of the paper's table 1 as well")
    told = parser.parse_args()
    names = [
        name
        for name in CONTESTANTS
        if told.all or name not in ("EKF, no gate", "triangulation", "MCL 500", "MCL + EKF")
    ]
    for preset in told.presets:
        chosen = {name: CONTESTANTS[name] for name in names}
        quiet = race(chosen, [LeggedRobot(preset, rng=seed).record(360) for seed in range(told.runs)])
        carried = race(
            chosen, [LeggedRobot(preset, rng=1000 + seed).record(310, kidnap=150) for seed in range(told.runs)]
        )
        print(
            f"\nPreset {preset}: {told.runs} walks of 36 s without a kidnapping (tracking from 10 s on, cost of a step)"
        )
        print(table(quiet))
        print(f"{told.runs} walks with a kidnapping at 15 s, 16 s left")
        print(table(carried))
        by_name = {r.name: 100 * r.tracking.mean() for r in quiet}
        hybrid = by_name["grid (backgr.) + EKF"]
        ratios = {other: hybrid / by_name[other] for other in ("EKF alone", "grid alone", "MCL 2000")}
        print(
            "hybrid's tracking error over that of", ", ".join(f"{name}: {value:.2f}" for name, value in ratios.items())
        )
        worst = [np.nanmax(r.recovered()) for r in carried if r.name == "grid (backgr.) + EKF"]
        print(f"its slowest recovery: {worst[0]:.0f} steps")


if __name__ == "__main__":
    main()
