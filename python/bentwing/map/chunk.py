# SPDX-License-Identifier: MIT OR Apache-2.0
"""A piece of the map, small enough to pass from the projection to the writers one by one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.recording.batches import numbered, rows

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class MapChunk:
    """Points of the map in the order in which they were measured.

    Attributes
    ----------
    points : (N, 3) float64, m, map frame
    times : (N,) float64, s since the recording's start, IMU clock
    ranges : (N,) float32, m, distance from the lidar
    intensity : (N,) float32 or None, as the sensor reports it
    ring : (N,) uint16 or None, beam number
    """

    points: NDArray[np.float64]
    times: NDArray[np.float64]
    ranges: NDArray[np.float32]
    intensity: NDArray[np.float32] | None = None
    ring: NDArray[np.uint16] | None = None

    def __len__(self) -> int:
        return len(self.times)

    def where(self, keep: NDArray[np.bool_] | slice) -> MapChunk:
        """Return the points selected by a mask or a slice."""
        chosen = numbered(keep)
        return MapChunk(
            rows(self.points, chosen),
            rows(self.times, chosen),
            rows(self.ranges, chosen),
            None if self.intensity is None else rows(self.intensity, chosen),
            None if self.ring is None else rows(self.ring, chosen),
        )


def untimed(points: NDArray[np.float64]) -> MapChunk:
    """Points (N, 3) m of which nobody asks when and from where they were measured."""
    return MapChunk(points, np.zeros(len(points)), np.zeros(len(points), np.float32))
