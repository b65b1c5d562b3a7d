# SPDX-License-Identifier: MIT OR Apache-2.0
"""A whole recording in memory, on one clock."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from bentwing.recording import ImuBatch, LidarBatch, Payload, Recording
from bentwing.recording.preprocess import preprocess

if TYPE_CHECKING:
    from pathlib import Path


@dataclass(frozen=True, slots=True)
class Samples:
    """A whole recording, times on the IMU's clock in s since `start_ns`.

    Attributes
    ----------
    sweeps : s, when each message of the lidar says that it begins
    planar : whether it is a 2D lidar
    """

    start_ns: int
    lidar: LidarBatch
    imu: ImuBatch | None
    sweeps: np.ndarray
    planar: bool


def read(path: Path, payload: Payload, latency: float) -> Samples:
    with Recording(path, payload) as recording:
        stream = list(preprocess(recording.batches(), payload, Counter()))
        start_ns, topic = recording.start_ns, recording.lidar_topic
        planar = recording.lidar_type.endswith("LaserScan")
    lidar = LidarBatch.joined([b for b in stream if isinstance(b, LidarBatch)])
    lidar = replace(lidar, times=lidar.times - latency)
    imu = [b for b in stream if isinstance(b, ImuBatch)]
    stamps = 1e-9 * (_header_stamps(path, topic) - start_ns) - latency
    if not imu or payload.imu is None:
        return Samples(start_ns, lidar, None, stamps, planar)
    parts = ([getattr(b, name) for b in imu] for name in ("times", "gyro", "accel"))
    return Samples(start_ns, lidar, ImuBatch(*map(np.concatenate, parts)), stamps, planar)


def _header_stamps(path: Path, topic: str) -> np.ndarray:
    """When each sweep began, by its message."""
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        connections = [c for c in reader.connections if c.topic == topic]
        headers = (
            reader.deserialize(raw, c.msgtype).header
            for c, _, raw in reader.messages(connections=connections)
        )
        return np.array([h.stamp.sec * 10**9 + h.stamp.nanosec for h in headers])
