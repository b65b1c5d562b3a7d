# SPDX-License-Identifier: MIT OR Apache-2.0
"""Chunks of the map on the disk, between the first look at all of them and the second."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.atomic import temporary_name, writing
from bentwing.map.chunk import MapChunk

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from types import TracebackType

    from typing_extensions import Self


class ChunkSpool:
    """Context manager around a temporary file of chunks, about 60 bytes per point.

    Reading a recording and projecting it again takes several times longer.

    Parameters
    ----------
    path : file beside which the temporary one is made
    """

    def __init__(self, path: Path) -> None:
        self._path = temporary_name(path.with_suffix(".points"))

    def __enter__(self) -> Self:
        self._file = self._path.open("w+b")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            # Nobody reads on: what could not be written need not be.
            with suppress(OSError):
                self._file.close()
        finally:
            self._path.unlink(missing_ok=True)

    def add(self, chunk: MapChunk) -> None:
        """Append a chunk."""
        values = {field.name: getattr(chunk, field.name) for field in fields(chunk)}
        present = {name: value for name, value in values.items() if value is not None}
        with writing(self._path):
            np.save(self._file, np.array(list(present)))
            for value in present.values():
                np.save(self._file, value)

    def chunks(self) -> Iterator[MapChunk]:
        """Yield the chunks in the order in which they came."""
        with writing(self._path):
            end = self._file.tell()
            self._file.seek(0)
        while self._file.tell() < end:
            names = np.load(self._file).tolist()
            yield MapChunk(**{name: np.load(self._file) for name in names})
