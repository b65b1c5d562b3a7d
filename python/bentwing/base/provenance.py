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
    from pathlib import Path

FULL_HASH_LIMIT = 256 * 2**20  # bytes; larger files are hashed at both ends only
_END = 2**20


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


def describe_input(path: Path) -> dict[str, Any]:
    """Name, size and SHA-256 of an input.

    Files above `FULL_HASH_LIMIT` are hashed over their first and last MiB, which `hashed` says.
    """
    size = path.stat().st_size
    digest = hashlib.sha256()
    with path.open("rb") as file:
        if size <= FULL_HASH_LIMIT:
            while block := file.read(_END):
                digest.update(block)
        else:
            digest.update(file.read(_END))
            file.seek(size - _END)
            digest.update(file.read(_END))
    hashed = "all" if size <= FULL_HASH_LIMIT else "first and last MiB"
    return {"name": path.name, "bytes": size, "sha256": digest.hexdigest(), "hashed": hashed}
