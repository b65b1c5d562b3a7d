# SPDX-License-Identifier: MIT OR Apache-2.0
"""Velodyne VLP-16: 16 beams over ±15°, 10 revolutions and 289,000 shots per second."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.beams import Beams
from bentwing.simulate.lidars.interface import TRANSPORT, LidarClock
from bentwing.simulate.records import POINT, CloudRecord, Record

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

PERIOD = 0.1
FIRING = 55.296e-6
"""s, from one firing of all 16 lasers to the next."""
SHOT = 2.304e-6
"""s, from one laser to the next within a firing."""
N_FIRINGS = 1808
ORDER = [0, 8, 1, 9, 2, 10, 3, 11, 4, 12, 5, 13, 6, 14, 7, 15]
"""Ring (from below) of each laser in the order of firing."""
PHASE = 0.0213
"""s, first revolution."""


@dataclass(frozen=True, slots=True)
class Vlp16:
    """A 3D scanner that turns clockwise (seen from above) about its z axis."""

    max_range: float = 100.0
    topic: str = "/points"
    noise: float = 0.02
    rings: tuple[int, ...] = tuple(ORDER)
    beam_sigma: float = float(np.radians(0.05))

    def beams(self, start: float, end: float) -> Beams | None:
        """Revolutions that begin in [start, end)."""
        first, last = (int(np.ceil((t - PHASE) / PERIOD - 1e-9)) for t in (start, end))
        if last <= first:
            return None
        begins = PHASE + PERIOD * np.arange(float(first), float(last))
        since = FIRING * np.arange(float(N_FIRINGS))[:, None] + SHOT * np.arange(16.0)
        azimuth = -2 * np.pi * since / PERIOD
        elevation = np.radians(-15.0 + 2.0 * np.array(ORDER))
        flat = np.cos(elevation)
        directions = np.stack(
            [flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation) + 0.0 * azimuth],
            axis=-1,
        )
        times = (begins[:, None, None] + since).reshape(-1, 16)
        return Beams(times, np.tile(directions, (len(begins), 1, 1)), sweep_axis=0)

    def records(
        self,
        beams: Beams,
        ranges: Array,
        cosines: Array,
        clock: LidarClock,
        rng: np.random.Generator,
    ) -> list[Record]:
        """One `CloudRecord` per revolution; shots without a return are left out."""
        revolutions = np.split(np.arange(len(ranges)), len(ranges) // N_FIRINGS)
        stamps = clock.stamps(beams.times[::N_FIRINGS, 0], rng)
        delays = TRANSPORT + rng.exponential(0.002, len(stamps))
        return [
            CloudRecord(
                stamp, beams.times[rows[-1], -1] + delay, _points(beams, ranges, cosines, rows)
            )
            for stamp, delay, rows in zip(stamps, delays, revolutions, strict=True)
        ]


def _points(
    beams: Beams, ranges: Array, cosines: Array, rows: NDArray[np.int64]
) -> NDArray[np.void]:
    distance, since = ranges[rows], beams.times[rows] - beams.times[rows[0], 0]
    returned = np.isfinite(distance) & (distance > 0.4)
    points = np.zeros(int(returned.sum()), dtype=POINT)
    xyz = beams.directions[rows][returned] * distance[returned][:, None]
    points["x"], points["y"], points["z"] = xyz.T
    points["intensity"] = np.round(10.0 + 90.0 * cosines[rows][returned])
    points["ring"] = np.broadcast_to(ORDER, distance.shape)[returned]
    points["time"] = since[returned]
    return points
