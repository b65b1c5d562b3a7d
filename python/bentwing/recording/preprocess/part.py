# SPDX-License-Identifier: MIT OR Apache-2.0
"""The part of a recording a run uses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bentwing.recording.preprocess.chain import preprocess
from bentwing.recording.preprocess.read_ahead import read_ahead

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Generator, Iterator

    from bentwing.base.progress import Stage
    from bentwing.recording import Batch, Payload, Recording
    from bentwing.recording.preprocess.kept import KeptBatches

# A few seconds of a lidar: reading goes on while a window is registered.
BATCHES_AHEAD = 32


@dataclass(frozen=True, slots=True)
class RecordingPart:
    """A part of a recording, preprocessed, as a stream that can be asked for again.

    Attributes
    ----------
    start, duration : s, None for the beginning and for everything after it
    kept : where the first whole pass is kept for the later ones; None decodes in each
    """

    recording: Recording
    payload: Payload
    start: float | None = None
    duration: float | None = None
    kept: KeptBatches | None = None

    @property
    def length(self) -> float:
        """Seconds of the recording to go through."""
        left = self.recording.duration - (self.start or 0.0)
        return left if self.duration is None else min(left, self.duration)

    def batches(self, shown: Stage, counts: Counter[str]) -> Iterator[Batch]:
        """Stream the batches, telling the progress.

        Parameters
        ----------
        shown : advances by seconds of the recording
        counts : receives what is dropped, see `preprocess`
        """
        reached = self.start or 0.0
        for batch in read_ahead(self._stream(counts), BATCHES_AHEAD):
            yield batch
            if len(batch.times) and batch.times[-1] > reached:
                shown.advance(float(batch.times[-1]) - reached)
                reached = float(batch.times[-1])

    def _stream(self, counts: Counter[str]) -> Generator[Batch, None, None]:
        if self.kept is not None and self.kept.is_whole:
            return self.kept.again(counts)
        decoded = self.recording.batches(self.start, self.duration)
        usable = preprocess(decoded, self.payload, counts)
        return usable if self.kept is None else self.kept.keeping(usable, counts)
