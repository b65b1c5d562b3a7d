# SPDX-License-Identifier: MIT OR Apache-2.0
"""A piece of the map, small enough to pass from the projection to the writers one by one."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
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
    beams : (N, 3) float32 or None, unit direction from the lidar to the point, map frame
    doubtful : (N,) bool or None, whether the return may be of two surfaces at once
    incidence : (N,) float32 or None, rad, between beam and normal; NaN where there is no surface
    thickness : (N,) float32 or None, m, standard deviation of the points around across the
        surface; NaN where there is none
    shift : (N,) float32 or None, m, by how much the point was moved along its beam, away from the
        lidar; the range is as it was measured
    sigma : (N,) float32 or None, m, standard deviation along the beam; NaN where it is not known
    run_id : (N,) uint16 or None, of a map of several runs, which of them
    normals : (N, 3) float32 or None, unit, towards the lidar; NaN where they are not known
    attributes : (N,) structured or None, further fields of the recording, as its messages have them
    """

    points: NDArray[np.float64]
    times: NDArray[np.float64]
    ranges: NDArray[np.float32]
    intensity: NDArray[np.float32] | None = None
    ring: NDArray[np.uint16] | None = None
    beams: NDArray[np.float32] | None = None
    doubtful: NDArray[np.bool_] | None = None
    incidence: NDArray[np.float32] | None = None
    thickness: NDArray[np.float32] | None = None
    shift: NDArray[np.float32] | None = None
    sigma: NDArray[np.float32] | None = None
    run_id: NDArray[np.uint16] | None = None
    normals: NDArray[np.float32] | None = None
    attributes: NDArray[np.void] | None = None

    def __len__(self) -> int:
        return len(self.times)

    @property
    def measured(self) -> NDArray[np.float64]:
        """Where the points were before they were moved, (N, 3) float64, m."""
        if self.shift is None or self.beams is None:
            return self.points
        return self.points - self.beams * self.shift[:, None].astype(np.float64)

    def where(self, keep: NDArray[np.bool_] | slice) -> MapChunk:
        """Return the points selected by a mask or a slice."""
        chosen = numbered(keep)
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        kept = {k: rows(v, chosen) for k, v in values.items() if v is not None}
        return replace(self, **kept)


def untimed(points: NDArray[np.float64]) -> MapChunk:
    """Points (N, 3) m of which nobody asks when and from where they were measured."""
    return MapChunk(points, np.zeros(len(points)), np.zeros(len(points), np.float32))


def beams_of(chunk: MapChunk) -> NDArray[np.float32]:
    """Return the unit directions (N, 3) of the beams of a chunk, which it has to have."""
    if chunk.beams is None:
        msg = "chunk.beams: expected the direction of every beam, got None"
        raise ValueError(msg)
    return chunk.beams
