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


def is_there(path: Path, kind: type[InputError] = InputError) -> bool:
    """Whether there is something of this name.

    Raises
    ------
    InputError
        Of this kind, if no file can have the name, or its folder may not be looked into.
    """
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError as error:
        msg = f"{path}: cannot be opened ({error.strerror}); check its name and the rights to its folder"
        raise kind(msg) from error
    return True


def require_there(path: Path) -> None:
    """Refuse a name that nothing has.

    Raises
    ------
    InputError
    """
    if not is_there(path):
        msg = f"{path}: no such file or folder"
        raise InputError(msg)


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
    if not is_there(path, kind):
        return
    if not path.is_file():
        msg = f"{path}: is not a file"
        raise kind(msg)
    if most is not None and (size := path.stat().st_size) > most:
        msg = f"{path}: has {size} bytes, more than {most} that a file of its kind may have"
        raise kind(msg)
