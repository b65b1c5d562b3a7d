# SPDX-License-Identifier: MIT OR Apache-2.0
"""Two tables: how well a spun head's rate is held in gusts, and whether the bumper keeps clear.

Prints Markdown; every flight and run follows from the seeds.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from bentwing.simulate.plant.drives import DRIVES, FREE_RATE
from bentwing.simulate.plant.flights import DESIRED, fly
from bentwing.simulate.plant.outcomes import outcomes
from bentwing.simulate.plant.weather import Weather

PLANNED = np.radians([150.0, 460.0])


def spin_table(options: argparse.Namespace) -> None:
    """Print one line per drive; all drives meet the same wind and pilots."""
    weather = Weather(max_wind=options.wind)
    print(
        f"{options.flights} flights of {options.minutes:g} min, wind and gusts up to "
        f"{weather.max_wind:g} m/s, seed {options.seed}\n"
    )
    print(
        "| drive | in range | flights without a stall > 2 s | longest stall | rate: 1 % | median | 99 % |"
    )
    print("|---|---|---|---|---|---|---|")
    for name, drive in DRIVES.items():
        free = "free" in name
        flown = fly(
            drive,
            weather,
            n=options.flights,
            duration=60 * options.minutes,
            seed=options.seed,
            desired=FREE_RATE if free else DESIRED,
        )
        found = outcomes(flown, *PLANNED)
        low, middle, high = np.degrees(found.percentiles)
        share = "n/a" if free else f"{found.in_range:.2%}"
        print(
            f"| {name} | {share} | {found.kept:.1%} | {found.longest_stalls.max():.1f} s "
            f"| {low:.0f} °/s | {middle:.0f} °/s | {high:.0f} °/s |",
            flush=True,
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=200)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--wind", type=float, default=6.0, help="m/s, with gusts")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    started = time.perf_counter()
    spin_table(options)
    print(f"\n{time.perf_counter() - started:.0f} s")


if __name__ == "__main__":
    main()
