# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the writers of self-describing formats share: a header, and rows of one type."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, ClassVar

from bentwing.map.columns import NORMALS, fixed_length_header, row_type, rows
from bentwing.map.writer import MapWriter

if TYPE_CHECKING:
    from bentwing.map.chunk import MapChunk


class RowsWriter(MapWriter):
    """Writer of rows; `time` is in s since the recording's start, whose stamp is in a comment."""

    coordinates: ClassVar[str]  # type of x, y and z
    normals: ClassVar[tuple[str, ...]] = NORMALS  # names of their columns

    def _begin(self, first: MapChunk) -> None:
        self._dtype = row_type(first, self.coordinates, self.normals)
        self._file = self._temporary.open("wb")
        self._file.write(self._header())

    def _append(self, chunk: MapChunk) -> None:
        self._file.write(rows(chunk, self._dtype, self.normals).tobytes())

    def _finish(self) -> None:
        self._file.seek(0)
        self._file.write(self._header())
        self._file.close()

    def _abandon(self) -> None:
        self._file.close()

    def _header(self) -> bytes:
        return fixed_length_header(self._text, self.n_points)

    @abstractmethod
    def _text(self, count: int, filling: str) -> str:
        """Make the header from the number of points and a filling, to be put in a comment."""
