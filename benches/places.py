# SPDX-License-Identifier: MIT OR Apache-2.0
"""Do runs find each other: recall and false merges over pairs of simulated runs.

    python benches/places.py --seeds 821 822 … [--scenes office …] [--keep FOLDER]

Of every scene and seed two flights are flown in the same world; they should find each other. Flights
in worlds of different seeds should not. A match is false if it puts the middle of the place more
than `RIGHT` from where it belongs; worlds of different seeds have no right match. Pairs of flights
whose places share less than `OVERLAPPING` of their surfels by the true poses count for false merges only.
"""

from __future__ import annotations

import argparse
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
from place_clouds import FLIGHTS, kept_run
from scipy.spatial import cKDTree

from bentwing.places import describe_run, match_places

RIGHT = 0.3
OVERLAPPING = 0.4


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", required=True)
    parser.add_argument("--scenes", nargs="+", default=[flight.scene for flight in FLIGHTS])
    parser.add_argument("--keep", type=Path, help="keep the flights here, and use those kept")
    chosen = parser.parse_args()
    tally = {"found": 0, "overlapping": 0, "false": 0, "apart": 0, "merged": 0}
    for flight in FLIGHTS:
        if flight.scene not in chosen.scenes:
            continue
        runs = {}
        for seed in chosen.seeds:
            both = [kept_run(flight.scenario(seed, number), chosen.keep) for number in range(2)]
            runs[seed] = [
                (describe_run(run.points, run.times, run.trajectory), run.T_world_map)
                for run in both
            ]
            same_world(f"{flight.scene} {seed}", runs[seed], tally)
        for one, other in pairwise(chosen.seeds):
            apart(f"{flight.scene} {one} {other}", (runs[one][0], runs[other][1]), tally)
    print(
        f"found {tally['found']} of {tally['overlapping']} overlapping pairs, "
        f"{tally['false']} false matches in them; "
        f"merged {tally['merged']} of {tally['apart']} pairs of different worlds"
    )


def same_world(name: str, runs, tally: dict[str, int]) -> None:
    """Count whether two flights in one world find each other, and whether rightly."""
    (a, T_world_a), (b, T_world_b) = runs
    T_a_b = np.linalg.inv(T_world_a) @ T_world_b
    shares = [overlap(p, q, T_a_b) for p in a for q in b]
    began = time.process_time()
    accepted = [c for c in match_places(a, b) if c.accepted]
    elapsed = time.process_time() - began
    errors = [error(c.alignment.T_a_b, T_a_b, b[c.j].centre) for c in accepted]
    right = sum(e <= RIGHT for e in errors)
    false = len(errors) - right
    worst = max(errors, default=float("nan"))
    if max(shares, default=0.0) >= OVERLAPPING:
        tally["overlapping"] += 1
        tally["found"] += right > 0
    tally["false"] += false
    print(
        f"{name}: {right} right, {false} false of {len(shares)} pairs of places; overlap up to "
        f"{max(shares):.2f}, worst error {worst:.3f} m, {elapsed:.1f} s",
        flush=True,
    )


def apart(name: str, runs, tally: dict[str, int]) -> None:
    """Count whether flights in different worlds are merged."""
    accepted = [c for c in match_places(runs[0][0], runs[1][0]) if c.accepted]
    tally["apart"] += 1
    tally["merged"] += bool(accepted)
    print(f"{name}: {'MERGED' if accepted else 'kept apart'}", flush=True)


def overlap(p, q, T) -> float:
    """Share of q's surfels with one of p's within 0.5 m, by the true transform."""
    moved = q.surfels.means @ T[:3, :3].T + T[:3, 3]
    distances, _ = cKDTree(p.surfels.means).query(moved, distance_upper_bound=0.5)
    return float(np.isfinite(distances).mean())


def error(found, true, centre) -> float:
    """Distance (m) between where two transforms put a point."""
    return float(np.linalg.norm((found - true) @ np.append(centre, 1.0)))


if __name__ == "__main__":
    main()
