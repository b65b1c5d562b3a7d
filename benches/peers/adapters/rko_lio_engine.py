# SPDX-License-Identifier: MIT OR Apache-2.0
"""rko_lio through its own Python package."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from rko_lio.config import LIOConfig
from rko_lio.lio import LIO

from benches.peers.columns import stamps_of, xyz_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from benches.peers.engines import Engine
    from benches.peers.feed import Feed


def run(feed: Feed, engine: Engine) -> Iterator[tuple[int, np.ndarray]]:
    """Poses of the body, one per scan, stamped at its end."""
    head, imu = feed.head, feed.imu
    lio = LIO(LIOConfig(min_range=head.min_range, max_range=head.max_range, **engine.settings))
    mount, scans = np.array(head.T_body_lidar), feed.scans()
    for kind, i in feed.events():
        if kind == "imu":
            lio.add_imu_measurement(imu.accel[i], imu.gyro[i], int(imu.stamps_ns[i]), np.eye(4))
            continue
        scan = next(scans)
        start, end = head.starts_ns[i], head.ends_ns[i]
        lio.register_scan(xyz_of(scan), stamps_of(scan, start), mount, start, end)
        yield start, lio.pose()
