# SPDX-License-Identifier: MIT OR Apache-2.0
"""What must be known of a topic of packets before the first batch: its decoder and its clock."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

from bentwing.recording.messages import wire, wire_packets
from bentwing.recording.packets import clock as packet_clock
from bentwing.recording.packets import sensors as packet_sensors
from bentwing.recording.packets.clock import PacketClock
from bentwing.recording.peek import Peek, unreadable

if TYPE_CHECKING:
    import numpy as np

    from bentwing.recording.containers.interface import Source
    from bentwing.recording.containers.scanned import TopicInfo
    from bentwing.recording.messages.wire_packets import Packet
    from bentwing.recording.packets.clock import ClockReading
    from bentwing.recording.packets.sensors import LidarPackets, StampedPackets
    from bentwing.recording.sections.lidar import Lidar

N_PEEKED = 200  # packets, a tenth to a third of a second of most lidars


def peek_lidar(source: Source, topic: TopicInfo, lidar: Lidar, *, is_alone: bool) -> Peek:
    """Look at the first packets of a lidar.

    Parameters
    ----------
    lidar : the payload's, which may name what the packets do not tell
    is_alone : nothing else in the recording has a clock

    Raises
    ------
    RecordingError, PayloadError
        None of them can be read, or what it takes to read them is missing.
    """
    packets = _first_packets(source, topic)
    make = packet_sensors.lidar_packets(source, topic, lidar, _usual(packets))
    pairs = _stamps(make(), packets, topic)
    clock = packet_clock.decide(pairs, make().period_ns, is_alone=is_alone)
    first_ns, offset_ns = _start(pairs, clock)
    return Peek(
        topic,
        use_recorder_time=False,
        first_ns=first_ns,
        offset_ns=offset_ns,
        point_times=str(clock),
        packet_clock=clock,
        lidar_packets=make,
        fields=_fields(make(), packets),
    )


def peek_imu(source: Source, topic: TopicInfo, lidar: Lidar, clock: ClockReading | None) -> Peek:
    """Look at the first packets of a lidar's IMU; errors as above.

    Parameters
    ----------
    clock : of the lidar's packets, which the IMU shares; None where they are not read
    """
    packets = _first_packets(source, topic)
    make = packet_sensors.imu_packets(source, topic, lidar)
    pairs = _stamps(make(), packets, topic)
    clock = clock or packet_clock.decide(pairs, make().period_ns, is_alone=False)
    first_ns, offset_ns = _start(pairs, clock)
    return Peek(
        topic,
        use_recorder_time=False,
        first_ns=first_ns,
        offset_ns=offset_ns,
        packet_clock=clock,
        imu_packets=make,
    )


def _first_packets(source: Source, topic: TopicInfo) -> list[Packet]:
    found: list[Packet] = []
    for _, recorder_ns, raw in source.messages({topic.name}):
        try:
            found += wire_packets.packets(topic.type, raw, recorder_ns, cdr=source.cdr)
        except wire.BrokenMessageError:
            continue
        if len(found) >= N_PEEKED:
            break
    if not found:
        raise unreadable(topic)
    return found


def _usual(packets: list[Packet]) -> bytes:
    """Return the first packet of the usual size: one that was cut off tells nothing of the others."""
    ((size, _),) = Counter(len(one.data) for one in packets).most_common(1)
    return next(one.data for one in packets if len(one.data) == size)


def _fields(decoder: LidarPackets, packets: list[Packet]) -> dict[str, np.dtype[Any]]:
    """Return the fields of the first packet that can be read."""
    readable = (one.data for one in packets if decoder.stamp_ns(one.data) is not None)
    return decoder.fields(next(readable))


def _stamps(
    decoder: StampedPackets, packets: list[Packet], topic: TopicInfo
) -> list[tuple[int, int]]:
    """Return (sensor's, computer's time in ns) of the packets that can be read."""
    stamps = [(decoder.stamp_ns(packet.data), packet.host_ns) for packet in packets]
    pairs = [(sensor_ns, host_ns) for sensor_ns, host_ns in stamps if sensor_ns is not None]
    if not pairs:
        raise unreadable(topic)
    return pairs


def _start(pairs: list[tuple[int, int]], reading: ClockReading) -> tuple[int, int]:
    """Return the earliest absolute stamp, and how far the first is ahead of the computer's."""
    clock = PacketClock(reading)
    stamps_ns = [clock.stamp_ns(*pair) for pair in pairs]
    return min(stamps_ns), stamps_ns[0] - pairs[0][1]
