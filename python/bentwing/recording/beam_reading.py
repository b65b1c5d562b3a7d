# SPDX-License-Identifier: MIT OR Apache-2.0
"""How the beams of a multi-beam lidar are read: where they truly point to, and how far."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import PayloadError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording.sections.beams import Beams

    Array = NDArray[np.float64]


def in_beams(points: Array) -> tuple[Array, Array, Array]:
    """Return ranges, m, elevations and azimuths, rad, each (N,), of points (N, 3), lidar frame."""
    x, y, z = points.T
    flat = np.hypot(x, y)
    return np.hypot(flat, z), np.arctan2(z, flat), np.arctan2(y, x)


def directed(ranges: Array, elevations: Array, azimuths: Array, heights: Array | float) -> Array:
    """Return points (N, 3), m, lidar frame, of rays that begin `heights` above its origin."""
    flat = ranges * np.cos(elevations)
    return np.column_stack(
        [flat * np.cos(azimuths), flat * np.sin(azimuths), ranges * np.sin(elevations) + heights]
    )


@dataclass(frozen=True, slots=True)
class BeamReading:
    """Adds to each return what its beam is off.

    Attributes
    ----------
    beams : as the payload describes them
    """

    beams: Beams

    def points(self, points: Array, ring: NDArray[np.uint16] | None) -> Array:
        """Return corrected points (N, 3), m, lidar frame.

        Parameters
        ----------
        ring : (N,) the beam of each; None: by the table

        Raises
        ------
        PayloadError
            The beams of the returns are not known, or there are more than the payload has.
        """
        ranges, elevations, azimuths = in_beams(points)
        beam = self._beams_of(elevations, ring)
        found = self.beams
        if found.ranges:
            ranges = ranges + np.array(found.ranges)[beam]
        if found.elevations:
            elevations = elevations + np.array(found.elevations)[beam]
        if found.azimuths:
            azimuths = azimuths + np.array(found.azimuths)[beam]
        heights = np.array(found.heights)[beam] if found.heights else 0.0
        return np.ascontiguousarray(directed(ranges, elevations, azimuths, heights))

    def _beams_of(self, elevations: Array, ring: NDArray[np.uint16] | None) -> NDArray[np.intp]:
        n = self.beams.n_beams
        if ring is not None:
            if len(ring) and int(ring.max()) >= n:
                msg = (
                    f"lidar.beams describes {n} beams, the recording has a beam {int(ring.max())}: "
                    "give one value for each, or leave lidar.beams out"
                )
                raise PayloadError(msg)
            return ring.astype(np.intp)
        if not self.beams.table:
            msg = (
                "lidar.beams describes beams by their numbers, which the recording does not have: add "
                "lidar.beams.table, the elevations of the beams as the recording has them, rad"
            )
            raise PayloadError(msg)
        order = np.argsort(self.beams.table)
        table = np.array(self.beams.table)[order]
        between = 0.5 * (table[1:] + table[:-1])
        return order[np.searchsorted(between, elevations)]
