# SPDX-License-Identifier: MIT OR Apache-2.0
"""A trajectory with its fixes, while the place of the map is looked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.errors import NotEnoughDataError, UsageError
from bentwing.base.geodesy import LevelFrame, ProjectedSystem
from bentwing.closing.georeference.bend import bend, of_fixes, of_surfaces
from bentwing.closing.georeference.placement import (
    Placement,
    Positions,
    Surfaces,
    independent_share,
    place,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.closing.georeference.marks import Marks
    from bentwing.recording.fixes import Fixes

    Array = NDArray[np.float64]

MAX_HEADING_STD = np.radians(15.0)  # worse than a compass: the map would point anywhere
_SLACK = (0.3, 3.0)  # m, least and most by which a mark is looked for beside its place


@dataclass(frozen=True, slots=True)
class Site:
    """Fixes and trajectory, before the map has a place.

    Attributes
    ----------
    original : the trajectory as it was estimated
    times : (N,) s, of the fixes
    levers : (N, 3) m, from the IMU to the antenna, in the axes of the map
    positions : of the antenna, in the map and on the Earth
    frame : level frame near the fixes; None without fixes
    system : of the map that is written; None without fixes
    counts : of the fixes
    segments : first and last time of each stretch of the trajectory without a break, s
    """

    original: Trajectory
    times: Array
    levers: Array
    positions: Positions
    frame: LevelFrame | None
    system: ProjectedSystem | None
    counts: dict[str, int]
    segments: Sequence[tuple[float, float]]

    @classmethod
    def of(
        cls,
        trajectory: Trajectory,
        fixes: Fixes | None,
        segments: Sequence[tuple[float, float]],
        lever_arm: Sequence[float],
        system: ProjectedSystem | None,
    ) -> Site:
        """Bring fixes and trajectory together."""
        empty = np.empty((0, 3))
        if fixes is None:
            positions = Positions(empty, empty, np.empty((0, 3, 3)))
            return cls(trajectory, np.empty(0), empty, positions, None, system, {}, segments)
        covered = trajectory.covers(fixes.times)
        if segments:
            covered &= np.any(
                [(fixes.times >= a) & (fixes.times <= b) for a, b in segments], axis=0
            )
        times, places = fixes.times[covered], fixes.places[covered]
        if len(times) < 2:
            msg = (
                f"{len(times)} of {fixes.counts['messages']} GNSS messages are fixes during the "
                "trajectory; at least 2 are needed"
            )
            raise NotEnoughDataError(msg)
        frame = LevelFrame(*(float(value) for value in np.median(places, axis=0)))
        system = system or ProjectedSystem.utm(frame.longitude, frame.latitude)
        p, q = trajectory.interpolate(times)
        levers = geometry.rotate(q, np.broadcast_to(np.asarray(lever_arm, float), p.shape))
        positions = Positions(
            p + levers,
            frame.from_geodetic(places),
            fixes.covariances[covered],
            independent_share(times),
        )
        counts = dict(fixes.counts)
        return cls(trajectory, times, levers, positions, frame, system, counts, segments)

    def first_placement(self) -> tuple[Placement, NDArray[np.bool_]]:
        """Place the map by the fixes alone; without any, where it is."""
        if self.frame is None:
            return Placement(0.0, np.zeros(3), np.zeros(4)), np.empty(0, np.bool_)
        placement, used = place(self.positions, Surfaces.none())
        if placement.std[0] > MAX_HEADING_STD:
            msg = (
                f"the GNSS fixes give the heading of the map to {np.degrees(placement.std[0]):.1f}° "
                "only: the path is too short for their noise"
            )
            raise NotEnoughDataError(msg)
        return placement, used

    def slack(self) -> float:
        """How far beside its place a control point is looked for, m."""
        if not len(self.times):
            return _SLACK[0]
        variances = np.diagonal(self.positions.covariances, axis1=1, axis2=2)
        return float(np.clip(3 * np.sqrt(np.median(variances.max(axis=1))), *_SLACK))

    def targets_of(self, coordinates: Array) -> Array:
        """East, north, up (K, 3) of coordinates in the projected system."""
        if self.frame is None or self.system is None:
            return coordinates
        targets = self.frame.from_geodetic(self.system.to_geodetic(coordinates))
        far = float(np.linalg.norm(targets, axis=1).max())
        if not far < 1e5:
            msg = (
                f"a control point is {far / 1000:.0f} km from the GNSS fixes; its coordinates are "
                f"taken as easting, northing and height in EPSG:{self.system.epsg}; give the "
                "system they are in with --epsg"
            )
            raise UsageError(msg)
        return targets

    def bent(
        self,
        trajectory: Trajectory,
        placement: Placement,
        used: NDArray[np.bool_],
        marks: Marks | None,
    ) -> Trajectory:
        """Let a trajectory give way to the fixes and the control points."""
        observations = []
        if used.any():
            antenna, levers = self.antenna(trajectory)
            positions = Positions(
                antenna[used],
                placement.to_map(self.positions.targets[used]),
                np.einsum(
                    "ji,njk,kl->nil",
                    placement.rotation,
                    self.positions.covariances[used],
                    placement.rotation,
                ),
                self.positions.share,
            )
            observations.append(of_fixes(self.times[used], levers[used], positions))
        if marks is not None:
            surfaces, times = marks.surfaces()
            if len(times):
                levers = surfaces.points - trajectory.interpolate(times)[0]
                targets = placement.to_map(surfaces.targets)
                observations.append(of_surfaces(times, levers, surfaces, targets))
        if not observations:
            return trajectory
        after = bend(trajectory, observations, self.segments)
        if marks is not None:
            marks.follow(trajectory, after)
            marks.measure(placement, 0.1)
        return after

    def antenna(self, trajectory: Trajectory) -> tuple[Array, Array]:
        """Antenna positions and lever arms (N, 3) m on another trajectory."""
        p, q = trajectory.interpolate(self.times)
        _, first = self.original.interpolate(self.times)
        turn = geometry.multiply(q, geometry.inverse(first))
        levers = geometry.rotate(turn, self.levers)
        return p + levers, levers
