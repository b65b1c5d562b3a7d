# SPDX-License-Identifier: MIT OR Apache-2.0
"""The flights of Tazir 2020 on several seeds: what `bentwing reproduce tazir2020` measures on one.

Each flight is simulated with a calibrated head (as in the paper), estimated by `ndt` and `continuous` on
one thread, and compared with its truth and with the map that the true poses make.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from benches.support import tables
from bentwing.evaluate.map import surface_error
from bentwing.evaluate.simulated import Truth
from bentwing.reproduce.campaign import Flown, fly
from bentwing.reproduce.tazir2020 import FLIGHTS
from bentwing.reproduce.tazir_measures import measure

COLUMNS = (
    "flight", "seed", "estimator", "way, m", "RTE, mean (max), m", "RRE, mean, °", "ATE, m",
    "registration RMSE, m", "past 1 m after, m", "map ÷ georeferenced", "s per s recorded",
    "CPU s per s",
)  # fmt: skip
NEAR = 60.0  # m, from the middle of the way: what is farther is not compared
SAMPLE = 100_000


def row_of(flown: Flown, trial: str, seed: int, world: Truth) -> str:
    """One row of the table."""
    result = flown.results[trial]
    first = [flown.flight.name, str(seed), trial]
    if result.trajectory is None:
        return tables.line([*first, f"gives up: {result.why}", *[""] * (len(COLUMNS) - 4)])
    found = measure(flown, result)
    rmse = f"{found.registration[:, 1].mean():.3f}" if len(found.registration) else "-"
    lost = "-" if found.lost_after is None else f"{found.lost_after:.0f}"
    cells = [
        f"{found.way[-1]:.0f}", f"{found.errors.rte.mean():.3f} ({found.errors.rte.max():.2f})",
        f"{np.degrees(found.errors.rre.mean()):.3f}", f"{result.rmse:.3f}", rmse, lost,
        f"{map_ratio(flown, trial, world):.2f}", f"{result.seconds / result.length:.2f}",
        f"{result.cpu / result.length:.2f}",
    ]  # fmt: skip
    return tables.line([*first, *cells])


def map_ratio(flown: Flown, trial: str, world: Truth) -> float:
    """Thickness of the map across the true surfaces, over that of the map from the true poses."""
    middle = flown.truth.positions.mean(axis=0)

    def distances(points: np.ndarray) -> np.ndarray:
        near = points[np.linalg.norm(points[:, :2] - middle[:2], axis=1) < NEAR]
        return world.distances(near[:: max(1, len(near) // SAMPLE)].astype(np.float64))

    best = distances(flown.true_points)
    error = surface_error(distances(flown.results[trial].points), best=best)
    return error.best_ratio or float("nan")


def main() -> None:
    """Print the table, row by row."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--only", nargs="+", help="flights whose names begin so", default=[""])
    parser.add_argument("--quick", action="store_true", help="the short flights")
    options = parser.parse_args()
    print(tables.head(COLUMNS), flush=True)
    for seed in options.seeds:
        for flight in FLIGHTS:
            if not any(flight.name.startswith(name) for name in options.only):
                continue
            with tempfile.TemporaryDirectory() as scratch:
                folder = Path(scratch) / "flight"
                seconds = flight.seconds(quick=options.quick)
                flown = fly(folder, lambda _: None, flight, seconds, seed)
                for trial in flown.results:
                    print(row_of(flown, trial, seed, Truth(folder)), flush=True)
