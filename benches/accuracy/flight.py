# SPDX-License-Identifier: MIT OR Apache-2.0
"""How well a spun head's rate is held in gusts, and whether the bumper keeps clear.

Prints Markdown; every flight and run follows from the seeds.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from typing import get_args

import numpy as np

from benches.support import tables
from bentwing.flight.control import BumperSettings
from bentwing.flight.control.bumper import GRAVITY
from bentwing.simulate.plant.drives import FREE_RATE, drives
from bentwing.simulate.plant.flights import DESIRED, fly
from bentwing.simulate.plant.outcomes import outcomes
from bentwing.simulate.plant.weather import Weather
from bentwing.simulate.push.runs import PilotName, PlaceName, PushRun, run_push

SPIN_COLUMNS = (
    "drive", "in range", "flights without a stall > 2 s", "longest stall", "rate: 1 %", "median", "99 %",
)  # fmt: skip
PUSH_COLUMNS = (
    "place, pilot", "runs", "contacts", "least gap", "contacts without bumper", "largest push",
    "latency 99 %",
)  # fmt: skip
PLANNED = np.radians([150.0, 460.0])


def spin_table(options: argparse.Namespace) -> None:
    """Print one line per drive; all drives meet the same wind and pilots."""
    weather = Weather(max_wind=options.wind)
    print(
        f"{options.flights} flights of {options.minutes:g} min, wind and gusts up to "
        f"{weather.max_wind:g} m/s, desired {options.rate:.0f} °/s, seed {options.seed}\n"
    )
    print(tables.head(SPIN_COLUMNS))
    for name, drive in drives(np.radians(options.rate)).items():
        free = "free" in name
        flown = fly(
            drive,
            weather,
            n=options.flights,
            duration=60 * options.minutes,
            seed=options.seed,
            desired=FREE_RATE if free else np.radians(options.rate),
        )
        found = outcomes(flown, *PLANNED)
        low, middle, high = np.degrees(found.percentiles)
        share = "n/a" if free else f"{found.in_range:.2%}"
        rates = [f"{rate:.0f} °/s" for rate in (low, middle, high)]
        stalls = [f"{found.kept:.1%}", f"{found.longest_stalls.max():.1f} s"]
        print(tables.line([name, share, *stalls, *rates]), flush=True)


def push_table(options: argparse.Namespace) -> None:
    """Print one line per place and pilot, with the bumper and without."""
    print(tables.head(PUSH_COLUMNS))
    latencies, touched = [], 0
    for place in get_args(PlaceName):
        for pilot in get_args(PilotName):
            share = 0.8 if pilot == "push" else 0.2
            n = max(1, round(share * options.runs / len(get_args(PlaceName))))
            runs = [PushRun(place, pilot, options.seed + k) for k in range(n)]
            kept = [run_push(run) for run in runs]
            left = [run_push(replace(run, with_bumper=False)) for run in runs]
            ours = np.concatenate([found.latencies for found in kept])
            latencies.append(ours)
            touched += sum(found.touched for found in kept)
            cells = [
                f"{place}, {pilot}", f"{n}", f"{sum(found.touched for found in kept)}",
                f"{min(found.least_gap for found in kept):.2f} m",
                f"{sum(found.touched for found in left)}",
                f"{max(found.largest_push for found in kept):.2f} m/s²",
                f"{1e3 * np.percentile(ours, 99):.1f} ms",
            ]  # fmt: skip
            print(tables.line(cells), flush=True)
    limit = GRAVITY * np.tan(BumperSettings().max_push)
    late = 1e3 * np.percentile(np.concatenate(latencies), 99)
    print(
        f"\n{touched} contacts; the push is limited to {limit:.2f} m/s²; latency {late:.1f} ms (99 %)"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=200)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--wind", type=float, default=6.0, help="m/s, with gusts")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rate", type=float, default=np.degrees(DESIRED), help="desired, °/s")
    parser.add_argument("--runs", type=int, default=200, help="of the bumper")
    parser.add_argument("--only", choices=("spin", "bumper"))
    options = parser.parse_args()
    started = time.perf_counter()
    if options.only != "bumper":
        spin_table(options)
    if options.only != "spin":
        push_table(options)
    print(f"\n{time.perf_counter() - started:.0f} s")
