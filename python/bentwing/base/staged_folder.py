# SPDX-License-Identifier: MIT OR Apache-2.0
"""Several files that appear in a folder only once all of them are whole."""

from __future__ import annotations

import shutil
from contextlib import contextmanager
from typing import TYPE_CHECKING

from bentwing.base.atomic import TEMPORARY_SUFFIX
from bentwing.base.errors import UsageError
from bentwing.base.folder_lock import FolderLock

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_STAGE = f".files{TEMPORARY_SUFFIX}"


@contextmanager
def staged_folder(out: Path, last: str) -> Iterator[Path]:
    """Yield a folder in `out` whose files move to `out` at the end; on failure they are removed.

    Parameters
    ----------
    out : made if it does not exist
    last : name of what moves last, by which a whole result is told

    Raises
    ------
    UsageError
        If `out` is a file, cannot be made, or another process writes there.
    """
    lock, stage = FolderLock(out), out / _STAGE
    try:
        out.mkdir(parents=True, exist_ok=True)
        lock.acquire()
        shutil.rmtree(stage, ignore_errors=True)  # of a process that was killed
        stage.mkdir()
    except OSError as error:
        msg = f"{out}: cannot be written to ({error.strerror}); choose another folder"
        raise UsageError(msg) from error
    try:
        yield stage
        for entry in sorted(stage.iterdir(), key=lambda entry: entry.name.startswith(last)):
            entry.replace(out / entry.name)
    finally:
        shutil.rmtree(stage, ignore_errors=True)
        lock.release()
