# SPDX-License-Identifier: MIT OR Apache-2.0
"""The trajectory as a value: poses of the IMU in the map at increasing times."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.atomic import write_text
from bentwing.base.clock import NS_PER_S, Clock
from bentwing.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

DT = 0.01
"""Interval of the samples of estimated trajectories, s."""

_TUM_COLUMNS = 8
_LATEST_NS = 2**62  # beyond it differences of stamps overflow


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Poses `T_map_imu` at increasing times; between them p is linear and R is slerped.

    Attributes
    ----------
    times : (N,) float64, s since the recording's start, increasing, IMU clock
    positions : (N, 3) float64, m, map frame
    quats_xyzw : (N, 4) float64, unit Hamilton quaternions
    """

    times: NDArray[np.float64]
    positions: NDArray[np.float64]
    quats_xyzw: NDArray[np.float64]

    def __post_init__(self) -> None:
        n = len(self.times)
        if self.positions.shape != (n, 3) or self.quats_xyzw.shape != (n, 4):
            msg = (
                f"trajectory: expected positions ({n}, 3) and quats_xyzw ({n}, 4), "
                f"got {self.positions.shape} and {self.quats_xyzw.shape}"
            )
            raise ValueError(msg)
        if n and not np.all(np.diff(self.times) > 0):
            msg = f"trajectory: times must increase, sample {int(np.argmin(np.diff(self.times))) + 1} does not"
            raise ValueError(msg)

    def covers(self, times: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether each of `times` `(N,)` lies between the first and the last pose."""
        if not len(self.times):
            return np.zeros(len(times), dtype=np.bool_)
        inside: NDArray[np.bool_] = (times >= self.times[0]) & (times <= self.times[-1])
        return inside

    def interpolate(
        self, times: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Poses at any times: p linear, R slerped between the neighbouring samples.

        Parameters
        ----------
        times : (N,) float64, s since the recording's start, in any order

        Returns
        -------
        positions : (N, 3) float64, m, map frame
        quats_xyzw : (N, 4) float64

        Raises
        ------
        ValueError
            If a time is outside the trajectory; `covers` says which ones are inside.
        """
        times = np.asarray(times, dtype=np.float64)
        self._require_cover(times)
        if len(self.times) == 1:
            return self.positions.repeat(len(times), 0), self.quats_xyzw.repeat(len(times), 0)
        i = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(self.times) - 2)
        shares = (times - self.times[i]) / (self.times[i + 1] - self.times[i])
        p = self.positions
        positions = p[i] + shares[:, None] * (p[i + 1] - p[i])
        return positions, geometry.slerp(self.quats_xyzw[i], self.quats_xyzw[i + 1], shares)

    def within(self, spans: Sequence[tuple[float, float]]) -> Trajectory:
        """Return the poses with first <= time <= last of any span, s; all of them without spans."""
        if not spans:
            return self
        keep = np.any([(self.times >= a) & (self.times <= b) for a, b in spans], axis=0)
        return Trajectory(self.times[keep], self.positions[keep], self.quats_xyzw[keep])

    def write_tum(self, path: Path, clock_origin_ns: int) -> None:
        """Write `t x y z qx qy qz qw` with absolute stamps that are exact to the nanosecond.

        Parameters
        ----------
        path : file to write, atomically
        clock_origin_ns : absolute time of `times == 0`, ns UTC
        """
        stamps = Clock(clock_origin_ns).to_absolute_text(self.times)
        poses = np.hstack([self.positions, self.quats_xyzw])
        lines = [
            f"{stamp} {x:.6f} {y:.6f} {z:.6f} {qx:.9f} {qy:.9f} {qz:.9f} {qw:.9f}\n"
            for stamp, (x, y, z, qx, qy, qz, qw) in zip(stamps, poses.tolist(), strict=True)
        ]
        write_text(Path(path), "".join(lines))

    def _require_cover(self, times: NDArray[np.float64]) -> None:
        outside = ~self.covers(times)
        if outside.any():
            first = int(np.argmax(outside))
            span = (
                f"{self.times[0]:.3f} to {self.times[-1]:.3f} s" if len(self.times) else "no pose"
            )
            msg = f"times: {times[first]:.6f} s in row {first} is outside the trajectory ({span})"
            raise ValueError(msg)


def read_tum(path: Path, clock_origin_ns: int | None = None) -> tuple[Trajectory, int]:
    """Read a trajectory of lines `t x y z qx qy qz qw`; lines that start with # are comments.

    Parameters
    ----------
    path : file to read
    clock_origin_ns : absolute time that becomes zero, ns UTC; default: the first stamp

    Returns
    -------
    trajectory : times in s since the origin
    clock_origin_ns : the origin

    Raises
    ------
    InputError
        If the file cannot be read, a line has no eight numbers, or the stamps do not increase.
    """
    stamps_ns, values = read_stamped_rows(
        Path(path), (_TUM_COLUMNS,), "t x y z qx qy qz qw", ignore_more=True
    )
    origin = int(stamps_ns[0]) if clock_origin_ns is None else clock_origin_ns
    relative_ns = stamps_ns - origin
    lengths = np.linalg.norm(values[:, 3:], axis=1, keepdims=True)
    if not np.isfinite(values).all() or (lengths == 0).any():
        msg = f"{path}: a pose is not finite or has a quaternion of length zero"
        raise InputError(msg)
    return Trajectory(relative_ns / NS_PER_S, values[:, :3].copy(), values[:, 3:] / lengths), origin


def read_stamped_rows(
    path: Path, widths: tuple[int, ...], layout: str, *, ignore_more: bool = False
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Read lines of a stamp in seconds and numbers; commas count as spaces, # begins a comment.

    A first line that names the columns (`t,x,y,z`) is left out.

    Parameters
    ----------
    path : file to read
    widths : numbers of columns, stamp included, of which all lines have one
    layout : names the columns in the messages
    ignore_more : leave out columns beyond the widest

    Returns
    -------
    stamps_ns : (N,) int64, increasing, N > 0
    values : (N, width - 1) float64

    Raises
    ------
    InputError
        If the file cannot be read, a line has another form, or the stamps do not increase.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        msg = f"{path}: not readable as a trajectory ({error})"
        raise InputError(msg) from error
    stamps_ns: list[int] = []
    rows: list[list[float]] = []
    for number, line in enumerate(lines, start=1):
        fields = line.replace(",", " ").split()
        if not fields or fields[0].startswith("#") or (not rows and _is_heading(fields)):
            continue
        fields = fields[: max(widths)] if ignore_more else fields
        expected = (len(rows[0]) + 1,) if rows else widths
        try:
            stamps_ns.append(int((Decimal(fields[0]) * NS_PER_S).to_integral_value()))
            rows.append([float(value) for value in fields[1:]])
            complete = len(fields) in expected and abs(stamps_ns[-1]) < _LATEST_NS
        except (InvalidOperation, ValueError, OverflowError):
            complete = False
        if not complete:
            msg = f"{path}, line {number}: expected `{layout}`, found {line[:80]!r}"
            raise InputError(msg)
    if not stamps_ns:
        msg = f"{path}: holds no pose; expected lines of `{layout}`"
        raise InputError(msg)
    stamps = np.array(stamps_ns, dtype=np.int64)
    late = np.diff(stamps) <= 0
    if late.any():
        msg = f"{path}: stamps must increase, pose {int(np.argmax(late)) + 2} does not"
        raise InputError(msg)
    return stamps, np.array(rows)


def _is_heading(fields: list[str]) -> bool:
    return fields[0].lower() in {"t", "time", "stamp", "timestamp"}
