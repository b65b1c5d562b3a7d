# SPDX-License-Identifier: MIT OR Apache-2.0
"""Some returns of a multi-beam lidar with their beams, and where they are in the map."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.memory import give_back
from bentwing.base.mount import MotorMount
from bentwing.base.value import Value
from bentwing.odometry.core_states import core_globals, core_samples
from bentwing.recording import LidarBatch
from bentwing.recording.beam_reading import directed, in_beams

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from bentwing.base.estimate import Estimate
    from bentwing.recording import Batch

    Array = NDArray[np.float64]

LENGTH = 20.0
"""s, of the stretch that is looked at."""
MANY = 80_000
"""Returns that are looked at."""
MOVED = 0.5
"""m; the stretch begins when the carrier has come so far."""


@dataclass(frozen=True, slots=True, eq=False)
class Shots(Value):
    """Returns in order of time.

    Attributes
    ----------
    times : (N,) s, IMU clock
    rings : (N,) beam of each
    ranges, elevations, azimuths, heights : (N,) m and rad, lidar frame: of the ray, and of where it
        begins above the lidar's origin
    origins : (N, 3) m, of the lidar in the map
    R_map_lidar : (N, 3, 3)
    """

    times: Array
    rings: NDArray[np.intp]
    ranges: Array
    elevations: Array
    azimuths: Array
    heights: Array
    origins: Array
    R_map_lidar: Array

    @property
    def n_beams(self) -> int:
        """Number of beams."""
        return int(self.rings.max()) + 1

    def points(self) -> Array:
        """Return where they are (N, 3), m, map frame."""
        local = directed(self.ranges, self.elevations, self.azimuths, self.heights)
        return self.origins + self._turned(local)

    def slopes(self) -> tuple[Array, Array, Array, Array]:
        """Return derivatives (N, 3) of `points` by elevation, azimuth, range and height, map frame."""
        flat = np.cos(self.elevations)
        rise, turn, ray = (
            directed(np.ones_like(flat), e, a, 0.0)
            for e, a in (
                (self.elevations + np.pi / 2, self.azimuths),
                (np.zeros_like(flat), self.azimuths + np.pi / 2),
                (self.elevations, self.azimuths),
            )
        )
        lengths = self.ranges[:, None]
        by_turn = (self.ranges * flat)[:, None] * self._turned(turn)
        up = self.R_map_lidar[:, :, 2]
        return lengths * self._turned(rise), by_turn, self._turned(ray), up

    def moved(self, turns: Array, shifts: Array, beams: Array) -> Shots:
        """Return them from corrected poses, with corrected beams.

        Parameters
        ----------
        turns, shifts : (N, 3) rotation vectors and translations of the lidar, map frame
        beams : (B, 4) added to elevation, azimuth, range and height of each beam
        """
        elevation, azimuth, distance, height = beams[self.rings].T
        return replace(
            self,
            ranges=self.ranges + distance,
            elevations=self.elevations + elevation,
            azimuths=self.azimuths + azimuth,
            heights=self.heights + height,
            origins=self.origins + shifts,
            R_map_lidar=geometry.to_matrices(geometry.exp(turns)) @ self.R_map_lidar,
        )

    def _turned(self, vectors: Array) -> Array:
        turned: Array = np.einsum("nij,nj->ni", self.R_map_lidar, vectors)
        return turned


def sample_shots(
    batches: Iterable[Batch], estimate: Estimate, table: tuple[float, ...] = ()
) -> Shots | None:
    """Choose returns of the first seconds in motion, evenly; None where there are no beams.

    Parameters
    ----------
    batches : of the recording the estimate is of
    table : elevation of each beam, rad, where the recording does not number them
    """
    held: list[LidarBatch] = []
    first, last = _span(estimate)
    for batch in batches:
        if not isinstance(batch, LidarBatch) or not len(batch.times):
            continue
        times = estimate.calibration.measured(batch.times)
        if times[0] > last:
            break
        if batch.ring is None and not table:
            return None
        inside = slice(np.searchsorted(times, first), np.searchsorted(times, last, side="right"))
        held.append(batch.where(inside))
    n = sum(len(batch.times) for batch in held)
    if n < 2:
        return None
    every, passed, chosen = max(1, n // MANY), 0, []
    for batch in held:
        chosen.append(batch.where(slice(-passed % every, None, every)))
        passed += len(batch.times)
    few = LidarBatch.joined(chosen)
    held.clear()
    chosen.clear()
    give_back()  # of all others
    return _placed(few, estimate, table)


def _span(estimate: Estimate) -> tuple[float, float]:
    """First and last time of the stretch, s: of the first segment."""
    trajectory = estimate.trajectory.within(estimate.spans[:1])
    far = np.linalg.norm(trajectory.positions - trajectory.positions[0], axis=1) > MOVED
    first = float(trajectory.times[np.argmax(far)])
    return first, min(first + LENGTH, float(trajectory.times[-1]))


def _placed(batch: LidarBatch, estimate: Estimate, table: tuple[float, ...]) -> Shots:
    samples, slow = core_samples(estimate.trajectory), core_globals(estimate.calibration)
    turned = isinstance(estimate.calibration.mount, MotorMount)
    angles = batch.angles if turned else None
    ends = [
        samples.place(np.tile(end, (len(batch.times), 1)), batch.times, angles, slow, threads=0)
        for end in (np.zeros(3), *np.eye(3))
    ]
    ranges, elevations, azimuths = in_beams(batch.points)
    rings = batch.ring
    if rings is None:
        rings = np.abs(elevations[:, None] - np.array(table)).argmin(axis=1)
    return Shots(
        estimate.calibration.measured(batch.times),
        rings.astype(np.intp),
        ranges,
        elevations,
        azimuths,
        np.zeros(len(ranges)),
        ends[0],
        np.stack([end - ends[0] for end in ends[1:]], axis=-1),
    )
