# SPDX-License-Identifier: MIT OR Apache-2.0
"""From messages of ROS 2 to what live odometry takes, on seconds since the first message."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.clock import NS_PER_S
from bentwing.base.errors import RecordingError
from bentwing.recording import problems
from bentwing.recording.messages import wire
from bentwing.recording.messages.lidar_messages import LIDAR_MESSAGES
from bentwing.recording.point_times import GivenTimes
from bentwing.recording.readings import EncoderReading, Readings
from bentwing.recording.streams import usable_samples

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.flight.live.odometry import Odometry
    from bentwing.recording.containers.scanned import TopicInfo
    from bentwing.recording.messages.decoder import LidarDecoder
    from bentwing.recording.payload import Payload

N_LOOKED_AT = 5  # messages that say how the times of the points are to be read


class Feeds:
    """Hands the messages of lidar, IMU and encoder to live odometry.

    Parameters
    ----------
    odometry : takes them
    payload : the sensor head
    lidar : the lidar's topic
    """

    def __init__(self, odometry: Odometry, payload: Payload, lidar: TopicInfo) -> None:
        self.counts: Counter[str] = Counter()
        self.start_ns: int | None = None
        self.imu_frame = "imu"
        self._odometry, self._lidar = odometry, lidar
        self._given, self._scale = GivenTimes.of(payload.lidar), payload.lidar.range_scale
        self._encoder: EncoderReading = Readings.of(payload).encoder
        self._turn = 360.0 if payload.encoder and payload.encoder.unit == "deg" else 2 * np.pi
        self._decoder: LidarDecoder[Any] | None = None
        self._waiting: list[bytes] = []
        self._newest: dict[str, float] = {}
        self._angle: float | None = None

    def imu(self, messages: Sequence[bytes]) -> None:
        """Take inertial samples."""
        times: list[float] = []
        values: list[NDArray[np.float64]] = []
        for raw in messages:
            try:
                stamp_ns, body = wire.imu(raw, cdr=True)
            except wire.BrokenMessageError:
                self.counts["imu.broken_messages"] += 1
                continue
            if not times:
                self.imu_frame = wire.frame_id(raw, cdr=True) or self.imu_frame
            if self._is_later("imu", time := self._time(stamp_ns)):
                times.append(time)
                values.append(np.frombuffer(body, "<f8"))
        table = np.array(values).reshape(-1, 37)
        gyro, accel = table[:, 13:16], table[:, 25:28]
        keep = usable_samples(gyro, accel, self.counts)
        if keep.any():
            self._odometry.add_imu(np.array(times)[keep], gyro[keep], accel[keep])
            self.counts["imu.samples"] += int(keep.sum())

    def lidar(self, messages: Sequence[bytes]) -> None:
        """Take scans or clouds.

        Raises
        ------
        RecordingError
            The first ones tell no times of their points.
        """
        self._waiting += messages
        if self._decoder is None and len(self._waiting) >= N_LOOKED_AT:
            self._decoder = self._decoder_of(self._waiting)
        if self._decoder is None:
            return
        for raw in self._waiting:
            self._points(self._decoder, raw)
        self._waiting = []

    def encoder(self, messages: Sequence[bytes]) -> None:
        """Take angles of the motor."""
        for raw in messages:
            try:
                stamp_ns, angle = self._encoder.read(raw, cdr=True)
            except wire.BrokenMessageError:
                self.counts["encoder.broken_messages"] += 1
                continue
            if angle is None or not np.isfinite(angle):
                self.counts["encoder.other_joints"] += 1
                continue
            if self._is_later("encoder", time := self._time(stamp_ns)):
                if self._angle is not None:
                    angle = float(np.unwrap([self._angle, angle], period=self._turn)[1])
                self._angle = angle
                self._odometry.add_encoder(time, angle)
                self.counts["encoder.samples"] += 1

    def _points(self, decoder: LidarDecoder[Any], raw: bytes) -> None:
        try:
            message = decoder.parse(raw, self.counts)
        except wire.BrokenMessageError:
            self.counts["lidar.broken_messages"] += 1
            return
        stamp = self._time(message.stamp_ns)
        if not self._is_later("lidar", stamp):
            return
        for batch in decoder.batches([message], np.array([stamp]), self.counts):
            order = np.argsort(batch.times, kind="stable")
            found = batch.where(order)
            self._odometry.add_points(found.points, found.times, found.ring, stamp=stamp)
        self.counts["lidar.messages"] += 1

    def _decoder_of(self, messages: Sequence[bytes]) -> LidarDecoder[Any]:
        kind = self._lidar.type
        decoder = LIDAR_MESSAGES[kind](cdr=True)
        stamps_ns = [wire.stamp_ns(raw, cdr=True) for raw in messages]
        sentence, reading = decoder.point_times(messages, stamps_ns, self._given)
        if sentence is None:
            lack = "live, none are made"
            raise RecordingError(problems.point_times(self._lidar.name, kind, lack))
        return LIDAR_MESSAGES[kind](cdr=True, reading=reading, range_scale=self._scale)

    def _time(self, stamp_ns: int) -> float:
        if self.start_ns is None:
            self.start_ns = stamp_ns
        return (stamp_ns - self.start_ns) / NS_PER_S

    def _is_later(self, sensor: str, time: float) -> bool:
        """Whether a message comes behind those before; DDS may lose some, but also bring one twice."""
        if time <= self._newest.get(sensor, -np.inf):
            self.counts[f"{sensor}.out_of_order"] += 1
            return False
        self._newest[sensor] = time
        return True
