# SPDX-License-Identifier: MIT OR Apache-2.0
"""A finished run as one MCAP file of ROS 2 messages, which Foxglove and RViz play: poses, path and points.

Points come as clouds of a second each, so that the map grows with the path.
"""

from __future__ import annotations

import heapq
import itertools
import re
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bentwing.base import geometry
from bentwing.base.atomic import publish
from bentwing.base.clock import NS_PER_S, Clock
from bentwing.base.mount import FixedMount, Pose
from bentwing.run.export.trajectory_files import every

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Iterator

    from numpy.typing import NDArray

    from bentwing.base.covariances import PoseCovariances
    from bentwing.base.mount import Mount
    from bentwing.base.trajectory import Trajectory
    from bentwing.map.chunk import MapChunk
    from bentwing.recording.messages.ros_messages import Message, RosMessages
    from bentwing.run.export.finished import Finished

SUFFIX = ".mcap"
SPACING = 0.1  # m, of the points where nothing else is wished: viewers hold all of them
KEYFRAME = 1.0  # s, of a cloud
POSE_STEP, PATH_STEP = 0.02, 0.1  # s
MAP, POINTS = "map", "/map_points"


class _Poses(NamedTuple):
    """Poses of a run's IMU; `name` is that of the run, empty where there is only one."""

    poses: Trajectory
    stamps_ns: NDArray[np.int64]
    covariances: PoseCovariances | None
    name: str

    @property
    def frame(self) -> str:
        """The frame of the IMU."""
        return f"{self.name}_imu" if self.name else "imu"

    def pose(self, row: int) -> Pose:
        """Return one of the poses, map frame."""
        return Pose(self.poses.positions[row], self.poses.quats_xyzw[row])

    def topic(self, what: str) -> str:
        """Return the topic on which something of the run is."""
        return f"/{self.name}/{what}" if self.name else f"/{what}"


class _Sent(NamedTuple):
    """A message on its topic."""

    topic: str
    stamp_ns: int
    message: Message


def write_mcap(path: Path, run: Finished, chunks: Generator[MapChunk, None, None]) -> int:
    """Write poses, path and points of a run, whole or not at all; return the number of points.

    Parameters
    ----------
    path : of the file
    chunks : points in the frame of the trajectory, as they were measured
    """
    # slow to import, so only when it is needed
    from rosbags.rosbag2 import StoragePlugin, Writer

    from bentwing.recording.messages.ros_messages import RosMessages

    messages, connections, n_points = RosMessages(), {}, 0
    with TemporaryDirectory(dir=path.parent, prefix=f".{path.stem}-") as folder, closing(chunks):
        bag = Path(folder) / "bag"
        with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            for topic, stamp_ns, message in _all(messages, run, chunks):
                if topic not in connections:
                    connections[topic] = writer.add_connection(
                        topic, message.__msgtype__, typestore=messages.types
                    )
                writer.write(connections[topic], stamp_ns, messages.encoded(message))
                n_points += message.width if topic == POINTS else 0
        (made,) = bag.glob(f"*{SUFFIX}")
        publish(made, path)
    return n_points


def _all(messages: RosMessages, run: Finished, chunks: Iterable[MapChunk]) -> Iterator[_Sent]:
    """Yield all messages in the order of their stamps; runs of a merged map have their points in turn."""
    runs = _poses_of(run)
    mount = run.mount if len(runs) == 1 else None
    for one in runs:
        yield from _fixed(messages, one, mount)
    moving = (_moving(messages, one) for one in runs)
    yield from heapq.merge(*moving, _clouds(messages, run, chunks), key=lambda sent: sent.stamp_ns)


def _fixed(messages: RosMessages, one: _Poses, mount: Mount | None) -> Iterator[_Sent]:
    """Yield the path, and where the lidar is on the IMU, at the first pose."""
    stamps_ns: list[int] = one.stamps_ns.tolist()
    chosen = np.flatnonzero(every(one.poses.times, PATH_STEP)).tolist()
    path = messages.path([one.pose(row) for row in chosen], [stamps_ns[row] for row in chosen])
    yield _Sent(one.topic("path"), stamps_ns[0], path)
    if isinstance(mount, FixedMount):
        link = messages.tf(one.frame, "lidar", mount.T_imu_lidar, stamps_ns[0])
        yield _Sent("/tf_static", stamps_ns[0], link)


def _moving(messages: RosMessages, one: _Poses) -> Iterator[_Sent]:
    """Yield each pose, for viewers and with what is known of it."""
    velocities, known = _velocities(one.poses), one.covariances
    n = len(one.poses.times)
    matrices = np.zeros((n, 6, 6)) if known is None else known.at(one.poses.times)
    for row, stamp_ns in enumerate(one.stamps_ns.tolist()):
        pose = one.pose(row)
        yield _Sent("/tf", stamp_ns, messages.tf(MAP, one.frame, pose, stamp_ns))
        moved = messages.odometry(one.frame, pose, matrices[row], velocities[row], stamp_ns)
        yield _Sent(one.topic("odometry"), stamp_ns, moved)


def _clouds(messages: RosMessages, run: Finished, chunks: Iterable[MapChunk]) -> Iterator[_Sent]:
    """Yield the points of each keyframe when all of them are measured."""
    for parts in _keyframes(chunks):
        stamp_ns = run.run.start_ns + round(
            max(float(part.times.max()) for part in parts) * NS_PER_S
        )
        points = np.concatenate([part.points for part in parts])
        strengths = [part.intensity for part in parts if part.intensity is not None]
        intensity = np.concatenate(strengths) if len(strengths) == len(parts) else None
        yield _Sent(POINTS, stamp_ns, messages.cloud(points, intensity, stamp_ns))


def _poses_of(run: Finished) -> list[_Poses]:
    found = []
    for flight in run.flights:
        shown = flight.trajectory[every(flight.trajectory.times, POSE_STEP)]
        stamps_ns = Clock(flight.start_ns).to_ns(shown.times)
        name = "" if len(run.flights) == 1 else re.sub(r"[^A-Za-z0-9]", "_", flight.name)
        found.append(_Poses(shown, stamps_ns, run.covariances, name))
    return found


def _velocities(poses: Trajectory) -> NDArray[np.float64]:
    """Return (N, 6) velocity, m/s, and rate, rad/s, in the frame of the IMU, between the poses around."""
    n = len(poses.times)
    before, after = np.maximum(np.arange(n) - 1, 0), np.minimum(np.arange(n) + 1, n - 1)
    steps = np.maximum(poses.times[after] - poses.times[before], 1e-9)[:, None]
    back = geometry.inverse(poses.quats_xyzw)
    moved = geometry.rotate(back, poses.positions[after] - poses.positions[before])
    turned = geometry.multiply(geometry.inverse(poses.quats_xyzw[before]), poses.quats_xyzw[after])
    return np.hstack([moved / steps, geometry.log(turned) / steps])


def _keyframes(chunks: Iterable[MapChunk]) -> Iterator[list[MapChunk]]:
    """Yield the points of each second that follow each other."""
    waiting: list[MapChunk] = []
    for chunk in chunks:
        numbers = np.floor(chunk.times / KEYFRAME)
        borders = [0, *(np.flatnonzero(np.diff(numbers)) + 1).tolist(), len(chunk)]
        for begin, end in itertools.pairwise(borders):
            part = chunk.where(slice(begin, end))
            if waiting and np.floor(waiting[0].times[0] / KEYFRAME) != numbers[begin]:
                yield waiting
                waiting = []
            waiting.append(part)
    if waiting:
        yield waiting
