# SPDX-License-Identifier: MIT OR Apache-2.0
"""From a lidar's raw packets to batches: one stream for its points, one for its IMU."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from bentwing.recording.batches import ImuBatch
from bentwing.recording.messages import wire, wire_packets
from bentwing.recording.stamps import StampMonitor
from bentwing.recording.streams import usable_samples
from bentwing.recording.sweeps import SweepMerger

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from bentwing.base.clock import Clock
    from bentwing.recording.batches import LidarBatch
    from bentwing.recording.containers.scanned import TopicInfo
    from bentwing.recording.packets.clock import PacketClock
    from bentwing.recording.packets.sensors import ImuPackets, LidarPackets, StampedPackets
    from bentwing.recording.readings import ImuReading, LidarReading
    from bentwing.recording.streams import RawMessage


class _PacketReader:
    """The packets of a topic that can be used, with their stamps."""

    def __init__(
        self, topic: TopicInfo, packet_clock: PacketClock, offset_ns: int, *, cdr: bool
    ) -> None:
        self.counts: Counter[str] = Counter()
        self.monitor = StampMonitor(
            topic.name, use_recorder_time=False, counts=self.counts, offset_ns=offset_ns
        )
        self._kind, self._cdr = topic.type, cdr
        self._packet_clock = packet_clock

    def packets(
        self, messages: Sequence[RawMessage], decoder: StampedPackets, *, leads: bool
    ) -> Iterator[tuple[int, bytes]]:
        """Yield (absolute stamp in ns, packet); `leads`: the clock of the sensor goes by these."""
        for recorder_ns, raw in messages:
            try:
                found = wire_packets.packets(self._kind, raw, recorder_ns, cdr=self._cdr)
            except wire.BrokenMessageError:
                self.counts["broken_messages"] += 1
                continue
            self.counts["messages"] += 1
            for host_ns, packet in found:
                sensor_ns = decoder.stamp_ns(packet)
                if sensor_ns is None:
                    self.counts["broken_packets"] += 1
                    continue
                if leads:
                    self._packet_clock.observe(sensor_ns, host_ns)
                found_ns = self._packet_clock.stamp_ns(sensor_ns, host_ns)
                stamp_ns = self.monitor.accept(found_ns, host_ns)
                if stamp_ns is not None:
                    yield stamp_ns, packet


class PacketLidarStream:
    """The packets of one lidar, of any supported maker."""

    def __init__(
        self,
        topic: TopicInfo,
        clock: Clock,
        decoder: LidarPackets,
        packet_clock: PacketClock,
        reading: LidarReading,
        *,
        cdr: bool,
    ) -> None:
        self._reader = _PacketReader(topic, packet_clock, reading.offset_ns, cdr=cdr)
        self.counts, self.monitor = self._reader.counts, self._reader.monitor
        self._clock, self._decoder, self._reading = clock, decoder, reading
        self._merger = SweepMerger(self.counts)

    def foresee(self, recorder_ns: int, raw: bytes) -> int | None:  # noqa: ARG002 - the sensor's own clock
        """Take a message that `decode` will get later."""
        return 0

    def decode(self, messages: Sequence[RawMessage]) -> LidarBatch | None:
        """Return the points of the next messages, as far as they are complete."""
        found = list(self._reader.packets(messages, self._decoder, leads=True))
        if not found:
            return None
        self.counts["packets"] += len(found)
        stamps_ns, packets = zip(*found, strict=True)
        times = self._clock.to_seconds(np.array(stamps_ns, dtype=np.int64))
        batch = self._decoder.points(packets, times, self.counts)
        return self._merger.push([self._reading.batch(batch)])

    def finish(self) -> LidarBatch | None:
        """Return the points held back for packets that overlap."""
        return self._merger.finish()


class PacketImuStream:
    """The packets of a lidar's IMU."""

    def __init__(
        self,
        topic: TopicInfo,
        clock: Clock,
        decoder: ImuPackets,
        packet_clock: PacketClock,
        reading: ImuReading,
        *,
        cdr: bool,
    ) -> None:
        self._reader = _PacketReader(topic, packet_clock, reading.offset_ns, cdr=cdr)
        self.counts, self.monitor = self._reader.counts, self._reader.monitor
        self._clock, self._decoder, self._reading = clock, decoder, reading

    def foresee(self, recorder_ns: int, raw: bytes) -> int | None:  # noqa: ARG002 - the sensor's own clock
        """Take a message that `decode` will get later."""
        return 0

    def decode(self, messages: Sequence[RawMessage]) -> ImuBatch | None:
        """Return the samples of the next messages."""
        stamps, gyros, accels = [], [], []
        for stamp_ns, packet in self._reader.packets(messages, self._decoder, leads=False):
            offsets_ns, gyro, accel = self._decoder.samples(packet)
            stamps.append(stamp_ns + offsets_ns)
            gyros.append(gyro)
            accels.append(accel)
        if not stamps:
            return None
        times = self._clock.to_seconds(np.concatenate(stamps))
        gyro = self._reading.gyro.vectors(np.concatenate(gyros))
        accel = self._reading.accel.vectors(np.concatenate(accels))
        self.counts["samples"] += len(times)
        keep = usable_samples(gyro, accel, self.counts)
        return ImuBatch(times[keep], gyro[keep], accel[keep]) if keep.any() else None

    def finish(self) -> None:
        """Nothing is held back."""
