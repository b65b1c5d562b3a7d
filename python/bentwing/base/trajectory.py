# SPDX-License-Identifier: MIT OR Apache-2.0
"""The trajectory as a value: poses of the IMU in the map at increasing times."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.arguments import finite_array, in_order
from bentwing.base.clock import NS_PER_S
from bentwing.base.tum import read_poses, write_poses
from bentwing.base.value import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import Self

DT = 0.01
"""Interval of the samples of estimated trajectories, s."""

# Rounding to three digits passes, a transform that scales or mirrors does not.
_ROTATION_TOLERANCE = 1e-3


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Trajectory(Value):
    """Poses `T_map_imu` at increasing times; between them p is linear and R is slerped.

    Arguments may be of any numeric type; float64 arrays are taken as they are, without a copy. A
    slice, a mask or an array of indices selects poses, `trajectory[::10]`, and a single index too:
    it gives the trajectory of one pose.

    Attributes
    ----------
    times : (N,) float64, s since the recording's start, increasing, IMU clock
    positions : (N, 3) float64, m, map frame
    quats_xyzw : (N, 4) float64, unit Hamilton quaternions

    Raises
    ------
    TypeError, ValueError
        If an array has another shape, holds NaN, or the times do not increase.
    """

    times: NDArray[np.float64]
    positions: NDArray[np.float64]
    quats_xyzw: NDArray[np.float64]

    def __post_init__(self) -> None:
        times = finite_array("times", self.times, None)
        in_order("times", times, strictly=True)
        n = len(times)
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "positions", finite_array("positions", self.positions, n, 3))
        object.__setattr__(self, "quats_xyzw", finite_array("quats_xyzw", self.quats_xyzw, n, 4))

    @classmethod
    def from_matrices(cls, times: ArrayLike, T_map_imu: ArrayLike) -> Self:
        """Make a trajectory of homogeneous matrices.

        Parameters
        ----------
        times : (N,), s since the recording's start, increasing
        T_map_imu : (N, 4, 4), rotation and translation in m, last row 0 0 0 1

        Raises
        ------
        TypeError, ValueError
            If the shapes differ, or a matrix is not a rigid transform.
        """
        stamps = finite_array("times", times, None)
        T = finite_array("T_map_imu", T_map_imu, len(stamps), 4, 4)
        R = T[:, :3, :3]
        off = np.abs(R @ R.swapaxes(1, 2) - np.eye(3)).max(axis=(1, 2), initial=0.0)
        is_rigid = (
            (off < _ROTATION_TOLERANCE)
            & (np.linalg.det(R) > 0)
            & np.all(T[:, 3] == [0.0, 0.0, 0.0, 1.0], axis=1)
        )
        if not is_rigid.all():
            row = int(np.argmin(is_rigid))
            msg = (
                f"T_map_imu: matrix {row} is not a rotation and a translation above 0 0 0 1: "
                f"{T[row].tolist()}"
            )
            raise ValueError(msg)
        return cls(stamps, T[:, :3, 3], geometry.from_matrices(R))

    @classmethod
    def read_tum(cls, path: Path | str, clock_origin_ns: int | None = None) -> tuple[Self, int]:
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
        stamps_ns, poses = read_poses(Path(path))
        origin = int(stamps_ns[0]) if clock_origin_ns is None else clock_origin_ns
        return cls((stamps_ns - origin) / NS_PER_S, poses[:, :3], poses[:, 3:]), origin

    def write_tum(self, path: Path | str, clock_origin_ns: int) -> None:
        """Write `t x y z qx qy qz qw` with absolute stamps that are exact to the nanosecond.

        Parameters
        ----------
        path : file to write, atomically
        clock_origin_ns : absolute time of `times == 0`, ns UTC
        """
        poses = np.hstack([self.positions, self.quats_xyzw])
        write_poses(Path(path), self.times, poses, clock_origin_ns)

    def __len__(self) -> int:
        return len(self.times)

    def __getitem__(
        self, chosen: int | slice | Sequence[int] | NDArray[np.bool_] | NDArray[np.intp]
    ) -> Trajectory:
        # Of a single index the row is kept as a table of one.
        rows = [chosen] if isinstance(chosen, (int, np.integer)) else chosen
        return Trajectory(self.times[rows], self.positions[rows], self.quats_xyzw[rows])

    def __repr__(self) -> str:
        if not len(self):
            return "Trajectory(no poses)"
        poses = "1 pose" if len(self) == 1 else f"{len(self)} poses"
        return f"Trajectory({poses}, {self.times[0]:.3f} to {self.times[-1]:.3f} s)"

    @property
    def T_map_imu(self) -> NDArray[np.float64]:
        """(N, 4, 4) float64, homogeneous."""
        T = np.zeros((len(self), 4, 4))
        T[:, :3, :3], T[:, :3, 3] = geometry.to_matrices(self.quats_xyzw), self.positions
        T[:, 3, 3] = 1.0
        return T

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
        return self[keep]

    def _require_cover(self, times: NDArray[np.float64]) -> None:
        outside = ~self.covers(times)
        if outside.any():
            first = int(np.argmax(outside))
            span = (
                f"{self.times[0]:.3f} to {self.times[-1]:.3f} s" if len(self.times) else "no pose"
            )
            msg = f"times: {times[first]:.6f} s in row {first} is outside the trajectory ({span})"
            raise ValueError(msg)


read_tum = Trajectory.read_tum
