# SPDX-License-Identifier: MIT OR Apache-2.0
"""Hokuyo UTM-30LX-F as Kaul 2015 flew it: 100 Hz, 270°, 0.65° (41,600 points per second)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.beams import Beams
from bentwing.simulate.lidars.interface import TRANSPORT, LidarClock
from bentwing.simulate.records import Record, ScanRecord

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

PERIOD = 0.01
N_BEAMS = 416
ANGLE_MIN = np.radians(-135.0)
ANGLE_INCREMENT = np.radians(0.65)
TIME_INCREMENT = PERIOD * 0.65 / 360.0
PHASE = 0.0037
"""s, first scan: the scanner's and the IMU's clocks do not tick together."""


@dataclass(frozen=True, slots=True)
class Hokuyo:
    """A 2D scanner that sweeps counter-clockwise about its z axis, its centre beam along x."""

    max_range: float = 30.0
    topic: str = "/scan"
    noise: float = 0.01
    rings: tuple[int, ...] = ()
    beam_sigma: float = 0.0

    def beams(self, start: float, end: float) -> Beams | None:
        """Return scans that begin in [start, end)."""
        first, last = (int(np.ceil((t - PHASE) / PERIOD - 1e-9)) for t in (start, end))
        if last <= first:
            return None
        begins = PHASE + PERIOD * np.arange(first, last)
        times = begins[:, None] + TIME_INCREMENT * np.arange(N_BEAMS)
        angles = ANGLE_MIN + ANGLE_INCREMENT * np.arange(N_BEAMS)
        fan = np.stack([np.cos(angles), np.sin(angles), np.zeros(N_BEAMS)], axis=-1)
        return Beams(times, np.broadcast_to(fan, (*times.shape, 3)), sweep_axis=1)

    def records(
        self,
        beams: Beams,
        ranges: Array,
        cosines: Array,
        clock: LidarClock,
        rng: np.random.Generator,
    ) -> list[Record]:
        """One `ScanRecord` per scan."""
        stamps = clock.stamps(beams.times[:, 0], rng)
        arrivals = beams.times[:, -1] + TRANSPORT + rng.exponential(0.001, len(stamps))
        brightness = 3000.0 * (0.25 + 0.75 * cosines) / (1.0 + (ranges / 12.0) ** 2)
        intensities = np.nan_to_num(brightness, nan=0.0).astype(np.float32)
        return [
            ScanRecord(
                stamp=stamps[i],
                arrival=arrivals[i],
                angle_min=float(ANGLE_MIN),
                angle_increment=float(ANGLE_INCREMENT),
                time_increment=TIME_INCREMENT,
                scan_time=PERIOD,
                ranges=ranges[i].astype(np.float32),
                intensities=intensities[i],
                range_min=0.1,
                range_max=self.max_range,
            )
            for i in range(len(stamps))
        ]
