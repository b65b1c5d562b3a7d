# SPDX-License-Identifier: MIT OR Apache-2.0
"""Files of arrays with a description, which tell by a hash whether they are as they were written."""

from __future__ import annotations

import hashlib
import io
import json
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile, ZipFile

import numpy as np

from bentwing.base.atomic import write_bytes
from bentwing.base.errors import BentwingError
from bentwing.base.plain import plain

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

_DIGEST = hashlib.sha256().digest_size
_DESCRIBED = "described"
# What reading something that bentwing has not written ends in.
DAMAGE = (
    ArithmeticError, AttributeError, BadZipFile, BentwingError, EOFError, LookupError, MemoryError,
    NotImplementedError, RecursionError, TypeError, ValueError,
)  # fmt: skip


def write_sealed(
    path: Path, described: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]
) -> None:
    """Write arrays and what JSON says of them, atomically."""
    stored: dict[str, Any] = {_DESCRIBED: np.array(json.dumps(plain(dict(described)))), **arrays}
    data = io.BytesIO()
    np.savez(data, **stored)
    content = data.getvalue()
    write_bytes(path, content + hashlib.sha256(content).digest())


def read_sealed(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the arrays and the description in a file that is as it was written.

    Raises
    ------
    OSError, or one of DAMAGE
    """
    whole = path.read_bytes()
    content, digest = whole[:-_DIGEST], whole[-_DIGEST:]
    if hashlib.sha256(content).digest() != digest:
        msg = "it is damaged: its SHA-256 is another"
        raise ValueError(msg)
    with ZipFile(io.BytesIO(content)) as packed:
        # Written without compression: nothing in it is larger than the file.
        if sum(entry.file_size for entry in packed.infolist()) > len(content):
            msg = "it announces more than it holds"
            raise ValueError(msg)
    with np.load(io.BytesIO(content), allow_pickle=False) as stored:
        arrays = {name: stored[name] for name in stored.files}
    described = json.loads(str(arrays.pop(_DESCRIBED)))
    if not isinstance(described, dict):
        msg = "it describes nothing"
        raise TypeError(msg)
    return arrays, described
