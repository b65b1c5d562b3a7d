# SPDX-License-Identifier: MIT OR Apache-2.0
"""What live odometry says, as messages of ROS 2, to whoever carries them on: DDS, a viewer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from bentwing.base import geometry
from bentwing.base.mount import Pose
from bentwing.recording.messages.ros_messages import MAP, RosMessages

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.flight.live.odometry import Odometry
    from bentwing.flight.live.prediction import StampedPose
    from bentwing.flight.live.status import Status

ODOMETRY, PATH, TF = "/bentwing/odometry", "/bentwing/path", "/tf"
POINTS, DIAGNOSTICS = "/bentwing/map_points", "/diagnostics"
WRITTEN = {
    ODOMETRY: "nav_msgs/msg/Odometry",
    PATH: "nav_msgs/msg/Path",
    TF: "tf2_msgs/msg/TFMessage",
    POINTS: "sensor_msgs/msg/PointCloud2",
    DIAGNOSTICS: "diagnostic_msgs/msg/DiagnosticArray",
}
PATH_STEP, MOST_OF_PATH = 1.0, 1000  # s between poses at first, and poses
POINTS_STEP, MOST_POINTS = 2.0, 200_000  # s between maps, and points of one
STATUS_STEP = 1.0  # s
OK, WARN, ERROR = 0, 1, 2  # of diagnostic_msgs/DiagnosticStatus
_LEVELS: dict[Status, int] = {"degenerate": WARN, "coasting": WARN, "failed": ERROR}


class Carrier(Protocol):
    """Takes messages to others."""

    def advertise(self, name: str, kind: str) -> None:
        """Announce a topic."""

    def publish(self, name: str, raw: bytes, stamp_ns: int) -> None:
        """Send a message, encoded as CDR with its head."""


class LiveMessages:
    """Says what is new of live odometry.

    Parameters
    ----------
    carriers : get every message
    rate : Hz, at most, of odometry and /tf
    """

    def __init__(
        self, odometry: Odometry, carriers: Sequence[Carrier], *, rate: float = 50.0
    ) -> None:
        self._odometry, self._carriers, self._period = odometry, carriers, 1.0 / rate
        for carrier in carriers:
            for name, kind in WRITTEN.items():
                carrier.advertise(name, kind)
        self._messages = RosMessages()
        self._last: StampedPose | None = None
        self._path: list[tuple[float, Pose]] = []
        self._path_step = PATH_STEP
        self._mapped = self._told = -np.inf
        self._n_mapped = 0
        self._status: Status | None = None

    def say(self, start_ns: int, child: str = "imu", pose: StampedPose | None = None) -> None:
        """Send what is new.

        Parameters
        ----------
        start_ns : ns UTC of the time 0 of the odometry
        child : frame of the IMU
        pose : default: the newest
        """
        status = self._odometry.status
        if status in ("waiting", "failed"):
            self._say_status(status, self._last, start_ns)
            return
        pose = self._odometry.pose() if pose is None else pose
        self._say_status(status, pose, start_ns)
        if self._last is not None and pose.time - self._last.time < self._period:
            return
        self._say_pose(pose, start_ns, child)
        self._last = pose
        if not self._path or pose.time - self._path[-1][0] >= self._path_step:
            self._say_path(pose, start_ns)
        if pose.time - self._mapped >= POINTS_STEP:
            self._say_points(pose.time, start_ns)

    def _say_pose(self, pose: StampedPose, start_ns: int, child: str) -> None:
        stamp_ns = start_ns + round(pose.time * 1e9)
        there = Pose(pose.position, pose.quat_xyzw)
        covariances = self._odometry.estimate().covariances
        matrix = np.zeros((6, 6)) if covariances is None else covariances.at([pose.time])[0]
        velocity = _velocity(self._last, pose)
        self._send(
            ODOMETRY, self._messages.odometry(child, there, matrix, velocity, stamp_ns), stamp_ns
        )
        self._send(TF, self._messages.tf(MAP, child, there, stamp_ns), stamp_ns)

    def _say_path(self, pose: StampedPose, start_ns: int) -> None:
        self._path.append((pose.time, Pose(pose.position, pose.quat_xyzw)))
        if len(self._path) > MOST_OF_PATH:
            del self._path[1::2]
            self._path_step *= 2
        stamps_ns = [start_ns + round(at * 1e9) for at, _ in self._path]
        path = self._messages.path([one for _, one in self._path], stamps_ns)
        self._send(PATH, path, stamps_ns[-1])

    def _say_points(self, time: float, start_ns: int) -> None:
        """Send the whole map, evenly thinned, so that whoever comes late or lost one sees it too."""
        points = self._odometry.map_points()
        self._mapped = time
        if len(points) == self._n_mapped:
            return
        self._n_mapped = len(points)
        shown = points[:: -(-len(points) // MOST_POINTS)]
        stamp_ns = start_ns + round(time * 1e9)
        self._send(POINTS, self._messages.cloud(shown, None, stamp_ns), stamp_ns)

    def _say_status(self, status: Status, pose: StampedPose | None, start_ns: int) -> None:
        time = 0.0 if pose is None else pose.time
        if status == self._status and time - self._told < STATUS_STEP:
            return
        self._status, self._told = status, time
        values = {name: str(n) for name, n in self._odometry.counts.items()}
        if pose is not None:
            values["predicted, s"] = f"{pose.predicted:.3f}"
        stamp_ns = start_ns + round(time * 1e9)
        level = _LEVELS.get(status, OK)
        message = self._messages.diagnostics("bentwing: odometry", level, status, values, stamp_ns)
        self._send(DIAGNOSTICS, message, stamp_ns)

    def _send(self, name: str, message: object, stamp_ns: int) -> None:
        raw = self._messages.encoded(message)
        for carrier in self._carriers:
            carrier.publish(name, raw, stamp_ns)


def _velocity(last: StampedPose | None, pose: StampedPose) -> NDArray[np.float64]:
    """Return velocity and turn rate (6,), m/s and rad/s, in the frame of the IMU."""
    back = geometry.inverse(pose.quat_xyzw)
    moved = geometry.rotate(back, pose.velocity)
    if last is None or pose.time <= last.time:
        return np.concatenate([moved, np.zeros(3)])
    turn = geometry.log(geometry.multiply(geometry.inverse(last.quat_xyzw), pose.quat_xyzw))
    return np.concatenate([moved, turn / (pose.time - last.time)])
