# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a result was made of: versions of the software, sizes and hashes of the inputs."""

from __future__ import annotations

import hashlib
import os
import platform
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

FULL_HASH_LIMIT = 256 * 2**20  # bytes; larger files are hashed in parts
_BLOCK = 2**20
_N_SAMPLES = 64  # blocks of a large file that are hashed besides the first and the last


def versions() -> dict[str, str]:
    """Versions of everything that can change a result."""
    return {
        "bentwing": bentwing_version(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "platform": platform.platform(),
        "cpu_count": str(os.cpu_count()),
    }


def bentwing_version() -> str:
    """Version of the installed package; "unknown" when run from a bare source tree."""
    try:
        return version("bentwing")
    except PackageNotFoundError:
        return "unknown"


def files_of(path: Path) -> list[Path]:
    """Return the files that a path stands for: itself, or those of a folder."""
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    return [file for file in files if file.is_file()]


def describe_input(path: Path) -> dict[str, Any]:
    """Name, size and SHA-256 of an input.

    Of files above `FULL_HASH_LIMIT` both ends and blocks at even distances are hashed, which `hashed`
    says.
    """
    size = path.stat().st_size
    digest = hashlib.sha256()
    for block in _blocks(path, size):
        digest.update(block)
    hashed = "all" if size <= FULL_HASH_LIMIT else f"{_N_SAMPLES + 2} blocks of 1 MiB"
    return {"name": path.name, "bytes": size, "sha256": digest.hexdigest(), "hashed": hashed}


def _blocks(path: Path, size: int) -> Iterator[bytes]:
    with path.open("rb") as file:
        if size <= FULL_HASH_LIMIT:
            yield from iter(lambda: file.read(_BLOCK), b"")
            return
        for k in range(_N_SAMPLES + 2):
            file.seek((size - _BLOCK) * k // (_N_SAMPLES + 1))
            yield file.read(_BLOCK)
