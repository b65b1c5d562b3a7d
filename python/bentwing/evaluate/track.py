# SPDX-License-Identifier: MIT OR Apache-2.0
"""Reference trajectories: positions of a total station, or poses of motion capture."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.clock import NS_PER_S
from bentwing.base.errors import InputError
from bentwing.base.tum import read_rows
from bentwing.evaluate.track_columns import named_columns

if TYPE_CHECKING:
    from numpy.typing import NDArray

_LAYOUT = "t x y z` or `t x y z qx qy qz qw"
_POSITIONS, _POSES = 4, 8  # columns
_FEWEST = 3
_GAP = 5.0  # median intervals; a longer silence is not interpolated over
_SHORTEST_GAP = 0.5  # s


@dataclass(frozen=True, slots=True)
class Track:
    """A reference trajectory in a frame and on a clock of its own.

    Attributes
    ----------
    times : (N,) float64, s since `origin_ns`, increasing
    positions : (N, 3) float64, m, of the tracked point
    quats_xyzw : (N, 4) float64, or None where only positions are known
    origin_ns : absolute stamp of `times == 0` on the reference's clock
    n_repeats : measurements that had the stamp of the one before, and were left out
    """

    times: NDArray[np.float64]
    positions: NDArray[np.float64]
    quats_xyzw: NDArray[np.float64] | None
    origin_ns: int
    n_repeats: int = 0

    def moved_in_time(self, shift: float) -> Track:
        """Return the same with `shift` seconds added to all times."""
        return replace(self, times=self.times + shift)

    def interval(self) -> float:
        """Median time between two measurements, s."""
        return float(np.median(np.diff(self.times)))


def read_track(path: Path) -> Track:
    """Read a reference trajectory of lines `t x y z` or `t x y z qx qy qz qw`, spaces or commas.

    Columns in another order are read by the names in the first line, as those of EuRoC. Of several
    measurements with one stamp the first is taken.

    Raises
    ------
    InputError
        If the file has another form, or fewer than three measurements.
    """
    path = Path(path)
    stamps_ns, values = _read(path)
    repeats = np.append(False, np.diff(stamps_ns) == 0)
    stamps_ns, values = stamps_ns[~repeats], values[~repeats]
    if (np.diff(stamps_ns) < 0).any():
        row = int(np.argmax(np.diff(stamps_ns) < 0))
        msg = (
            f"{path}: stamps must increase; one goes back behind {stamps_ns[row] / NS_PER_S:.9f} s"
        )
        raise InputError(msg)
    if len(stamps_ns) < _FEWEST:
        msg = f"{path}: holds {len(stamps_ns)} measurements; at least {_FEWEST} are needed"
        raise InputError(msg)
    if not np.isfinite(values).all():
        row = int(np.argmin(np.isfinite(values).all(axis=1)))
        msg = f"{path}: measurement {row + 1} is not finite; remove it"
        raise InputError(msg)
    times = (stamps_ns - stamps_ns[0]) / NS_PER_S
    quats = _unit(path, values[:, 3:]) if values.shape[1] == _POSES - 1 else None
    return Track(times, values[:, :3].copy(), quats, int(stamps_ns[0]), int(repeats.sum()))


def _read(path: Path) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return stamps (N,), ns, and values (N, 3 or 7) in the usual order."""
    columns = named_columns(path)
    if columns is None:
        return read_rows(path, (_POSITIONS, _POSES), _LAYOUT)
    stamps_ns, values = read_rows(
        path, (columns.n,), columns.heading, per_second=columns.per_second
    )
    return stamps_ns, values[:, [i - 1 for i in columns.order]]


def bridges(stamps: NDArray[np.float64], times: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which of `times` (N,) lie outside of `stamps` or in a silence of them."""
    longest = max(_GAP * float(np.median(np.diff(stamps))), _SHORTEST_GAP)
    i = np.clip(np.searchsorted(stamps, times, side="right") - 1, 0, len(stamps) - 2)
    inside = (times >= stamps[0]) & (times <= stamps[-1])
    silent = (stamps[i + 1] - stamps[i] > longest) & (times != stamps[i]) & (times != stamps[i + 1])
    found: NDArray[np.bool_] = ~inside | silent
    return found


def _unit(path: Path, quats: NDArray[np.float64]) -> NDArray[np.float64]:
    lengths = np.linalg.norm(quats, axis=1, keepdims=True)
    off = np.abs(lengths[:, 0] - 1) > 0.1
    if off.any():
        row = int(np.argmax(off))
        msg = (
            f"{path}: the quaternion of measurement {row + 1} has length {lengths[row, 0]:.3g}; "
            "unit quaternions in the order qx qy qz qw are expected"
        )
        raise InputError(msg)
    unit: NDArray[np.float64] = quats / lengths
    return unit
