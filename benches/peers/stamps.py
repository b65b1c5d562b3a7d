# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which moment an engine's poses belong to, and how to find out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.trajectory import absolute_error

if TYPE_CHECKING:
    from benches.peers.engines import Engine
    from benches.peers.feed import Head

SEARCHED = 0.5
"""s to either side."""


def pose_stamps(stamps_ns: np.ndarray, head: Head, engine: Engine) -> np.ndarray:
    """When the poses that are stamped so are true (N,) int64, ns.

    A pose of a scan that does not exist (the last ones, where an engine names one later than it
    means) gets the time of the nearest that does.
    """
    starts, ends = np.array(head.starts_ns), np.array(head.ends_ns)
    after = np.clip(np.searchsorted(starts, stamps_ns), 1, len(starts) - 1)
    before = after - 1
    nearest = np.where(stamps_ns - starts[before] < starts[after] - stamps_ns, before, after)
    scan = np.clip(nearest + engine.pose_scan, 0, len(starts) - 1)
    share = engine.pose_share * (ends - starts)[scan]
    return starts[scan] + np.rint(share).astype(np.int64)


def on_truth(truth: Trajectory, times: np.ndarray) -> Trajectory:
    """The truth at the stamps of an estimate, so that none of its poses is interpolated."""
    inside = times[truth.covers(times)]
    return Trajectory(inside, *truth.interpolate(inside))


def best_shift(
    estimate: Trajectory, truth: Trajectory, during: tuple[float, float]
) -> tuple[float, float]:
    """The shift of the estimate's clock that fits the truth best, and the error with it.

    Returns
    -------
    shift : s, to be added to the estimate's times
    ate : m, of the positions in flight
    """

    def error(shift: float) -> float:
        moved = Trajectory(estimate.times + shift, estimate.positions, estimate.quats_xyzw)
        known = on_truth(truth, moved.times)
        return absolute_error(moved, known, during=during).position.rmse

    best, step = 0.0, 0.05
    around = np.arange(-SEARCHED, SEARCHED + step / 2, step)
    while step > 1e-4:
        best = float(min(best + around, key=error))
        around, step = np.linspace(-step, step, 9), step / 4
    return best, error(best)
