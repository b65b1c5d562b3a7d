# SPDX-License-Identifier: MIT OR Apache-2.0
"""From the recording's batches to batches an estimator can use: filtered, with encoder angles."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.recording.batches import EncoderBatch, ImuBatch, LidarBatch
from bentwing.recording.preprocess.encoder import EncoderAngles
from bentwing.recording.preprocess.imu_limits import ImuLimits
from bentwing.recording.preprocess.ranges import within_range
from bentwing.recording.preprocess.self_hits import outside_boxes

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Generator, Iterable, Iterator

    from bentwing.recording.batches import Batch
    from bentwing.recording.payload import Payload


def preprocess(
    batches: Iterable[Batch], payload: Payload, counts: Counter[str]
) -> Generator[Batch, None, None]:
    """Filter lidar returns by range and self-hits, and attach the encoder's angles.

    Parameters
    ----------
    batches : in the order of the recording
    payload : ranges, self-hit boxes, and whether there is an encoder
    counts : receives `preprocess.range`, `preprocess.self_hits`, `preprocess.no_encoder_angle`,
        the points dropped for each reason, and inertial samples at a limit: see `ImuLimits`

    Yields
    ------
    Batch
        Encoder batches as they came, IMU batches with what is at a limit; lidar batches without the
        dropped points, with an encoder as soon as its angles reach beyond them.
    """
    chain = Preprocessing(payload, counts)
    for batch in batches:
        yield from chain.add(batch)
    yield from chain.finish()


class Preprocessing:
    """The same, batch by batch as they come.

    Parameters
    ----------
    payload, counts : as of `preprocess`
    """

    def __init__(self, payload: Payload, counts: Counter[str]) -> None:
        self._payload = payload
        self._counts = counts
        encoder = payload.encoder
        self._limits = ImuLimits(counts)
        self._encoder = None if encoder is None else EncoderAngles(counts, encoder.delay)

    def add(self, batch: Batch) -> Iterator[Batch]:
        """Take the next batch; yield what has become usable."""
        if isinstance(batch, LidarBatch):
            kept = _filtered(batch, self._payload, self._counts)
            if len(kept.times):
                yield from [kept] if self._encoder is None else self._encoder.add_lidar(kept)
            return
        yield self._limits.marked(batch) if isinstance(batch, ImuBatch) else batch
        if isinstance(batch, EncoderBatch) and self._encoder is not None:
            yield from self._encoder.add_encoder(batch)

    def finish(self) -> Iterator[Batch]:
        """Yield what still waits for the encoder, as far as it is covered."""
        if self._encoder is not None:
            yield from self._encoder.finish()


def _filtered(batch: LidarBatch, payload: Payload, counts: Counter[str]) -> LidarBatch:
    near = within_range(batch.points, payload.lidar.min_range, payload.lidar.max_range)
    outside = outside_boxes(batch.points, payload.self_hits)
    counts["preprocess.range"] += int((~near).sum())
    counts["preprocess.self_hits"] += int((near & ~outside).sum())
    keep = near & outside
    return batch if keep.all() else batch.where(keep)
