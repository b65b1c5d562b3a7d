# SPDX-License-Identifier: MIT OR Apache-2.0
"""Files that a command writes beside its results: never over what is there."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.base.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


def require_new(path: Path, suffixes: Sequence[str] = ()) -> None:
    """Refuse to write what is there already, has no folder to be in, or is of another kind.

    Parameters
    ----------
    suffixes : of the kinds that can be written; none for any

    Raises
    ------
    UsageError
    """
    if suffixes and path.suffix.lower() not in suffixes:
        msg = f"{path}: its name must end with {' or '.join(suffixes)}"
        raise UsageError(msg)
    if path.exists():
        msg = f"{path}: exists already; give another name, or move it away"
        raise UsageError(msg)
    if not path.parent.is_dir():
        msg = f"{path}: there is no folder {path.parent}; make it, or choose a place elsewhere"
        raise UsageError(msg)
