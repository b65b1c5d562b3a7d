# SPDX-License-Identifier: MIT OR Apache-2.0
"""The streams of one pass over a recording, as its first messages say they have to be read."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.recording.clock_steps import ClockStep, ClockSteps
from bentwing.recording.lidar_stream import LidarStream
from bentwing.recording.packets.clock import PacketClock
from bentwing.recording.packets.streams import PacketImuStream, PacketLidarStream
from bentwing.recording.streams import EncoderStream, ImuStream

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.base.clock import Clock
    from bentwing.recording.attributes import Attributes
    from bentwing.recording.peek import Peek
    from bentwing.recording.readings import Readings
    from bentwing.recording.streams import Stream


def open_streams(
    peeks: dict[str, Peek],
    roles: Sequence[str],
    clock: Clock,
    readings: Readings,
    *,
    cdr: bool,
    needs_beam_times: bool,
    attributes: Attributes,
) -> dict[str, Stream]:
    """Return the streams by role, in the order of `roles`.

    Parameters
    ----------
    peeks : by role
    clock : of the recording
    readings : of the samples, by the payload
    cdr : ROS 2's encoding instead of ROS 1's
    needs_beam_times : refuse scans that do not tell when each beam was measured
    attributes : further fields of the lidar's points that are wanted
    """
    # A lidar and the IMU in it share their clock.
    packet_clocks = {
        reading: PacketClock(reading)
        for reading in (peeks[role].packet_clock for role in roles)
        if reading is not None
    }
    of_device: list[ClockStep] = []

    def stream(role: str) -> Stream:
        found = peeks[role]
        name, zero = found.topic.name, found.use_recorder_time
        if found.packet_clock is not None:
            packet_clock = packet_clocks[found.packet_clock]
            if found.lidar_packets is not None:
                points = found.lidar_packets(attributes=attributes)
                return PacketLidarStream(
                    found.topic, clock, points, packet_clock, readings.lidar, cdr=cdr
                )
            if found.imu_packets is not None:
                samples = found.imu_packets()
                return PacketImuStream(
                    found.topic, clock, samples, packet_clock, readings.imu, cdr=cdr
                )
        steps = ClockSteps(found.offset_ns, of_device)
        if role == "imu":
            return ImuStream(
                name, clock, readings.imu, cdr=cdr, use_recorder_time=zero, steps=steps
            )
        if role == "encoder":
            return EncoderStream(
                name, clock, readings.encoder, cdr=cdr, use_recorder_time=zero, steps=steps
            )
        return LidarStream(
            name,
            found.topic.type,
            clock,
            readings.lidar,
            cdr=cdr,
            use_recorder_time=zero,
            steps=steps,
            times=found.reading,
            needs_beam_times=needs_beam_times,
            attributes=attributes,
        )

    return {role: stream(role) for role in roles}
