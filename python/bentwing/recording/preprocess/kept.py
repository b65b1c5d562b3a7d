# SPDX-License-Identifier: MIT OR Apache-2.0
"""The batches of a pass over a recording, kept for the passes behind it."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from bentwing.base.array_spool import ArraySpool, columns_of
from bentwing.base.log import get_logger
from bentwing.recording.batches import EncoderBatch, ImuBatch, LidarBatch

if TYPE_CHECKING:
    from collections.abc import Generator
    from pathlib import Path

    from bentwing.recording.batches import Batch

_log = get_logger(__name__)

HELD = 16_000_000  # bytes: half a minute of a 2D lidar needs no file
# Of what is free on the disk. Where that is too little the recording is decoded again: the map needs more.
SHARE = 0.25
_KINDS: tuple[type[Batch], ...] = (LidarBatch, ImuBatch, EncoderBatch)


class KeptBatches:
    """What the first whole pass over a part of a recording yields; reading it takes a tenth of decoding it.

    Parameters
    ----------
    folder : of the temporary file, which goes with this value or with the process
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._spool: ArraySpool | None = None
        self._kinds = bytearray()
        self._counts = Counter[str]()
        self._is_whole = False

    @property
    def is_whole(self) -> bool:
        """Whether a pass has come to the end of the recording, and all of it is here."""
        return self._is_whole

    def keeping(
        self, batches: Generator[Batch, None, None], counts: Counter[str]
    ) -> Generator[Batch, None, None]:
        """Pass on a pass over the recording, and keep it if it comes to the end.

        Parameters
        ----------
        counts : of what the pass drops, none so far
        """
        self.close()
        self._spool, self._kinds = ArraySpool(self._folder, held=HELD, share=SHARE), bytearray()
        try:
            for batch in batches:
                self._add(batch)
                yield batch
            self._is_whole = self._spool is not None
            self._counts = Counter(counts)
        finally:
            batches.close()
            if not self._is_whole:
                self.close()

    def again(self, counts: Counter[str]) -> Generator[Batch, None, None]:
        """Yield what was kept, and count what the pass has dropped."""
        if self._spool is None or not self._is_whole:
            msg = "is_whole: expected a pass that was kept to its end"
            raise ValueError(msg)
        for kind, columns in zip(self._kinds, self._spool.tables(), strict=True):
            yield _KINDS[kind](**columns)
        counts.update(self._counts)

    def close(self) -> None:
        """Let go of what was kept."""
        self._is_whole = False
        if self._spool is not None:
            self._spool.close()
            self._spool = None

    def _add(self, batch: Batch) -> None:
        if self._spool is None:
            return
        try:
            self._spool.add(columns_of(batch))
            self._kinds.append(_KINDS.index(type(batch)))
        except OSError as error:
            _log.info("the recording is decoded in each pass: %s", error)
            self.close()
