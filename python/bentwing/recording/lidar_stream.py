# SPDX-License-Identifier: MIT OR Apache-2.0
"""From the raw messages of the lidar's topic to batches of points in time order."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import RecordingError
from bentwing.recording import problems
from bentwing.recording.batches import LidarBatch
from bentwing.recording.messages import laser_scan, point_cloud2, wire, wire_clouds, wire_scans
from bentwing.recording.stamps import StampMonitor
from bentwing.recording.sweeps import SweepMerger
from bentwing.recording.topics import LASER_SCAN, LIVOX, MULTI_ECHO, POINT_CLOUD

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from bentwing.base.clock import Clock
    from bentwing.recording.messages.wire_clouds import RawLivox
    from bentwing.recording.messages.wire_scans import RawScan
    from bentwing.recording.point_times import TimeReading
    from bentwing.recording.streams import RawMessage

MAX_LIVOX_OFFSET_NS = 1_000_000_000


class LidarStream:
    """The lidar's topic, of any supported type.

    Parameters
    ----------
    topic, kind : name and type of the topic
    clock : of the recording
    cdr : ROS 2's encoding instead of ROS 1's
    use_recorder_time : the header stamps are all zero
    reading : of the time field of a PointCloud2; None puts all points at the header stamp
    needs_beam_times : refuse scans that do not tell when each beam was measured
    """

    def __init__(
        self,
        topic: str,
        kind: str,
        clock: Clock,
        *,
        cdr: bool,
        use_recorder_time: bool,
        reading: TimeReading | None,
        needs_beam_times: bool,
    ) -> None:
        self.counts: Counter[str] = Counter()
        self.monitor = StampMonitor(topic, use_recorder_time=use_recorder_time, counts=self.counts)
        self.n_points = 0
        self._topic, self._kind = topic, kind
        self._clock, self._cdr = clock, cdr
        self._reading, self._needs_beam_times = reading, needs_beam_times
        self._merger = SweepMerger(self.counts)
        decoders: Mapping[str, Callable[[Sequence[RawMessage]], list[LidarBatch]]] = {
            LASER_SCAN: lambda messages: self._scans(messages, wire_scans.laser_scan),
            MULTI_ECHO: lambda messages: self._scans(messages, wire_scans.multi_echo_scan),
            POINT_CLOUD: self._clouds,
        } | dict.fromkeys(LIVOX, self._livox)
        self._decode = decoders[kind]

    def decode(self, messages: Sequence[RawMessage]) -> LidarBatch | None:
        """Return the points of the next messages, as far as they are complete."""
        batch = self._merger.push(self._decode(messages))
        self.n_points += 0 if batch is None else len(batch.times)
        return batch

    def finish(self) -> LidarBatch | None:
        """Return the points held back for an overlapping sweep."""
        batch = self._merger.finish()
        self.n_points += 0 if batch is None else len(batch.times)
        return batch

    def _scans(
        self, messages: Sequence[RawMessage], parse: Callable[..., RawScan]
    ) -> list[LidarBatch]:
        scans, stamps_ns = [], []
        for recorder_ns, raw in messages:
            try:
                scan = parse(raw, cdr=self._cdr)
            except wire.BrokenMessageError:
                scan = None
            if scan is None or not laser_scan.is_sane(scan):
                self.counts["broken_messages"] += 1
                continue
            if self._needs_beam_times and not laser_scan.has_beam_times(scan):
                raise RecordingError(problems.point_times(self._topic, self._kind))
            stamp_ns = self.monitor.accept(scan.stamp_ns, recorder_ns)
            if stamp_ns is not None:
                scans.append(scan)
                stamps_ns.append(stamp_ns)
        self.counts["messages"] += len(scans)
        starts = self._clock.to_seconds(np.array(stamps_ns, dtype=np.int64))
        return laser_scan.points_of_scans(scans, starts, self.counts)

    def _clouds(self, messages: Sequence[RawMessage]) -> list[LidarBatch]:
        sweeps = []
        for recorder_ns, raw in messages:
            try:
                cloud = wire_clouds.point_cloud(raw, cdr=self._cdr)
                columns = point_cloud2.columns(cloud, self.counts)
            except wire.BrokenMessageError:
                self.counts["broken_messages"] += 1
                continue
            stamp_ns = self.monitor.accept(cloud.stamp_ns, recorder_ns)
            if stamp_ns is None:
                continue
            self.counts["messages"] += 1
            start = self._seconds(stamp_ns)
            # Absolute point times are relative to the header's own stamp, zero or not.
            sweeps.append(
                point_cloud2.sweep(columns, self._reading, cloud.stamp_ns, start, self.counts)
            )
        return sweeps

    def _livox(self, messages: Sequence[RawMessage]) -> list[LidarBatch]:
        sweeps = []
        for recorder_ns, raw in messages:
            try:
                message = wire_clouds.livox_custom(raw, cdr=self._cdr)
            except wire.BrokenMessageError:
                self.counts["broken_messages"] += 1
                continue
            stamp_ns = self.monitor.accept(message.stamp_ns, recorder_ns)
            if stamp_ns is not None:
                self.counts["messages"] += 1
                sweeps.append(self._livox_sweep(message, self._seconds(stamp_ns)))
        return sweeps

    def _livox_sweep(self, message: RawLivox, start: float) -> LidarBatch:
        table = message.points
        points = np.column_stack([table[axis] for axis in "xyz"]).astype(np.float64)
        keep = point_cloud2.valid(points, self.counts)
        is_near = table["offset_time"] < MAX_LIVOX_OFFSET_NS
        self.counts["bad_point_time"] += int((keep & ~is_near).sum())
        offsets = table["offset_time"].astype(np.float64) * 1e-9
        batch = LidarBatch(
            points,
            start + offsets,
            table["reflectivity"].astype(np.float32),
            table["line"].astype(np.uint16),
        ).where(keep & is_near)
        return batch.where(np.argsort(batch.times, kind="stable"))

    def _seconds(self, stamp_ns: int) -> float:
        return float(self._clock.to_seconds(np.array([stamp_ns], dtype=np.int64))[0])
