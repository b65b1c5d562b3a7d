# SPDX-License-Identifier: MIT OR Apache-2.0
"""Inputs are files: a device never ends, and a pipe may never begin."""

from __future__ import annotations

import os
from pathlib import Path

from bentwing.base.errors import InputError


def resolved(path: Path) -> Path:
    """Return where a path leads to, also where its links run in a circle.

    `Path.resolve` raises there before Python 3.13.
    """
    return Path(os.path.realpath(path))


def require_regular(
    path: Path, most: int | None = None, kind: type[InputError] = InputError
) -> None:
    """Refuse what is there and no file, as a device or a pipe, or larger than any file of its kind.

    Parameters
    ----------
    most : bytes
    kind : of the error

    Raises
    ------
    InputError
        Of this kind.
    """
    if not path.exists():
        return
    if not path.is_file():
        msg = f"{path}: is not a file"
        raise kind(msg)
    if most is not None and (size := path.stat().st_size) > most:
        msg = f"{path}: has {size} bytes, more than {most} that a file of its kind may have"
        raise kind(msg)
