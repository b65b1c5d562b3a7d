# SPDX-License-Identifier: MIT OR Apache-2.0
"""Group small messages into slots of time, so that they are decoded together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.recording.batches import EncoderBatch, ImuBatch, LidarBatch

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from bentwing.recording.batches import Batch
    from bentwing.recording.streams import RawMessage, Stream

SLOT_NS = 100_000_000


def group_into_slots(
    messages: Iterable[tuple[str, int, bytes]],
    streams: Mapping[str, Stream],
    stop_ns: int | None = None,
) -> Iterator[Batch]:
    """Yield the batches of each slot, in the order of `streams`.

    Parameters
    ----------
    messages : (topic, recorder's time in ns, bytes) in time order
    streams : by topic
    stop_ns : end at the first message after this recorder's time
    """
    pending: dict[str, list[RawMessage]] = {topic: [] for topic in streams}
    slot_end_ns: int | None = None
    for topic, recorder_ns, raw in messages:
        if stop_ns is not None and recorder_ns > stop_ns:
            break
        if slot_end_ns is None or recorder_ns >= slot_end_ns:
            yield from _decoded(pending, streams)
            slot_end_ns = recorder_ns + SLOT_NS
        pending[topic].append((recorder_ns, raw))
    yield from _decoded(pending, streams)
    for stream in streams.values():
        if (batch := stream.finish()) is not None:
            yield batch


def _decoded(
    pending: dict[str, list[RawMessage]], streams: Mapping[str, Stream]
) -> Iterator[Batch]:
    for topic, stream in streams.items():
        if pending[topic]:
            batch = stream.decode(pending[topic])
            pending[topic] = []
            if batch is not None:
                yield batch


def trimmed(batch: Batch, begin: float, end: float) -> Batch | None:
    """Return the part of a batch with begin ≤ t < end (s), None if there is none.

    From zero on nothing is cut off: a first sweep may begin a rounding error before the start.
    """
    low = 0 if begin <= 0 else int(np.searchsorted(batch.times, begin, side="left"))
    high = int(np.searchsorted(batch.times, end, side="left"))
    if low >= high:
        return None
    if low == 0 and high == len(batch.times):
        return batch
    part = slice(low, high)
    if isinstance(batch, LidarBatch | ImuBatch):
        return batch.where(part)
    return EncoderBatch(batch.times[part], batch.angles[part])
