# SPDX-License-Identifier: MIT OR Apache-2.0
"""Messages of ROS 2 from poses and points, through the definitions that `rosbags` has."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from bentwing.base.clock import NS_PER_S

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from bentwing.base.mount import Pose

    Array = NDArray[np.float64]

MAP = "map"
FLOAT32 = 7  # of sensor_msgs/PointField
PLACE_FIRST = np.ix_([3, 4, 5, 0, 1, 2], [3, 4, 5, 0, 1, 2])  # as ROS orders covariances of poses

Message = Any
"""Made by `rosbags` at run time from ROS's own definitions."""


class RosMessages:
    """Makes messages; poses and points are in the frame `map`."""

    def __init__(self) -> None:
        self.types = get_typestore(Stores.ROS2_HUMBLE)

    def encoded(self, message: Message) -> bytes:
        """Return the bytes of a message."""
        return bytes(self.types.serialize_cdr(message, message.__msgtype__))

    def tf(self, parent: str, child: str, pose: Pose, stamp_ns: int) -> Message:
        """Return the pose of one frame in another."""
        turned = self._vector(pose.quaternion, "Quaternion")
        moved = self._make("geometry_msgs/msg/Transform", self._vector(pose.translation), turned)
        header = self._header(stamp_ns, parent)
        link = self._make("geometry_msgs/msg/TransformStamped", header, child, moved)
        return self._make("tf2_msgs/msg/TFMessage", [link])

    def odometry(
        self, child: str, pose: Pose, covariance: Array, velocity: Array, stamp_ns: int
    ) -> Message:
        """Return a pose with its covariance, and how it changes.

        Parameters
        ----------
        covariance : (6, 6) of turn and place, rad and m, map frame; zeros where it is not known
        velocity : (6,) m/s and rad/s, frame of the child
        """
        known = np.ascontiguousarray(covariance[PLACE_FIRST]).ravel()
        there = self._make("geometry_msgs/msg/PoseWithCovariance", self._pose(pose), known)
        parts = (self._vector(velocity[:3]), self._vector(velocity[3:]))
        twist = self._make("geometry_msgs/msg/Twist", *parts)
        moved = self._make("geometry_msgs/msg/TwistWithCovariance", twist, np.zeros(36))
        return self._make("nav_msgs/msg/Odometry", self._header(stamp_ns, MAP), child, there, moved)

    def path(self, poses: Sequence[Pose], stamps_ns: Sequence[int]) -> Message:
        """Return poses as a line, stamped at the first."""
        stamped = [
            self._make(
                "geometry_msgs/msg/PoseStamped", self._header(stamp_ns, MAP), self._pose(pose)
            )
            for pose, stamp_ns in zip(poses, stamps_ns, strict=True)
        ]
        return self._make("nav_msgs/msg/Path", self._header(stamps_ns[0], MAP), stamped)

    def cloud(
        self,
        points: NDArray[np.floating[Any]],
        intensity: NDArray[np.float32] | None,
        stamp_ns: int,
    ) -> Message:
        """Return points (N, 3), m, with intensities (N,) where they have some."""
        names = ["x", "y", "z", *([] if intensity is None else ["intensity"])]
        columns = [*points.T, *([] if intensity is None else [intensity])]
        rows = np.column_stack(columns).astype("<f4")
        fields = [
            self._make("sensor_msgs/msg/PointField", name, 4 * at, FLOAT32, 1)
            for at, name in enumerate(names)
        ]
        return self.types.types["sensor_msgs/msg/PointCloud2"](
            header=self._header(stamp_ns, MAP),
            height=1,
            width=len(rows),
            fields=fields,
            is_bigendian=False,
            point_step=4 * len(names),
            row_step=rows.nbytes,
            data=np.frombuffer(rows.tobytes(), np.uint8),
            is_dense=True,
        )

    def diagnostics(
        self, name: str, level: int, says: str, values: Mapping[str, str], stamp_ns: int
    ) -> Message:
        """Return the status of a part: how bad it is (0 to 2), a word or sentence, and named values."""
        kind = "diagnostic_msgs/msg/"
        rows = [self._make(f"{kind}KeyValue", *pair) for pair in values.items()]
        status = self._make(f"{kind}DiagnosticStatus", level, name, says, "", rows)
        return self._make(f"{kind}DiagnosticArray", self._header(stamp_ns, ""), [status])

    def _make(self, name: str, *values: Any) -> Message:  # noqa: ANN401 - as the type has them
        return self.types.types[name](*values)

    def _header(self, stamp_ns: int, frame: str) -> Message:
        stamp = self._make("builtin_interfaces/msg/Time", *divmod(stamp_ns, NS_PER_S))
        return self._make("std_msgs/msg/Header", stamp, frame)

    def _vector(self, values: Array, kind: str = "Vector3") -> Message:
        return self._make(f"geometry_msgs/msg/{kind}", *values.tolist())

    def _pose(self, pose: Pose) -> Message:
        place = self._vector(pose.translation, "Point")
        return self._make(
            "geometry_msgs/msg/Pose", place, self._vector(pose.quaternion, "Quaternion")
        )
