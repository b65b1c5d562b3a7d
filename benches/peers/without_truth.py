# SPDX-License-Identifier: MIT OR Apache-2.0
"""Recordings without truth: where the engines say that it ended, and how thick walls become."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import laspy
import numpy as np

from benches.peers import attitude, table
from benches.peers.engines import ENGINES, Engine
from benches.peers.prepare import prepare
from benches.peers.runner import Source, run, short
from benches.peers.scoring import peer_trajectory
from benches.support import tables
from bentwing.base import geometry
from bentwing.base.errors import BentwingError
from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.base.transform import apply
from bentwing.evaluate.thickness import wall_thickness
from bentwing.recording import LidarBatch, Payload, Recording
from bentwing.recording.preprocess import preprocess

if TYPE_CHECKING:
    import argparse
    from pathlib import Path

    from benches.peers.feed import Feed

MOST_POINTS = 2_000_000
COLUMNS = (
    "recording", "engine", "end (x, y, z)", "turned by", "thickness of surfaces, median (quartiles)",
    "CPU per s recorded", "wall per s recorded", "peak memory", "threads",
)  # fmt: skip
NOTES = """\
- End: the last pose in the frame of the first, of the lidar or, where there is one, of the IMU.
- Thickness: standard deviation of points across planes fitted to small patches. bentwing's map is
  the one that it writes; of the others every point is placed by the poses around it, which are
  stamped as their engines mean it, and by constant velocities between (the gyro's attitude, where
  there is one).
"""


def compare(files: list[Path], options: argparse.Namespace, scratch: Path) -> list[dict]:
    """All engines on each file."""
    print(tables.head(COLUMNS))
    results = []
    for number, path in enumerate(files):
        results += _on_one(path, options, scratch / f"{number}-{path.stem}")
    print(f"\n{NOTES}")
    return results


def _on_one(path: Path, options: argparse.Namespace, scratch: Path) -> list[dict]:
    payload = Payload.default() if options.payload is None else Payload.load(options.payload)
    feed = prepare(path, payload, scratch / "feed")
    points, stamps_ns, duration = _points(path, payload)
    source = Source(path.stem, path, options.payload, duration)
    results = []
    for name in options.engines:
        out = scratch / name
        result = run(ENGINES[name], source, feed, out, options.timeout)
        if result["failure"] is None:
            try:
                result["score"] = _score(ENGINES[name], feed, out, points, stamps_ns)
            except (ValueError, BentwingError) as error:
                result["failure"] = short(f"lost: {error}")
        print(row(result), flush=True)
        results.append(result)
    return results


def _points(path: Path, payload: Payload) -> tuple[np.ndarray, np.ndarray, float]:
    """Evenly chosen points in the lidar frame, their stamps in ns, and the recording's length."""
    with Recording(path, payload) as recording:
        stream = preprocess(recording.batches(), payload, Counter())
        lidar = LidarBatch.joined([b for b in stream if isinstance(b, LidarBatch)])
        some = lidar.where(slice(None, None, max(1, len(lidar.times) // MOST_POINTS)))
        return some.points, recording.clock.to_ns(some.times), recording.duration


def _score(
    engine: Engine, feed: Feed, out: Path, points: np.ndarray, stamps_ns: np.ndarray
) -> dict:
    origin_ns = feed.head.starts_ns[0]
    if engine.adapter is None:
        estimate, _ = read_tum(out / "run" / "trajectory.txt", origin_ns)
        mapped = laspy.read(out / "run" / "map.laz").xyz
        mapped = np.ascontiguousarray(mapped[:: max(1, len(mapped) // MOST_POINTS)])
    else:
        estimate = peer_trajectory(out / "poses.npz", feed, engine, origin_ns)
        if estimate is None:
            msg = "too few poses"
            raise ValueError(msg)
        mapped = _placed(estimate, feed, points, 1e-9 * (stamps_ns - origin_ns))
    thickness = wall_thickness(mapped)
    back = geometry.inverse(estimate.quats_xyzw[0])
    end = geometry.rotate(back, estimate.positions[-1] - estimate.positions[0])
    turned = geometry.log(geometry.multiply(back, estimate.quats_xyzw[-1]))
    return {
        "end": end.tolist(),
        "turned": float(np.linalg.norm(turned)),
        "thickness": thickness.median,
        "thickness_quartiles": [thickness.p25, thickness.p75],
    }


def _placed(estimate: Trajectory, feed: Feed, points: np.ndarray, times: np.ndarray) -> np.ndarray:
    if feed.head.kind != "sweeps":
        msg = "without truth, fixed 3D lidars only"
        raise ValueError(msg)
    if feed.imu is not None:
        stamps = 1e-9 * (feed.imu.stamps_ns - feed.head.starts_ns[0])
        estimate = attitude.densified(estimate, attitude.as_trajectory(stamps, feed.imu.turned))
    known = estimate.covers(times)
    in_body = apply(np.array(feed.head.T_body_lidar), points[known])
    return geometry.compose(*estimate.interpolate(times[known]), in_body)


def row(result: dict) -> str:
    """One engine on one recording."""
    found, failure = result["score"], result["failure"]
    cells = [failure or "-", "-", "-"]
    if not failure:
        low, high = (1e3 * value for value in found["thickness_quartiles"])
        cells = [
            ", ".join(f"{value:.2f}" for value in found["end"]) + " m",
            f"{np.degrees(found['turned']):.2f}°",
            f"{1e3 * found['thickness']:.1f} mm ({low:.1f}, {high:.1f})",
        ]
    return tables.line([result["recording"], result["engine"], *cells, *table.costs(result)])
