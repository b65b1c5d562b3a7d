# SPDX-License-Identifier: MIT OR Apache-2.0
"""Files that appear under their name only once they are whole."""

from __future__ import annotations

import os
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

TEMPORARY_SUFFIX = ".partial"


def temporary_name(path: Path) -> Path:
    """Name beside `path` under which it is written until it is whole."""
    return path.with_name(f".{path.name}{TEMPORARY_SUFFIX}")


def publish(temporary: Path, path: Path) -> None:
    """Bring a finished file to the disk and give it its final name in one step."""
    with temporary.open("rb+") as file:
        os.fsync(file.fileno())
    temporary.replace(path)
    _sync_folder(path.parent)


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Let what the system says while a file is written name the file, which only opening it does.

    Raises
    ------
    OSError
    """
    try:
        yield
    except OSError as error:
        if error.filename is not None or error.errno is None:
            raise
        raise OSError(error.errno, os.strerror(error.errno), str(path)) from error


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Yield a temporary name in the same folder; rename it at the end, remove it on failure."""
    temporary = temporary_name(path)
    try:
        with writing(path):
            yield temporary
            publish(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def write_text(path: Path, text: str) -> None:
    """Write a whole text file atomically, UTF-8.

    What no UTF-8 can say, as bytes of the name of a folder, is written with a backslash.
    """
    with atomic_path(Path(path)) as temporary:
        temporary.write_text(text, encoding="utf-8", errors="backslashreplace", newline="\n")


def write_bytes(path: Path, data: bytes) -> None:
    """Write a whole binary file atomically."""
    with atomic_path(Path(path)) as temporary:
        temporary.write_bytes(data)


def _sync_folder(folder: Path) -> None:
    """Make the rename itself survive a power cut, where the system can."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
