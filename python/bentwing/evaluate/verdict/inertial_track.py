# SPDX-License-Identifier: MIT OR Apache-2.0
"""How an IMU has turned and accelerated by its own samples, a hundred times a second."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core
from bentwing.base.trajectory import DT

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording.batches import ImuBatch

# A silence of the IMU, s: nothing is known of what it would have measured.
GAP = 0.15
# A blow is recognized by what is so long before and behind it, s.
REACH = 0.25


class InertialTrack:
    """Integrals of the samples over time, in the frame of the IMU, without blows to its housing.

    Attributes
    ----------
    gaps : first and last time of each silence, s
    """

    def __init__(self) -> None:
        self.gaps: list[tuple[float, float]] = []
        self._kept: list[NDArray[np.float64]] = []
        # The newest samples as they were measured, and how many of them are in the integrals already.
        self._measured, self._n_done = np.empty((0, 7)), 0
        # Time, angular rate and force of the newest sample, and the integrals up to it.
        self._newest = np.empty((0, 7))
        self._sums = np.zeros(6)

    def add(self, batch: ImuBatch) -> None:
        """Take the next samples."""
        rows = np.column_stack([batch.times, batch.gyro, batch.accel])
        self._measured = np.vstack([self._measured, rows])
        if len(rows):
            self._integrate_until(float(rows[-1, 0]) - REACH)

    def _integrate_until(self, time: float) -> None:
        """Take measured samples up to `time`, s, and keep those that tell what follows."""
        measured = self._measured
        n = int(np.searchsorted(measured[:, 0], time, side="right"))
        if n <= self._n_done:
            return
        forces = _core.Imu(
            np.ascontiguousarray(measured[:, 0]),
            np.ascontiguousarray(measured[:, 1:4]),
            np.ascontiguousarray(measured[:, 4:]),
        ).forces
        self._integrate(np.column_stack([measured[:, :4], forces])[self._n_done : n])
        first = int(np.searchsorted(measured[:, 0], time - REACH))
        self._measured, self._n_done = measured[first:], n - first

    def _integrate(self, rows: NDArray[np.float64]) -> None:
        rows = np.vstack([self._newest, rows])
        steps = np.diff(rows[:, 0])
        means = 0.5 * (rows[1:, 1:] + rows[:-1, 1:])
        sums = self._sums + np.vstack([np.zeros(6), np.cumsum(means * steps[:, None], axis=0)])
        late = np.flatnonzero(steps > GAP)
        self.gaps += [(float(rows[i, 0]), float(rows[i + 1, 0])) for i in late]
        cells = np.floor(rows[:, 0] / DT)
        is_new = np.append(not len(self._newest), np.diff(cells) > 0)
        self._kept.append(np.column_stack([rows[is_new, 0], sums[is_new]]))
        self._newest, self._sums = rows[-1:], sums[-1]

    @property
    def table(self) -> NDArray[np.float64]:
        """(K, 7) times, s, and the integrals of angular rate, rad, and of force, m/s, up to them."""
        self._integrate_until(np.inf)
        if len(self._kept) > 1:
            self._kept = [np.concatenate(self._kept)]
        return self._kept[0] if self._kept else np.empty((0, 7))

    def means(self, times: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return angular rate and force (N - 1, 3), rad/s and m/s², between times (N,), s."""
        table, steps = self.table, np.diff(times)[:, None]
        sums = np.column_stack([np.interp(times, table[:, 0], axis) for axis in table[:, 1:].T])
        means = np.diff(sums, axis=0) / steps
        return means[:, :3], means[:, 3:]

    def samples(self, seconds: float) -> tuple[NDArray[np.float64], ...]:
        """Return times (K,), angular rates and forces (K, 3) of the first seconds."""
        table = self.table
        first = (
            table[: np.searchsorted(table[:, 0], table[0, 0] + seconds)] if len(table) else table
        )
        if len(first) < 2:
            return np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3))
        times = first[:, 0]
        rates, forces = self.means(times)
        return 0.5 * (times[1:] + times[:-1]), rates, forces
