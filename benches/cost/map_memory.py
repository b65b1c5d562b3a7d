# SPDX-License-Identifier: MIT OR Apache-2.0
"""Memory and speed of the map: synthetic batches of a flight through a valley, cleaned and written.

    python -m benches map_memory [MILLIONS_OF_POINTS] [--format laz]

prints the peak memory of the process, which is to stay below 2 GB for 50 million points.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.calibration import Calibration
from bentwing.base.mount import FixedMount, Pose
from bentwing.base.trajectory import Trajectory
from bentwing.map.clean import clean
from bentwing.map.formats import MAP_FORMATS
from bentwing.map.project import project
from bentwing.map.thin import thin
from bentwing.map.writer import open_map
from bentwing.recording.batches import LidarBatch

if TYPE_CHECKING:
    from collections.abc import Iterator

RATE = 300_000  # points per second, as of a lidar with 16 beams
SPEED = 5.0  # m/s
HEIGHT = 8.0  # m above the ground
PER_BATCH = 30_000


def trajectory(duration: float) -> Trajectory:
    """Fly straight on, the head spinning."""
    times = np.arange(0.0, duration + 0.01, 0.01)
    positions = np.stack([SPEED * times, 3 * np.sin(0.1 * times), 0 * times], axis=1)
    return Trajectory(
        times, positions, geometry.exp(np.c_[4.0 * times % 6.28, 0 * times, 0 * times])
    )


def batches(n: int, flight: Trajectory) -> Iterator[LidarBatch]:
    """Returns from rolling ground and two sides of a valley, with noise, in the lidar frame."""
    rng = np.random.default_rng(0)
    for first in range(0, n, PER_BATCH):
        count = min(PER_BATCH, n - first)
        times = (first + np.arange(count)) / RATE
        p, q = flight.interpolate(times)
        down = rng.uniform(0.15, 1.4, count)
        heading = rng.uniform(0, 2 * np.pi, count)
        away = np.minimum(HEIGHT / np.tan(down), 40.0)
        x, y = p[:, 0] + away * np.cos(heading), p[:, 1] + away * np.sin(heading)
        ground = -HEIGHT + np.sin(0.2 * x) + 0.02 * y * y
        points = np.stack([x, y, ground + 0.01 * rng.normal(size=count)], axis=1)
        local = geometry.rotate(geometry.inverse(q), points - p)
        yield LidarBatch(
            local,
            times,
            rng.uniform(0, 255, count).astype(np.float32),
            rng.integers(0, 16, count).astype(np.uint16),
        )


def main() -> None:
    """Print memory and time."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("millions", type=float, nargs="?", default=50.0)
    parser.add_argument("--format", choices=MAP_FORMATS, default="laz")
    parser.add_argument("--spacing", type=float, default=0.0, help="of the thinning, m")
    options = parser.parse_args()
    n = round(options.millions * 1e6)
    flight = trajectory(n / RATE)
    mount = FixedMount(Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])))
    calibration = Calibration(0.0, mount, np.zeros(3), np.zeros(3), np.array([0.0, 0.0, 9.81]))
    started, record, counts = time.monotonic(), {}, {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"map.{options.format}"
        chunks = project(batches(n, flight), flight, calibration, counts=counts)
        chunks = clean(chunks, path.parent, duration=n / RATE, counts=counts, record=record)
        with open_map(path, options.format, 0) as writer:
            for chunk in thin(chunks, options.spacing, counts):
                writer.write(chunk)
        size = path.stat().st_size
    seconds = time.monotonic() - started
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"points           {n:,} ({writer.n_points:,} written, {size / 1e6:,.0f} MB)")
    print(f"peak memory      {peak:.2f} GB")
    print(f"time             {seconds:.0f} s, {1e6 * seconds / n:.2f} µs per point")
    print(f"cells            {record['cells']:,} of {record['cell_edge']:g} m")
    print(f"beams followed   {record['beams_followed']:,}")
    print(f"left out         {counts['map.moving']:,} moving, {counts['map.mixed_pixels']:,} mixed")
