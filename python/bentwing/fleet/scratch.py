# SPDX-License-Identifier: MIT OR Apache-2.0
"""A folder of this process for what it fetches: removed at the end, or by the next process here."""

from __future__ import annotations

import shutil
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from bentwing.base.errors import FolderBusyError, InputError
from bentwing.base.folder_lock import FolderLock

if TYPE_CHECKING:
    from collections.abc import Iterator

_PREFIX = "bentwing-scratch-"
_YOUNG = 60.0  # s; a folder of this age may be about to be locked
_LEFT = 2**29  # bytes that the disk keeps


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """Yield a new folder where temporary files belong (TMPDIR), and remove it at the end."""
    _remove_left()
    folder = Path(tempfile.mkdtemp(prefix=_PREFIX))
    lock = FolderLock(folder)
    lock.acquire()
    try:
        yield folder.resolve()
    finally:
        lock.release()
        shutil.rmtree(folder, ignore_errors=True)


def require_space(folder: Path, size: int, what: str) -> None:
    """Refuse to fetch what does not fit.

    Parameters
    ----------
    folder : to be made
    size : bytes that come

    Raises
    ------
    InputError
    """
    free = shutil.disk_usage(folder.parent).free
    if size + _LEFT > free:
        msg = (
            f"{what}: takes {size / 1e9:.1f} GB in {folder.parent}, where {free / 1e9:.1f} GB are free; "
            "let TMPDIR name a larger disk"
        )
        raise InputError(msg)


def _remove_left() -> None:
    """Remove the folders of processes that were killed."""
    for left in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*"):
        try:
            if time.time() - left.stat().st_mtime < _YOUNG:
                continue
            lock = FolderLock(left)
            lock.acquire()
        except (FolderBusyError, OSError):  # of a living process, of another user, or gone
            continue
        shutil.rmtree(left, ignore_errors=True)
        lock.release()
