# SPDX-License-Identifier: MIT OR Apache-2.0
"""Our kernels and those of other packages on the same surfels, as ratios within one run.

Surfels: extraction from five seconds of a flight, beside small_gicp's estimation of normals from
the same points. Neighbours: eight nearest of each surfel within distance one in six dimensions
(position in voxels, normal). Our own search is not bound to Python, since it excludes neighbours
by time and keeps mutual pairs only; `cargo bench --bench neighbors` measures it on such features.

Needs small_gicp, pynanoflann, pykdtree and scipy; what is missing is left out.
"""

from __future__ import annotations

import argparse
import importlib
import os
import statistics
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before any of them is loaded

import numpy as np

from bentwing import _core
from bentwing.estimators.settings import SurfelSettings
from bentwing.preprocess import preprocess
from bentwing.recording import LidarBatch, Payload, Recording
from bentwing.simulate import Scenario, simulate
from bentwing.trajectory import read_tum

if TYPE_CHECKING:
    from collections.abc import Callable

SECONDS = (12.0, 17.0)  # in flight
K, RADIUS = 8, 1.0
DT = 0.01


def flight(folder: Path) -> tuple[np.ndarray, np.ndarray, _core.Samples, _core.Globals]:
    """Points, stamps, true samples and nominal states of five seconds."""
    files = simulate(Scenario(scene="office", duration=22.0), folder)
    payload = Payload.load(files.payload)
    with Recording(files.recording, payload) as recording:
        stream = preprocess(recording.batches(), payload, Counter())
        lidar = [b for b in stream if isinstance(b, LidarBatch)]
        truth, _ = read_tum(files.trajectory, recording.clock.start_ns)
    points, stamps = (
        np.concatenate([b.points for b in lidar]),
        np.concatenate([b.times for b in lidar]),
    )
    chosen = (stamps >= SECONDS[0]) & (stamps < SECONDS[1])
    times = np.arange(SECONDS[0] - 0.1, SECONDS[1] + 0.1, DT)
    samples = _core.Samples(times[0], DT, *truth.interpolate(times))
    mount = payload.T_imu_lidar
    zero = (0.0, 0.0, 0.0)
    states = _core.Globals(
        (mount.translation, mount.quaternion),
        latency=0.0,
        gyro_bias=zero,
        accel_bias=zero,
        gravity=(0.0, 0.0, 9.80665),
    )
    return np.ascontiguousarray(points[chosen]), stamps[chosen], samples, states


def features(surfels: _core.Surfels, samples: _core.Samples, states: _core.Globals) -> np.ndarray:
    """Position in voxels and normal (N, 6) of the finest level, map frame."""
    finest = surfels.voxel_sizes == surfels.voxel_sizes.min()
    order = np.flatnonzero(finest)[np.argsort(surfels.stamps[finest])]
    means, stamps = surfels.means[order], surfels.stamps[order]
    place = lambda p: samples.place(np.ascontiguousarray(p), stamps, None, states)  # noqa: E731
    positions, tips = place(means), place(means + surfels.normals[order])
    return np.hstack([positions / surfels.voxel_sizes.min(), tips - positions]).astype(np.float32)


def searches(table: np.ndarray) -> dict[str, Callable[[], object]]:
    """Build a tree and search all features, by the name of the package."""
    wide = table.astype(np.float64)

    def scipy():
        return scipy_spatial.cKDTree(wide).query(wide, K, distance_upper_bound=RADIUS)

    def pykdtree():
        return pykdtree_kdtree.KDTree(table).query(table, K, distance_upper_bound=RADIUS)

    def nanoflann():
        tree = pynanoflann.KDTree(n_neighbors=K, radius=RADIUS)
        tree.fit(table)
        return tree.kneighbors(table)

    def gicp():
        return small_gicp.KdTree(wide[:, :3]).batch_knn_search(wide[:, :3], K)

    scipy_spatial, pykdtree_kdtree, pynanoflann, small_gicp = (
        installed(name)
        for name in ("scipy.spatial", "pykdtree.kdtree", "pynanoflann", "small_gicp")
    )
    found = {
        "scipy cKDTree": (scipy_spatial, scipy),
        "pykdtree": (pykdtree_kdtree, pykdtree),
        "pynanoflann": (pynanoflann, nanoflann),
        "small_gicp (three dimensions only)": (small_gicp, gicp),
    }
    return {name: work for name, (module, work) in found.items() if module is not None}


def installed(name: str):
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


def compare(title: str, works: dict[str, Callable[[], object]], n: int, repeats: int) -> None:
    """Interleave the repetitions, so that a slow minute of the machine hits all alike."""
    seconds: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(repeats):
        for name, work in works.items():
            start = time.perf_counter()
            work()
            seconds[name].append(time.perf_counter() - start)
    first = next(iter(works))
    print(f"\n{title} ({n:,} rows)\n\n| | time | ratio to {first} |\n|---|---|---|")
    for name, times in seconds.items():
        ratio = statistics.median(a / b for a, b in zip(times, seconds[first], strict=True))
        print(f"| {name} | {1e3 * statistics.median(times):.1f} ms | {ratio:.2f} |")


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=9)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        points, stamps, samples, states = flight(Path(folder) / "office")

    def extract():
        return _core.extract_surfels(
            points, stamps, None, samples, states, settings=SurfelSettings(), threads=1
        )

    placed = samples.place(points, stamps, None, states)
    works: dict[str, Callable[[], object]] = {"bentwing, four levels": extract}
    if (small_gicp := installed("small_gicp")) is not None:
        works["small_gicp, normals of voxels of 0.1 m"] = lambda: small_gicp.preprocess_points(
            placed, 0.1, num_neighbors=10, num_threads=1
        )
    compare("Surfels", works, len(points), options.repeats)
    table = features(extract(), samples, states)
    compare("Neighbours", searches(table), len(table), options.repeats)


if __name__ == "__main__":
    main()
