# SPDX-License-Identifier: MIT OR Apache-2.0
"""GenZ-ICP through its own Python package.

The pipeline of evalio 0.6.1 passes times in s on to a deskewing that expects shares of the scan,
so that a scan of 0.1 s is hardly deskewed and its pose is at an odd moment.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from genz_icp.config import GenZConfig
from genz_icp.genz_icp import GenZICP

from benches.peers.columns import stamps_of, xyz_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from benches.peers.engines import Engine
    from benches.peers.feed import Feed


def run(feed: Feed, engine: Engine) -> Iterator[tuple[int, np.ndarray]]:
    """Poses of the body, one per scan, at its middle."""
    head = feed.head
    config = GenZConfig()
    config.data.min_range, config.data.max_range = head.min_range, head.max_range
    config.data.deskew = bool(engine.settings["deskew"])
    config.mapping.voxel_size = engine.settings["voxel_size"]
    odometry = GenZICP(config)
    mount = np.array(head.T_body_lidar)
    unmount = np.linalg.inv(mount)
    for start, end, scan in zip(head.starts_ns, head.ends_ns, feed.scans(), strict=True):
        shares = (stamps_of(scan, start) - start) / (end - start)
        odometry.register_frame(xyz_of(scan), shares)
        yield start, mount @ odometry.last_pose @ unmount
