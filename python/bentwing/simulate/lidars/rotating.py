# SPDX-License-Identifier: MIT OR Apache-2.0
"""Lidars whose beams, one above the other, turn about an axis: ten revolutions a second."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.beams import Beams
from bentwing.simulate.lidars.interface import TRANSPORT, LidarClock
from bentwing.simulate.records import POINT, CloudRecord, Record

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

PERIOD = 0.1
PHASE = 0.0213
"""s, first revolution."""
NEAREST = 0.4
"""m, from which on there are returns."""


@dataclass(frozen=True, slots=True)
class Revolution:
    """What one revolution measured, in the grid (columns, beams) of its shots.

    Attributes
    ----------
    directions : (A, B, 3) unit vectors, lidar frame, where the beams are said to point to
    ranges : (A, B) m; infinite without a return, NaN when lost
    cosines : (A, B) of incidence
    since : (A, B) s, since the first shot
    rings : (B,)
    """

    directions: Array
    ranges: Array
    cosines: Array
    since: Array
    rings: tuple[int, ...]

    def returned(self) -> NDArray[np.bool_]:
        """Tell which shots (A, B) returned."""
        return np.isfinite(self.ranges) & (self.ranges > NEAREST)


def velodyne_points(revolution: Revolution) -> NDArray[np.void]:
    """Pack the returns as Velodyne's driver does; shots without one are left out."""
    returned = revolution.returned()
    points = np.zeros(int(returned.sum()), dtype=POINT)
    xyz = revolution.directions[returned] * revolution.ranges[returned][:, None]
    points["x"], points["y"], points["z"] = xyz.T
    points["intensity"] = np.round(10.0 + 90.0 * revolution.cosines[returned])
    points["ring"] = np.broadcast_to(revolution.rings, returned.shape)[returned]
    points["time"] = revolution.since[returned]
    return points


@dataclass(frozen=True, slots=True)
class Rotating:
    """A 3D scanner that turns clockwise (seen from above) about its z axis.

    Attributes
    ----------
    rings : (B,) number of each beam, in the order of firing
    elevations, azimuths : (B,) rad, above the level and clockwise of the column
    firing, shot : s, from one column to the next, and from beam to beam within one
    n_firings : columns of a revolution
    beam_sigma : rad, usual error of the stated directions
    pack : makes the points of a message
    """

    rings: tuple[int, ...]
    elevations: tuple[float, ...]
    azimuths: tuple[float, ...]
    firing: float
    shot: float
    n_firings: int
    max_range: float
    noise: float
    beam_sigma: float
    pack: Callable[[Revolution], NDArray[np.void]] = velodyne_points
    topic: str = "/points"

    def beams(self, start: float, end: float) -> Beams | None:
        """Revolutions that begin in [start, end)."""
        first, last = (int(np.ceil((t - PHASE) / PERIOD - 1e-9)) for t in (start, end))
        if last <= first:
            return None
        begins = PHASE + PERIOD * np.arange(float(first), float(last))
        n_beams = len(self.rings)
        columns = np.arange(float(self.n_firings))[:, None]
        since = self.firing * columns + self.shot * np.arange(float(n_beams))
        azimuth = -2 * np.pi * since / PERIOD - np.array(self.azimuths)
        elevation = np.array(self.elevations)
        flat = np.cos(elevation)
        directions = np.stack(
            [flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation) + 0.0 * azimuth],
            axis=-1,
        )
        times = (begins[:, None, None] + since).reshape(-1, n_beams)
        return Beams(times, np.tile(directions, (len(begins), 1, 1)), sweep_axis=0)

    def records(
        self,
        beams: Beams,
        ranges: Array,
        cosines: Array,
        clock: LidarClock,
        rng: np.random.Generator,
    ) -> list[Record]:
        """One `CloudRecord` per revolution."""
        revolutions = np.split(np.arange(len(ranges)), len(ranges) // self.n_firings)
        stamps = clock.stamps(beams.times[:: self.n_firings, 0], rng)
        delays = TRANSPORT + rng.exponential(0.002, len(stamps))
        result: list[Record] = []
        for stamp, delay, rows in zip(stamps, delays, revolutions, strict=True):
            since = beams.times[rows] - beams.times[rows[0], 0]
            turn = Revolution(
                beams.directions[rows], ranges[rows], cosines[rows], since, self.rings
            )
            result.append(CloudRecord(stamp, beams.times[rows[-1], -1] + delay, self.pack(turn)))
        return result
