# SPDX-License-Identifier: MIT OR Apache-2.0
"""Tables of arrays that wait for another look: in memory while they are small, else on the disk."""

from __future__ import annotations

import errno
import io
import os
import shutil
from array import array
from contextlib import suppress
from dataclasses import fields
from math import prod
from tempfile import TemporaryFile
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.atomic import TEMPORARY_SUFFIX

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path
    from types import TracebackType

    from _typeshed import DataclassInstance
    from numpy.typing import NDArray
    from typing_extensions import Self

    _Layout = tuple[tuple[str, np.dtype[Any], tuple[int, ...]], ...]

_N_PER_TABLE = 3  # numbers that are kept


class ArraySpool:
    """Context manager around tables, each of columns with as many rows, in the order in which they came.

    The file has no name where the system has such files, and else one that ends in `.partial`: a process
    that is killed leaves nothing behind. It is read, not mapped into memory, where its pages would count as
    the process's own, and where a disk that fails would end the process without a word.

    Parameters
    ----------
    folder : of the file
    held : bytes that are kept in memory before there is a file
    share : of what is free on the disk, more than which is not taken
    """

    def __init__(self, folder: Path, *, held: int = 0, share: float = 1.0) -> None:
        self._folder, self._held, self._share = folder, held, share
        self._file: Any = io.BytesIO()
        self._most = self._n_bytes = 0
        self._layouts: dict[_Layout, int] = {}
        self._tables = array("q")  # layout, rows and first byte of each
        self._lock = Lock()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def add(self, columns: Mapping[str, NDArray[Any]]) -> int:
        """Append a table, all of whose columns have as many rows; return its number.

        Raises
        ------
        OSError
            The disk is full, or has too little left.
        """
        # The largest alignment first, so that all columns are aligned when the table is read at once.
        ordered = sorted(columns.items(), key=lambda column: -column[1].dtype.alignment)
        layout = tuple((name, values.dtype, values.shape[1:]) for name, values in ordered)
        n_bytes = sum(values.nbytes for values in columns.values())
        self._make_room(n_bytes)
        try:
            for _, values in ordered:
                self._file.write(np.ascontiguousarray(values).reshape(-1).view(np.uint8).data)
            self._file.flush()  # what does not fit is to be known now
        except OSError as error:  # which names no file, as this one may have no name
            raise OSError(error.errno, error.strerror, str(self._folder)) from error
        n_rows = len(ordered[0][1]) if ordered else 0
        kind = self._layouts.setdefault(layout, len(self._layouts))
        self._tables.extend((kind, n_rows, self._n_bytes))
        self._n_bytes += n_bytes
        return len(self._tables) // _N_PER_TABLE - 1

    def tables(self, numbers: Sequence[int] | None = None) -> Iterator[dict[str, NDArray[Any]]]:
        """Yield the tables; several looks may go on at the same time, but none while tables are added.

        Parameters
        ----------
        numbers : of those to read, as `add` returned them; default: all
        """
        layouts = list(self._layouts)
        chosen = range(len(self._tables) // _N_PER_TABLE) if numbers is None else numbers
        for at in chosen:
            first = at * _N_PER_TABLE
            kind, n_rows, offset = self._tables[first : first + _N_PER_TABLE]
            layout = layouts[kind]
            data = self._read(offset, n_rows * sum(_row_size(column) for column in layout))
            yield _columns(data, layout, n_rows)

    def close(self) -> None:
        """Let go of everything; what could not be written need not be."""
        with suppress(OSError):
            self._file.close()

    def _make_room(self, n_bytes: int) -> None:
        """Go on in a file where the memory is used up; refuse what takes too much of the disk."""
        if isinstance(self._file, io.BytesIO):
            if self._n_bytes + n_bytes <= self._held:
                return
            held = self._file
            self._most = int(self._share * shutil.disk_usage(self._folder).free)
            self._file = TemporaryFile(  # noqa: SIM115 - closed by `close`
                dir=self._folder, prefix=".spool", suffix=TEMPORARY_SUFFIX
            )
            self._file.write(held.getbuffer())
        if self._n_bytes + n_bytes > self._most:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(self._folder))

    def _read(self, offset: int, n_bytes: int) -> NDArray[np.uint8]:
        data = np.empty(n_bytes, np.uint8)
        with self._lock:
            self._file.seek(offset)
            if self._file.readinto(data.data) != n_bytes:
                raise OSError(errno.EIO, os.strerror(errno.EIO), str(self._folder))
        return data


def columns_of(value: DataclassInstance) -> dict[str, NDArray[Any]]:
    """Return the arrays of a dataclass that has columns of one length, without those that are None."""
    columns = {field.name: getattr(value, field.name) for field in fields(value)}
    return {name: values for name, values in columns.items() if values is not None}


def _row_size(column: tuple[str, np.dtype[Any], tuple[int, ...]]) -> int:
    _, dtype, shape = column
    return dtype.itemsize * prod(shape)


def _columns(data: NDArray[np.uint8], layout: _Layout, n_rows: int) -> dict[str, NDArray[Any]]:
    columns, at = {}, 0
    for column in layout:
        name, dtype, shape = column
        end = at + n_rows * _row_size(column)
        columns[name] = data[at:end].view(dtype).reshape(n_rows, *shape)
        at = end
    return columns
