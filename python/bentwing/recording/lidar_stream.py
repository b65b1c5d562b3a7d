# SPDX-License-Identifier: MIT OR Apache-2.0
"""From the raw messages of the lidar's topic to batches of points in time order."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import RecordingError
from bentwing.recording import problems
from bentwing.recording.attributes import NO_ATTRIBUTES
from bentwing.recording.messages import wire
from bentwing.recording.messages.lidar_messages import LIDAR_MESSAGES
from bentwing.recording.stamps import StampMonitor
from bentwing.recording.sweeps import SweepMerger

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.base.clock import Clock
    from bentwing.recording.attributes import Attributes
    from bentwing.recording.batches import LidarBatch
    from bentwing.recording.clock_steps import ClockSteps
    from bentwing.recording.point_times import Reading
    from bentwing.recording.readings import LidarReading
    from bentwing.recording.streams import RawMessage


class LidarStream:
    """The lidar's topic, of any supported type.

    Parameters
    ----------
    topic, kind : name and type of the topic
    clock : of the recording
    cdr : ROS 2's encoding instead of ROS 1's
    use_recorder_time : the header stamps are all zero
    steps : finds where the clock was set
    reading : of the points
    times : how the time of each point is read, where the type needs it
    needs_beam_times : refuse scans that do not tell when each beam was measured
    attributes : further fields that are wanted
    """

    def __init__(
        self,
        topic: str,
        kind: str,
        clock: Clock,
        reading: LidarReading,
        *,
        cdr: bool,
        use_recorder_time: bool,
        steps: ClockSteps,
        times: Reading | None,
        needs_beam_times: bool,
        attributes: Attributes = NO_ATTRIBUTES,
    ) -> None:
        self.counts: Counter[str] = Counter()
        self.monitor = StampMonitor(
            topic,
            use_recorder_time=use_recorder_time,
            counts=self.counts,
            offset_ns=reading.offset_ns,
            steps=steps,
        )
        self.n_points = 0
        self._topic, self._kind = topic, kind
        self._clock, self._needs_beam_times = clock, needs_beam_times
        self._reading = reading
        self._decoder = LIDAR_MESSAGES[kind](
            cdr=cdr, reading=times, range_scale=reading.range_scale, attributes=attributes
        )
        self._merger = SweepMerger(self.counts)

    def foresee(self, recorder_ns: int, raw: bytes) -> int | None:
        """Take a message that `decode` will get later."""
        try:
            header_ns, span = self._decoder.stamp_and_span(raw)
        except wire.BrokenMessageError:
            return 0
        return self.monitor.foresee(header_ns, recorder_ns, raw, span)

    def decode(self, messages: Sequence[RawMessage]) -> LidarBatch | None:
        """Return the points of the next messages, as far as they are complete."""
        batches = [self._reading.batch(batch) for batch in self._batches(messages)]
        batch = self._merger.push(batches)
        self.n_points += 0 if batch is None else len(batch.times)
        return batch

    def finish(self) -> LidarBatch | None:
        """Return the points held back for an overlapping sweep."""
        batch = self._merger.finish()
        self.n_points += 0 if batch is None else len(batch.times)
        return batch

    def _batches(self, messages: Sequence[RawMessage]) -> list[LidarBatch]:
        accepted, stamps_ns = [], []
        for recorder_ns, raw in messages:
            try:
                message = self._decoder.parse(raw, self.counts)
            except wire.BrokenMessageError:
                self.counts["broken_messages"] += 1
                continue
            if self._needs_beam_times and not self._decoder.has_point_times(message):
                raise RecordingError(
                    problems.point_times(self._topic, self._kind, "others have it")
                )
            stamp_ns = self.monitor.accept(message.stamp_ns, recorder_ns)
            if stamp_ns is not None:
                accepted.append(message)
                stamps_ns.append(stamp_ns)
        self.counts["messages"] += len(accepted)
        starts = self._clock.to_seconds(np.array(stamps_ns, dtype=np.int64))
        return self._decoder.batches(accepted, starts, self.counts)
