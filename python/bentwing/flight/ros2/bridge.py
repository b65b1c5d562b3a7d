# SPDX-License-Identifier: MIT OR Apache-2.0
"""Live odometry between topics of ROS 2: sensors in, odometry, /tf and path out."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from bentwing.base.errors import PayloadError, RecordingError
from bentwing.flight.live.messages import LiveMessages
from bentwing.flight.ros2.feeds import Feeds
from bentwing.recording.messages.lidar_messages import LIDAR_MESSAGES
from bentwing.recording.topics import Roles, resolve

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.flight.live.messages import Carrier
    from bentwing.flight.live.odometry import Odometry
    from bentwing.flight.ros2.node import Ros2Node
    from bentwing.recording.payload import Payload

IDLE = 0.002  # s to wait where nothing has come


def find_roles(node: Ros2Node, payload: Payload, patience: float) -> Roles:
    """Return the topics to read, once somebody writes them.

    Parameters
    ----------
    patience : s until they must be there

    Raises
    ------
    RecordingError, PayloadError
        A topic is still missing then, cannot be told from others, or cannot be read live.
    """
    sections = (payload.lidar.latency_read, payload.imu and payload.imu.clock_offset)
    if any(sections) or (payload.encoder and payload.encoder.clock_offset):
        msg = "the payload gives a clock_offset or a latency above 50 ms, which is not read from ROS 2: let the drivers stamp on one clock"
        raise PayloadError(msg)
    until = time.monotonic() + patience
    while True:
        try:
            roles = resolve(node.topics(), payload)
            break
        except RecordingError:
            if time.monotonic() > until:
                raise
            time.sleep(0.1)
    if roles.lidar.type not in LIDAR_MESSAGES or "livox" in roles.lidar.type:
        msg = f"topic {roles.lidar.name} has the type {roles.lidar.type}, which is not read live: let the driver write PointCloud2"
        raise RecordingError(msg)
    return roles


class Bridge:
    """Feeds live odometry from topics of ROS 2, and writes what it says.

    Parameters
    ----------
    node : reads and writes
    roles : the topics to read
    rate : Hz, at most, of odometry and /tf
    viewers : get what is written, too
    """

    def __init__(
        self,
        node: Ros2Node,
        odometry: Odometry,
        payload: Payload,
        roles: Roles,
        *,
        rate: float = 50.0,
        viewers: Sequence[Carrier] = (),
    ) -> None:
        self._node = node
        self.feeds = Feeds(odometry, payload, roles.lidar)
        take = {"lidar": self.feeds.lidar, "imu": self.feeds.imu, "encoder": self.feeds.encoder}
        self._take = {
            topic.name: take[role] for role, topic in roles._asdict().items() if topic is not None
        }
        for topic in filter(None, roles):
            node.subscribe(topic.name, topic.type)
        self._messages = LiveMessages(odometry, [node, *viewers], rate=rate)

    def step(self) -> None:
        """Take what has come, and write what is new; wait a little where nothing has.

        Raises
        ------
        BentwingError
            The messages cannot be used, or the estimate has failed.
        """
        found: dict[str, list[bytes]] = {}
        for name, _, raw in self._node.take():
            found.setdefault(name, []).append(raw)
        if not found:
            time.sleep(IDLE)
        # The IMU first: it tells of motion up to the newest points.
        for name in sorted(found, key=lambda one: self._take[one] == self.feeds.lidar):
            self._take[name](found[name])
        self._messages.say(self.feeds.start_ns or 0, self.feeds.imu_frame)
