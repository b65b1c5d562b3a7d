# SPDX-License-Identifier: MIT OR Apache-2.0
"""Live odometry between topics of ROS 2: sensors in, odometry, /tf and path out."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.errors import PayloadError, RecordingError
from bentwing.base.mount import Pose
from bentwing.flight.ros2.feeds import Feeds
from bentwing.recording.messages.lidar_messages import LIDAR_MESSAGES
from bentwing.recording.messages.ros_messages import MAP, RosMessages
from bentwing.recording.topics import Roles, resolve

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.flight.live.odometry import Odometry
    from bentwing.flight.live.prediction import StampedPose
    from bentwing.flight.ros2.node import Ros2Node
    from bentwing.recording.payload import Payload

ODOMETRY, PATH, TF = "/bentwing/odometry", "/bentwing/path", "/tf"
WRITTEN = {
    ODOMETRY: "nav_msgs/msg/Odometry",
    PATH: "nav_msgs/msg/Path",
    TF: "tf2_msgs/msg/TFMessage",
}
PATH_STEP, MOST_OF_PATH = 1.0, 1000  # s between poses at first, and poses
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
    """

    def __init__(
        self,
        node: Ros2Node,
        odometry: Odometry,
        payload: Payload,
        roles: Roles,
        *,
        rate: float = 50.0,
    ) -> None:
        self._node, self._odometry, self._period = node, odometry, 1.0 / rate
        self.feeds = Feeds(odometry, payload, roles.lidar)
        take = {"lidar": self.feeds.lidar, "imu": self.feeds.imu, "encoder": self.feeds.encoder}
        self._take = {
            topic.name: take[role] for role, topic in roles._asdict().items() if topic is not None
        }
        for topic in filter(None, roles):
            node.subscribe(topic.name, topic.type)
        for name, kind in WRITTEN.items():
            node.advertise(name, kind)
        self._messages = RosMessages()
        self._last: StampedPose | None = None
        self._path: list[tuple[float, Pose]] = []
        self._path_step = PATH_STEP

    def step(self) -> None:
        """Take what has come, and write the newest pose; wait a little where nothing has.

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
        if self._odometry.status not in ("waiting", "failed"):
            self._write(self._odometry.pose())

    def _write(self, pose: StampedPose) -> None:
        last = self._last
        if last is not None and pose.time - last.time < self._period:
            return
        self._last = pose
        stamp_ns = (self.feeds.start_ns or 0) + round(pose.time * 1e9)
        there = Pose(pose.position, pose.quat_xyzw)
        covariances = self._odometry.estimate().covariances
        matrix = np.zeros((6, 6)) if covariances is None else covariances.at([pose.time])[0]
        child, messages = self.feeds.imu_frame, self._messages
        odometry = messages.odometry(child, there, matrix, _velocity(last, pose), stamp_ns)
        self._node.publish(ODOMETRY, messages.encoded(odometry))
        self._node.publish(TF, messages.encoded(messages.tf(MAP, child, there, stamp_ns)))
        if not self._path or pose.time - self._path[-1][0] >= self._path_step:
            self._add_to_path(pose.time, there)

    def _add_to_path(self, time: float, pose: Pose) -> None:
        self._path.append((time, pose))
        if len(self._path) > MOST_OF_PATH:
            del self._path[1::2]
            self._path_step *= 2
        start_ns = self.feeds.start_ns or 0
        stamps_ns = [start_ns + round(at * 1e9) for at, _ in self._path]
        path = self._messages.path([one for _, one in self._path], stamps_ns)
        self._node.publish(PATH, self._messages.encoded(path))


def _velocity(last: StampedPose | None, pose: StampedPose) -> NDArray[np.float64]:
    """Return velocity and turn rate (6,), m/s and rad/s, in the frame of the IMU."""
    back = geometry.inverse(pose.quat_xyzw)
    moved = geometry.rotate(back, pose.velocity)
    if last is None or pose.time <= last.time:
        return np.concatenate([moved, np.zeros(3)])
    turn = geometry.log(geometry.multiply(geometry.inverse(last.quat_xyzw), pose.quat_xyzw))
    return np.concatenate([moved, turn / (pose.time - last.time)])
