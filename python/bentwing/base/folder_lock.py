# SPDX-License-Identifier: MIT OR Apache-2.0
"""One process at a time writes into a folder."""

from __future__ import annotations

import json
import os
import platform
import sys
from contextlib import suppress
from datetime import datetime, timezone
from typing import TYPE_CHECKING

from bentwing.base.errors import FolderBusyError

if sys.platform != "win32":
    import fcntl

if TYPE_CHECKING:
    from pathlib import Path

LOCK = ".bentwing.lock"
_MOST = 4096  # bytes of a lock file


class FolderLock:
    """The right to write into a folder, from `acquire` to `release` or the end of the process.

    The system frees the lock of a process that has ended, however it ended. What the file says is for
    people, and for file systems that several hosts share: they may not tell each other of locks.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._path = folder / LOCK
        self._descriptor: int | None = None

    def acquire(self) -> None:
        """Take the lock.

        Raises
        ------
        FolderBusyError
            Another process has it, which is named with its host.
        """
        while self._descriptor is None:
            descriptor = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o644)
            try:
                self._lock(descriptor)
                if _is_file(self._path, descriptor):  # its last holder may just have removed it
                    self._refuse_other_host(descriptor)
                    _write_holder(descriptor)
                    self._descriptor = descriptor
            finally:
                if self._descriptor is None:
                    os.close(descriptor)

    def release(self) -> None:
        """Give the lock back and remove its file."""
        if self._descriptor is not None:
            with suppress(
                PermissionError
            ):  # Windows removes no open file; one of this host is taken over
                self._path.unlink(missing_ok=True)
            os.close(self._descriptor)
            self._descriptor = None

    def _lock(self, descriptor: int) -> None:
        if (
            sys.platform == "win32"
        ):  # it has no flock: only other hosts are kept out, by what the file says
            return
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = _holder(descriptor)
            msg = (
                f"{self._folder}: process {holder.get('process', 'unknown')} on "
                f"{holder.get('host', 'this host')} is writing there since "
                f"{holder.get('since', 'an unknown time')}; wait for it, or choose another folder"
            )
            raise FolderBusyError(msg) from None
        except OSError:  # a file system without locks; what the file says is all there is
            pass

    def _refuse_other_host(self, descriptor: int) -> None:
        holder = _holder(descriptor)
        host = holder.get("host", platform.node())
        if host != platform.node():
            msg = (
                f"{self._folder}: process {holder.get('process')} on {host} began to write there at "
                f"{holder.get('since')} and did not say that it has ended; if it has, remove "
                f"{self._path}"
            )
            raise FolderBusyError(msg)


def _is_file(path: Path, descriptor: int) -> bool:
    try:
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False


def _holder(descriptor: int) -> dict[str, str]:
    try:
        os.lseek(descriptor, 0, os.SEEK_SET)
        found = json.loads(os.read(descriptor, _MOST))
    except (OSError, ValueError, RecursionError):
        return {}
    return {str(k): str(v) for k, v in found.items()} if isinstance(found, dict) else {}


def _write_holder(descriptor: int) -> None:
    since = datetime.now(timezone.utc).isoformat(timespec="seconds")
    holder = {"process": os.getpid(), "host": platform.node(), "since": since}
    os.ftruncate(descriptor, 0)
    os.lseek(descriptor, 0, os.SEEK_SET)
    os.write(descriptor, json.dumps(holder).encode())
