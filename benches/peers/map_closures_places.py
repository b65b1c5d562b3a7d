# SPDX-License-Identifier: MIT OR Apache-2.0
"""MapClosures on pairs of local maps: answers each line, the name of an .npz file, with what it found.

The file holds the clouds `a` and `b`, (N, 3) m, and `settings` to try, (S, 2): the resolution of the density
map, m, and into how many voxels a pixel's edge is divided, of which each keeps one point: density is to
be that of what stands there, not of how long it was looked at. The answer is a list with, for each
setting, the keypoints in agreement and the pose (4 × 4) that takes b's coordinates to a's, or none.
"""

from __future__ import annotations

import json
import sys

import numpy as np
from map_closures.config import MapClosuresConfig
from map_closures.map_closures import MapClosures

# A query is not compared with itself nor with the three maps before it.
QUERY = 10
# By default 0.05 of the densest pixel: too much where one façade is much higher than the rest.
DENSITY = 0.01


def main():
    for line in sys.stdin:
        content = np.load(line.strip())
        found = [closure(content["a"], content["b"], *one) for one in content["settings"].tolist()]
        print(json.dumps(found), flush=True)


def closure(a, b, resolution, division):
    config = MapClosuresConfig(density_map_resolution=resolution, density_threshold=DENSITY)
    engine = MapClosures(config)
    engine.get_closures(0, thinned(a, resolution / division))
    closures = engine.get_closures(QUERY, thinned(b, resolution / division))
    if not closures:
        return 0, None
    best = max(closures, key=lambda c: c.number_of_inliers)
    T_b_a = np.asarray(best.pose)  # from the map it knew to the one it was asked about
    return int(best.number_of_inliers), np.linalg.inv(T_b_a).tolist()


def thinned(points, voxel):
    """One point of each voxel."""
    cells = np.floor((points - points.min(axis=0)) / voxel).astype(np.int64)
    keys = (cells[:, 0] << 42) | (cells[:, 1] << 21) | cells[:, 2]
    return points[np.unique(keys, return_index=True)[1]]


if __name__ == "__main__":
    main()
