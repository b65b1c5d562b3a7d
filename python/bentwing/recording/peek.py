# SPDX-License-Identifier: MIT OR Apache-2.0
"""What must be known before the first batch: stamps that can be trusted, point times, the start."""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import RecordingError
from bentwing.recording import point_times
from bentwing.recording.messages import laser_scan, point_cloud2, wire, wire_clouds, wire_scans
from bentwing.recording.topics import LASER_SCAN, LIVOX, MULTI_ECHO, POINT_CLOUD

if TYPE_CHECKING:
    from collections.abc import Callable

    from bentwing.recording.containers.scanned import TopicInfo
    from bentwing.recording.containers.source import Source
    from bentwing.recording.packets.clock import ClockReading
    from bentwing.recording.packets.sensors import ImuPackets, LidarPackets
    from bentwing.recording.point_times import TimeReading

N_PEEKED = 5  # messages; a cloud can be large and its chunk slow to decompress


@dataclass(frozen=True, slots=True)
class Peek:
    """First messages of a topic.

    Attributes
    ----------
    topic : the topic
    use_recorder_time : all header stamps are zero
    first_ns : earliest stamp of a sample, of the clock in use
    offset_ns : header's minus recorder's time of the first message
    point_times : sentence on how the time of each point is known, None where it is not
    reading : of a PointCloud2's time field
    packet_clock : what the stamps of raw packets mean
    lidar_packets, imu_packets : makers of the decoder for raw packets, the one of the role
    """

    topic: TopicInfo
    use_recorder_time: bool
    first_ns: int
    offset_ns: int
    point_times: str | None = None
    reading: TimeReading | None = None
    packet_clock: ClockReading | None = None
    lidar_packets: Callable[[], LidarPackets] | None = None
    imu_packets: Callable[[], ImuPackets] | None = None


def peek(source: Source, topic: TopicInfo) -> Peek:
    """Look at the first messages of a topic.

    Raises
    ------
    RecordingError
        None of them can be read.
    """
    headers = []
    messages = []
    for _, recorder_ns, raw in itertools.islice(source.messages({topic.name}), N_PEEKED):
        try:
            header_ns = wire.stamp_ns(raw, cdr=source.cdr)
        except wire.BrokenMessageError:
            continue
        headers.append((header_ns, recorder_ns))
        messages.append(raw)
    if not messages:
        raise unreadable(topic)
    use_recorder_time = all(header_ns == 0 for header_ns, _ in headers)
    stamps_ns = [recorder if use_recorder_time else header for header, recorder in headers]
    sentence, reading = _point_times(topic, messages, stamps_ns, cdr=source.cdr)
    early = min(0.0, reading.first if reading else 0.0)
    offset_ns = 0 if use_recorder_time else headers[0][0] - headers[0][1]
    first_ns = min(stamps_ns) + int(np.floor(early * 1e9))
    return Peek(topic, use_recorder_time, first_ns, offset_ns, sentence, reading)


def unreadable(topic: TopicInfo) -> RecordingError:
    """Return the error for a topic none of whose first messages can be read."""
    return RecordingError(
        f"topic {topic.name}: none of its first messages can be read as {topic.type}; the "
        "recording is damaged or its type is not what it says, record it again"
    )


def _point_times(
    topic: TopicInfo, messages: list[bytes], stamps_ns: list[int], *, cdr: bool
) -> tuple[str | None, TimeReading | None]:
    if topic.type in (LASER_SCAN, MULTI_ECHO):
        return _beam_times(topic, messages, cdr=cdr), None
    if topic.type in LIVOX:
        return "time per point from offset_time (uint32): ns, relative to the time base", None
    if topic.type != POINT_CLOUD:
        return None, None
    reading = _cloud_times(messages, stamps_ns, cdr=cdr)
    return (None if reading is None else str(reading)), reading


def _beam_times(topic: TopicInfo, messages: list[bytes], *, cdr: bool) -> str | None:
    parse = wire_scans.laser_scan if topic.type == LASER_SCAN else wire_scans.multi_echo_scan
    for raw in messages:
        try:
            scan = parse(raw, cdr=cdr)
        except wire.BrokenMessageError:
            continue
        if laser_scan.is_sane(scan):
            if not laser_scan.has_beam_times(scan):
                return None
            return f"time per beam: stamp + i * {scan.time_increment * 1e6:.4g} us"
    return None


def _cloud_times(messages: list[bytes], stamps_ns: list[int], *, cdr: bool) -> TimeReading | None:
    """Decide on the last readable cloud; the first ones of a driver are often incomplete."""
    steps = np.diff(np.array(stamps_ns, dtype=np.int64))
    period = float(np.median(steps)) * 1e-9 if len(steps) and np.median(steps) > 0 else None
    for raw in reversed(messages):
        try:
            cloud = wire_clouds.point_cloud(raw, cdr=cdr)
            columns = point_cloud2.columns(cloud, Counter())
        except wire.BrokenMessageError:
            continue
        name = point_cloud2.time_field(cloud)
        if name is None or columns.raw_times is None:
            continue
        reading = point_times.decide(name, columns.raw_times, cloud.stamp_ns, period)
        if reading is not None:
            return reading
    return None
