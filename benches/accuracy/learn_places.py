# SPDX-License-Identifier: MIT OR Apache-2.0
"""Learn the transform of the places' descriptors from simulated flights, and write it.

    python -m benches learn_places [-o python/bentwing/closing/places/metric.npz] [--seeds 1 2 …]

Two flights in the same world are described at the same keypoints; those are matching pairs.
Descriptors of other keypoints of all flights are the non-matching ones.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from benches.support.place_clouds import FLIGHTS, kept_run
from bentwing.closing import places
from bentwing.closing.places import cut_places, learn_metric
from bentwing.closing.places.cloud import voxel_means
from bentwing.closing.places.gestalt import describe, opposite
from bentwing.closing.places.keypoints import draw_keypoints, frames_at
from bentwing.closing.places.settings import PlaceSettings

DIMENSIONS = 20
SAME_POINT = 0.25
"""m, between a keypoint and its like in the other run."""
SAME_HEADING = np.radians(20.0)
OUT = Path(places.__file__).with_name("metric.npz")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=OUT)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 4])
    parser.add_argument("--keep", type=Path, help="keep the flights here, and use those kept")
    chosen = parser.parse_args()
    matching, singles = [], []
    for flight in FLIGHTS:
        for seed in chosen.seeds:
            runs = [kept_run(flight.scenario(seed, n), chosen.keep) for n in range(2)]
            differences, descriptors = pairs(*runs)
            matching.append(differences)
            singles.append(descriptors)
            print(f"{flight.scene} {seed}: {len(differences)} matching", flush=True)
    metric = learn_metric(np.concatenate(matching), others(singles), dimensions=DIMENSIONS)
    metric.save(chosen.output)
    print(f"wrote {chosen.output}: {metric.matrix.shape[0]} dimensions, reach {metric.reach:.2f}")


def pairs(a, b) -> tuple[np.ndarray, np.ndarray]:
    """Differences between descriptors of the same keypoints in two runs, and descriptors of a."""
    T_b_a = np.linalg.inv(b.T_world_map) @ a.T_world_map
    yaw = np.arctan2(T_b_a[1, 0], T_b_a[0, 0])
    settings = PlaceSettings()
    differences, descriptors = [], []
    clouds_b = [voxel_means(points, settings.voxel) for points in spans(b)]
    for points in spans(a):
        cloud = voxel_means(points, settings.voxel)
        keypoints = draw_keypoints(cloud, settings.n_keypoints)
        ours = describe(cloud, keypoints)
        descriptors.append(ours)
        moved = keypoints.points @ T_b_a[:3, :3].T + T_b_a[:3, 3]
        differences += [
            same_keypoints(cloud_b, moved, keypoints.headings + yaw, ours) for cloud_b in clouds_b
        ]
    return np.concatenate(differences), np.concatenate(descriptors)


def same_keypoints(cloud, points, headings, descriptors) -> np.ndarray:
    """Differences between `descriptors` of keypoints and those found at the same points in `cloud`."""
    tree = cKDTree(cloud)
    distance, nearest = tree.query(points)
    close = np.flatnonzero(distance < SAME_POINT)
    if not len(close):
        return np.zeros((0, descriptors.shape[1]))
    theirs = frames_at(tree, cloud[nearest[close]])
    # not every point of this run can be a keypoint: find out of which each is the like
    _, which = cKDTree(cloud[nearest[close]]).query(theirs.points)
    rows = close[which]
    described = describe(cloud, theirs)
    turn = np.abs((theirs.headings - headings[rows] + np.pi) % (2 * np.pi) - np.pi)
    flipped = turn > np.pi / 2
    described[flipped] = opposite(described[flipped])
    aligned = np.minimum(turn, np.pi - turn) < SAME_HEADING
    return (descriptors[rows] - described)[aligned]


def spans(run) -> list[np.ndarray]:
    """Points of the places of a run."""
    return [part.points for part in cut_places(run.points, run.times, run.trajectory)]


def others(singles: list[np.ndarray]) -> np.ndarray:
    """Differences between different keypoints: half of them of the same flight."""
    rng = np.random.default_rng(7)
    everything = np.concatenate(singles)
    mixed = everything - everything[rng.permutation(len(everything))]
    same = np.concatenate([d - d[rng.permutation(len(d))] for d in singles])
    return np.concatenate([mixed, same])
