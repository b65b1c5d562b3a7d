# SPDX-License-Identifier: MIT OR Apache-2.0
"""What must be known before the first batch: stamps that can be trusted, point times, the start."""

from __future__ import annotations

import itertools
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import RecordingError
from bentwing.recording.messages import wire
from bentwing.recording.messages.lidar_messages import LIDAR_MESSAGES
from bentwing.recording.point_times import NOTHING_GIVEN
from bentwing.recording.sweep_stamps import SweepStamps

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from bentwing.recording.containers.interface import Source
    from bentwing.recording.containers.scanned import TopicInfo
    from bentwing.recording.messages.decoder import LidarDecoder
    from bentwing.recording.packets.clock import ClockReading
    from bentwing.recording.packets.sensors import ImuPackets, LidarPackets
    from bentwing.recording.point_times import GivenTimes, Reading

N_PEEKED = 5  # messages; a cloud can be large and its chunk slow to decompress
N_SWEEPS = 8  # that show how a lidar turns
ENOUGH_STAMPS, MOST_STAMPS, LONG_NS = 70, 400, 3_000_000_000  # that have a period


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
    reading : of the points' times, where the type of message needs one
    are_times_made : by where the lidar looked, as the messages have none
    lack : why points have no times and get none
    packet_clock : what the stamps of raw packets mean
    joints : names in the messages of an encoder
    fields : of a lidar's points that a map can carry, with their types
    lidar_packets, imu_packets : makers of the decoder for raw packets, the one of the role
    """

    topic: TopicInfo
    use_recorder_time: bool
    first_ns: int
    offset_ns: int
    point_times: str | None = None
    reading: Reading | None = None
    are_times_made: bool = False
    lack: str = ""
    packet_clock: ClockReading | None = None
    joints: tuple[str, ...] = ()
    fields: Mapping[str, np.dtype[Any]] = field(default_factory=dict)
    lidar_packets: Callable[..., LidarPackets] | None = None
    imu_packets: Callable[[], ImuPackets] | None = None

    def shifted(self, offset_ns: int) -> Peek:
        """Return the same with stamps to which an offset is added, ns."""
        return replace(
            self, first_ns=self.first_ns + offset_ns, offset_ns=self.offset_ns + offset_ns
        )


def peek(source: Source, topic: TopicInfo, given: GivenTimes = NOTHING_GIVEN) -> Peek:
    """Look at the first messages of a topic.

    Parameters
    ----------
    given : what the payload says of the points' times

    Raises
    ------
    RecordingError, PayloadError
        None of them can be read, or they are not what the payload says.
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
    sentence: str | None = None
    reading: Reading | None = None
    made: Reading | str | None = None
    fields: dict[str, np.dtype[Any]] = {}
    if topic.type in LIDAR_MESSAGES:
        decoder = LIDAR_MESSAGES[topic.type](cdr=source.cdr)
        fields = _fields(decoder, messages)
        sentence, reading = decoder.point_times(messages, stamps_ns, given)
        if sentence is None:
            made = _made_times(source, topic, decoder, given)
            sentence, reading = (None, None) if isinstance(made, str) else (str(made), made)
    early = min(0.0, reading.first if reading else 0.0)
    offset_ns = 0 if use_recorder_time else headers[0][0] - headers[0][1]
    return Peek(
        topic,
        use_recorder_time,
        first_ns=min(stamps_ns) + int(np.floor(early * 1e9)),
        offset_ns=offset_ns,
        point_times=sentence,
        reading=reading,
        are_times_made=made is not None and reading is not None,
        lack=made if isinstance(made, str) else "",
        fields=fields,
    )


def _fields(decoder: LidarDecoder[Any], messages: list[bytes]) -> dict[str, np.dtype[Any]]:
    """Return the fields of the last readable message; the first ones of a driver are often incomplete."""
    for raw in reversed(messages):
        with suppress(wire.BrokenMessageError):
            return decoder.fields(raw)
    return {}


def _made_times(
    source: Source, topic: TopicInfo, decoder: LidarDecoder[Any], given: GivenTimes
) -> Reading | str:
    """Return how points get times by where the lidar looked, or why they cannot."""
    messages: list[bytes] = []
    headers_ns: list[int] = []
    recorder_ns: list[int] = []
    for _, arrival_ns, raw in itertools.islice(source.messages({topic.name}), MOST_STAMPS):
        try:
            headers_ns.append(wire.stamp_ns(raw, cdr=source.cdr))
        except wire.BrokenMessageError:
            continue
        recorder_ns.append(arrival_ns)
        if len(messages) < N_SWEEPS:
            messages.append(raw)
        is_long = recorder_ns[-1] - recorder_ns[0] >= LONG_NS
        if len(recorder_ns) >= ENOUGH_STAMPS and is_long:
            break
    stamps = SweepStamps.of(headers_ns, recorder_ns, given.reference)
    return decoder.made_times(messages, stamps)


def unreadable(topic: TopicInfo) -> RecordingError:
    """Return the error for a topic none of whose first messages can be read."""
    return RecordingError(
        f"topic {topic.name}: none of its first messages can be read as {topic.type}; the "
        "recording is damaged or its type is not what it says, record it again"
    )
