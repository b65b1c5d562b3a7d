# SPDX-License-Identifier: MIT OR Apache-2.0
"""The order of a reference trajectory's columns, as its first line names them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bentwing.base.clock import NS_PER_S
from bentwing.base.errors import InputError
from bentwing.base.regular_file import require_regular
from bentwing.base.tum import MOST_BYTES

if TYPE_CHECKING:
    from pathlib import Path

_STAMPS = {"t", "time", "stamp", "timestamp"}
_POSITION, _ROTATION = ("x", "y", "z"), ("qx", "qy", "qz", "qw")
_LONGEST = 1000  # characters of a line of names


@dataclass(frozen=True, slots=True)
class Columns:
    """Where a file has what, by its heading.

    Attributes
    ----------
    heading : as it is written
    n : number of columns; the stamp is the first
    order : of x y z, and of qx qy qz qw if they are there
    per_second : units of the stamps in a second
    """

    heading: str
    n: int
    order: tuple[int, ...]
    per_second: int


def named_columns(path: Path) -> Columns | None:
    """Return the columns that the first line names; None if it names none.

    Raises
    ------
    InputError
        The file cannot be read, or the names do not say where the position is.
    """
    heading = _first_line(path)
    bare = heading.lstrip("# ")
    names = [_plain(name) for name in (bare.split(",") if "," in bare else bare.split())]
    if not names or names[0] not in _STAMPS or len(names) < 1 + len(_POSITION):
        return None
    order = [names.index(name) for name in _POSITION if name in names]
    if len(order) < len(_POSITION):
        msg = f"{path}: its columns are {heading!r}; name them t, x, y, z, or t, x, y, z, qx, qy, qz, qw"
        raise InputError(msg)
    if all(name in names for name in _ROTATION):
        order += [names.index(name) for name in _ROTATION]
    # EuRoC says so of its lengths only.
    in_ns = "[ns]" in heading or "_rs_" in heading.lower()
    return Columns(heading, len(names), tuple(order), NS_PER_S if in_ns else 1)


def _plain(name: str) -> str:
    """Return the name of a column without its unit and its frames: q_RS_w [] is qw, p_RS_R_x [m] is x."""
    bare = re.sub(r"\[.*?\]", "", name).strip().lower()
    parts = bare.split("_")
    if len(parts) > 1 and parts[0] in {"p", "q"}:
        return ("q" if parts[0] == "q" else "") + parts[-1]
    return bare[1:] if bare in {"tx", "ty", "tz"} else bare


def _first_line(path: Path) -> str:
    require_regular(path, MOST_BYTES)
    try:
        with path.open(encoding="utf-8") as file:
            return file.readline(_LONGEST).strip()
    except (OSError, UnicodeDecodeError) as error:
        msg = f"{path}: not readable as a trajectory ({error})"
        raise InputError(msg) from error
