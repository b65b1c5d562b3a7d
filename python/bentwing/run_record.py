# SPDX-License-Identifier: MIT OR Apache-2.0
"""What run.json says about inputs, versions and values, in plain JSON types."""

from __future__ import annotations

import hashlib
import math
import os
import platform
from dataclasses import fields, is_dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

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


def plain(value: Any) -> Any:  # noqa: ANN401 - takes and returns whatever JSON can hold
    """Turn dataclasses, arrays, models and paths into JSON types; what is not finite into None."""
    if hasattr(value, "model_dump"):
        return plain(value.model_dump())
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, set, frozenset)):
        return [plain(item) for item in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return plain(value.tolist())
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
