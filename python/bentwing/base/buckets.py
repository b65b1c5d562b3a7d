# SPDX-License-Identifier: MIT OR Apache-2.0
"""Rows that are sorted into buckets on the disk and come back bucket by bucket."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.array_spool import ArraySpool
from bentwing.base.voxels import by_key

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path
    from types import TracebackType

    from numpy.typing import NDArray
    from typing_extensions import Self


class Buckets:
    """Context manager around rows by key: in a bucket they keep the order in which they came.

    Parameters
    ----------
    folder : of the temporary file
    held : bytes that are kept in memory before there is a file
    """

    def __init__(self, folder: Path, *, held: int = 0) -> None:
        self._spool = ArraySpool(folder, held=held)
        self._tables: dict[int, list[int]] = {}
        self._counts: dict[int, int] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._spool.close()

    @property
    def counts(self) -> dict[int, int]:
        """Rows by key, in the order of the keys."""
        return dict(sorted(self._counts.items()))

    def add(self, keys: NDArray[np.int64], columns: Mapping[str, NDArray[Any]]) -> None:
        """Put each row into the bucket of its key (N,).

        Raises
        ------
        OSError
            The disk is full.
        """
        order, starts = by_key(keys)
        for chosen in np.split(order, starts[1:]) if len(order) else ():
            key = int(keys[chosen[0]])
            number = self._spool.add({name: values[chosen] for name, values in columns.items()})
            self._tables.setdefault(key, []).append(number)
            self._counts[key] = self._counts.get(key, 0) + len(chosen)

    def tables(self, key: int) -> Iterator[dict[str, NDArray[Any]]]:
        """Yield the rows of a bucket, part by part."""
        return self._spool.tables(self._tables.get(key, []))
