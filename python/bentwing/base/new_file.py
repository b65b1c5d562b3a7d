# SPDX-License-Identifier: MIT OR Apache-2.0
"""Places where a command is to write, which are looked at before any work: a byte is written there."""

from __future__ import annotations

import errno
import os
from contextlib import contextmanager
from tempfile import TemporaryFile
from typing import TYPE_CHECKING

from bentwing.base.atomic import temporary_name
from bentwing.base.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path


def require_new(path: Path, suffixes: Sequence[str] = ()) -> None:
    """Refuse to write what is there already, cannot be written, or is of another kind.

    Parameters
    ----------
    suffixes : of the kinds that can be written; none for any

    Raises
    ------
    UsageError
    """
    if suffixes and path.suffix.lower() not in suffixes:
        msg = f"{path}: its name must end with {' or '.join(suffixes)}"
        raise UsageError(msg)
    if os.path.exists(path):  # noqa: PTH110 - Path.exists raises where a name is too long
        msg = f"{path}: exists already; give another name, or move it away"
        raise UsageError(msg)
    require_writable(path)


def require_writable(path: Path) -> None:
    """Refuse a file that has no folder to be in, or cannot be written there.

    Raises
    ------
    UsageError
    """
    if not os.path.isdir(path.parent):  # noqa: PTH112 - as above
        msg = f"{path}: there is no folder {path.parent}; make it, or choose a place elsewhere"
        raise UsageError(msg)
    with _refused(path, "place"):
        if path.is_dir():
            raise _error(errno.EISDIR)
        _is_there(temporary_name(path))  # which is longer
        _write_into(path.parent)


def require_folder(path: Path) -> None:
    """Refuse a folder in which nothing can be written, or that cannot be made; nothing is made yet.

    Raises
    ------
    UsageError
    """
    with _refused(path, "folder"):
        there = path
        while not _is_there(there):
            there = there.parent
        if not there.is_dir():
            raise _error(errno.ENOTDIR)
        _write_into(there)


@contextmanager
def _refused(path: Path, what: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        msg = f"{path}: cannot be written ({error.strerror}); choose another {what}"
        raise UsageError(msg) from error


def _write_into(folder: Path) -> None:
    """Write a byte into a file without a name, of which nothing stays if the process is killed."""
    with TemporaryFile(dir=folder, buffering=0) as probe:
        probe.write(b"\0")


def _is_there(path: Path) -> bool:
    try:
        path.stat()
    except FileNotFoundError:
        return False
    return True


def _error(number: int) -> OSError:
    return OSError(number, os.strerror(number))
