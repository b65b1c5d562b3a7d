# SPDX-License-Identifier: MIT OR Apache-2.0
"""Text files of stamps and numbers, as those of trajectories are."""

from __future__ import annotations

from array import array
from decimal import Decimal, InvalidOperation
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.atomic import write_text
from bentwing.base.clock import NS_PER_S, Clock
from bentwing.base.errors import InputError
from bentwing.base.regular_file import require_regular

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

_POSE_COLUMNS = 8
_KITTI_COLUMNS = 12
_LATEST_NS = 2**62  # beyond it differences of stamps overflow
_LARGEST_EXPONENT = 30  # of ten, of a stamp in any unit; times the nanosecond's 0 it is 0
MOST_BYTES = 2**30  # of a day at 100 Hz
_LONGEST_LINE = 10_000  # characters; what is longer is read as several lines


def write_poses(
    path: Path,
    times: NDArray[np.float64],
    poses: NDArray[np.float64],
    clock_origin_ns: int,
) -> None:
    """Write `t x y z qx qy qz qw` with absolute stamps that are exact to the nanosecond.

    Parameters
    ----------
    path : file to write, atomically
    times : (N,) float64, s
    poses : (N, 7) float64, position in m and unit quaternion x y z w
    clock_origin_ns : absolute time of `times == 0`, ns UTC
    """
    stamps = Clock(clock_origin_ns).to_absolute_text(times)
    # The sign of a zero differs between processors, as the rounding of the last digit of a sum does.
    poses = np.hstack([np.round(poses[:, :3], 6), np.round(poses[:, 3:], 9)]) + 0.0
    lines = [
        f"{stamp} {x:.6f} {y:.6f} {z:.6f} {qx:.9f} {qy:.9f} {qz:.9f} {qw:.9f}\n"
        for stamp, (x, y, z, qx, qy, qz, qw) in zip(stamps, poses.tolist(), strict=True)
    ]
    write_text(path, "".join(lines))


def read_poses(path: Path) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Read lines `t x y z qx qy qz qw`; further columns are left out.

    Returns
    -------
    stamps_ns : (N,) int64, increasing, N > 0
    poses : (N, 7) float64, quaternions made unit

    Raises
    ------
    InputError
        If the file cannot be read, a line has no eight numbers, or the stamps do not increase.
    """
    stamps_ns, poses = read_stamped_rows(
        path, (_POSE_COLUMNS,), "t x y z qx qy qz qw", ignore_more=True
    )
    lengths = np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    if not np.isfinite(poses).all() or (lengths == 0).any():
        msg = f"{path}: a pose is not finite or has a quaternion of length zero"
        raise InputError(msg)
    return stamps_ns, np.hstack([poses[:, :3], poses[:, 3:] / lengths])


def read_stamped_rows(
    path: Path, widths: tuple[int, ...], layout: str, *, ignore_more: bool = False
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Read lines of a stamp in seconds and numbers, as `read_rows` does; the stamps increase.

    Raises
    ------
    InputError
        If the file cannot be read, a line has another form, or the stamps do not increase.
    """
    stamps, values = read_rows(path, widths, layout, ignore_more=ignore_more)
    late = np.diff(stamps) <= 0
    if late.any():
        msg = f"{path}: stamps must increase, pose {int(np.argmax(late)) + 2} does not"
        raise InputError(msg)
    return stamps, values


def read_rows(
    path: Path,
    widths: tuple[int, ...],
    layout: str,
    *,
    ignore_more: bool = False,
    per_second: int = 1,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Read lines of a stamp and numbers; commas count as spaces, # begins a comment.

    A first line that names the columns (`t,x,y,z`) is left out.

    Parameters
    ----------
    path : file to read
    widths : numbers of columns, stamp included, of which all lines have one
    layout : names the columns in the messages
    ignore_more : leave out columns beyond the widest
    per_second : units of the stamps in a second

    Returns
    -------
    stamps_ns : (N,) int64, N > 0
    values : (N, width - 1) float64

    Raises
    ------
    InputError
        If the file cannot be read, or a line has another form.
    """
    # As numbers, not as objects: a day has millions of poses.
    stamps_ns, rows, width = array("q"), array("d"), 0
    for number, line in enumerate(read_lines(path), start=1):
        fields = line.replace(",", " ").split()
        if not fields or fields[0].startswith("#") or (not stamps_ns and _is_heading(fields)):
            continue
        if len(fields) == _KITTI_COLUMNS and len(fields) not in widths:
            msg = (
                f"{path}, line {number}: {_KITTI_COLUMNS} columns are poses as KITTI writes them, "
                f"without times; write lines of `{layout}`"
            )
            raise InputError(msg)
        fields = fields[: max(widths)] if ignore_more else fields
        try:
            stamps_ns.append(_stamp_ns(fields[0], NS_PER_S // per_second))
            rows.extend([float(value) for value in fields[1:]])
            complete = len(fields) in ((width,) if width else widths)
        except (InvalidOperation, ValueError):
            complete = False
        width = len(fields)
        if not complete:
            unit = " with t in seconds" if per_second == 1 else ""
            msg = f"{path}, line {number}: expected `{layout}`{unit}, found {line[:80]!r}"
            raise InputError(msg)
    if not stamps_ns:
        msg = f"{path}: holds no pose; expected lines of `{layout}`"
        raise InputError(msg)
    return np.array(stamps_ns), np.array(rows).reshape(len(stamps_ns), width - 1)


def read_lines(path: Path) -> Iterator[str]:
    """Yield the lines of a text file.

    Raises
    ------
    InputError
        If it is no file of text, or too large to be one of poses.
    """
    require_regular(path, MOST_BYTES)
    try:
        with path.open(encoding="utf-8") as file:
            while line := file.readline(_LONGEST_LINE):
                yield line.rstrip("\r\n")
    except (OSError, UnicodeDecodeError) as error:
        msg = f"{path}: not readable as a trajectory ({error})"
        raise InputError(msg) from error


def _stamp_ns(text: str, unit_ns: int) -> int:
    """Return a stamp in ns, exact to the digit.

    Raises
    ------
    ValueError, InvalidOperation
        It is no number, or none that a clock shows.
    """
    stamp = Decimal(text)
    # Before any arithmetic, as a large exponent takes minutes.
    if not stamp.is_finite() or abs(stamp.adjusted()) > _LARGEST_EXPONENT:
        raise ValueError
    stamp_ns = int((stamp * unit_ns).to_integral_value())
    if abs(stamp_ns) >= _LATEST_NS:
        raise ValueError
    return stamp_ns


def _is_heading(fields: list[str]) -> bool:
    return fields[0].lower() in {"t", "time", "stamp", "timestamp"}
