# SPDX-License-Identifier: MIT OR Apache-2.0
"""MapClosures on the flights that `benches/places.py --keep FOLDER` has kept.

    PYTHON benches/peers/map_closures_places.py FOLDER --seeds 821 822 … [--resolution 0.5]

PYTHON has `pip install map-closures` and needs nothing of ours. Its local maps are the same 10 s of
points; of each place all closures with at least `--inliers` inliers count. They are planar: their
error is measured in the plane of the map.
"""

import argparse
from itertools import pairwise
from pathlib import Path

import numpy as np
from map_closures.config.config import MapClosuresConfig
from map_closures.map_closures import MapClosures

SCENES = ("office", "courtyard", "forest", "cave", "mine", "town", "dam")
FAR = 1000  # between the numbers of two runs: neighbours in number are not compared
RIGHT, OVERLAPPING = 0.5, 0.4  # m, looser than ours; share of cells of 0.5 m


def places(path):
    kept = np.load(path)
    times, points = kept["times"], kept["points"].astype(np.float64)
    n = max(1, round((times[-1] - times[0]) / 10.0))
    edges = np.linspace(times[0], times[-1], n + 1)[1:-1]
    parts = np.split(points, np.searchsorted(times, edges))
    return [(part - (c := np.median(part, axis=0)), c) for part in parts], kept["T"]


def closures(a, b, resolution, inliers):
    """(i, j, T_a_b) of the closures between places of two runs."""
    detector = MapClosures(MapClosuresConfig(density_map_resolution=resolution))
    found = []
    for number, (points, _) in enumerate(a):
        detector.get_closures(number, points)
    for number, (points, centre) in enumerate(b):
        for closure in detector.get_closures(FAR + number, points):
            i = closure.source_id if closure.source_id < FAR else closure.target_id
            if i >= FAR or closure.number_of_inliers < inliers:
                continue
            T = np.array(closure.pose)  # target (query) from source, or the other way round
            options = []
            for candidate in (T, np.linalg.inv(T)):
                moved = np.eye(4)
                moved[:3, :3] = candidate[:3, :3]
                moved[:3, 3] = candidate[:3, 3] + a[i][1] - candidate[:3, :3] @ centre
                options.append(moved)
            found.append((i, number, options))
    return found


def cells(points):
    return {tuple(c) for c in np.floor(points / 0.5).astype(int)}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, nargs="+", required=True)
    parser.add_argument("--resolution", type=float, default=0.5)
    parser.add_argument("--inliers", type=int, default=5)
    chosen = parser.parse_args()
    found = overlapping = false = merged = apart = 0
    for scene in SCENES:
        runs = {
            s: [places(chosen.folder / f"{scene}_{s}_{k}.npz") for k in range(2)]
            for s in chosen.seeds
            if (chosen.folder / f"{scene}_{s}_1.npz").exists()
        }
        for (a, T_a), (b, T_b) in runs.values():
            T = np.linalg.inv(T_a) @ T_b
            seen_a = [cells(p + c) for p, c in a]
            shares = [
                len(x & y) / len(y)
                for p, c in b
                for y in [cells((p + c) @ T[:3, :3].T + T[:3, 3])]
                for x in seen_a
            ]
            # of the two readings of a pose's direction, the better one counts
            errors = [
                min(np.linalg.norm(((M - T) @ np.append(b[j][1], 1.0))[:2]) for M in options)
                for _, j, options in closures(a, b, chosen.resolution, chosen.inliers)
            ]
            right = sum(e <= RIGHT for e in errors)
            false += len(errors) - right
            if max(shares) >= OVERLAPPING:
                overlapping += 1
                found += right > 0
        for one, other in pairwise(runs):
            apart += 1
            merged += bool(
                closures(runs[one][0][0], runs[other][1][0], chosen.resolution, chosen.inliers)
            )
        print(scene, found, overlapping, false, merged, apart, flush=True)
    print(
        f"found {found} of {overlapping} overlapping pairs, {false} false closures in them; "
        f"merged {merged} of {apart} pairs of different worlds"
    )


if __name__ == "__main__":
    main()
