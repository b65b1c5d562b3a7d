# SPDX-License-Identifier: MIT OR Apache-2.0
"""A trajectory with its fixes, while the place of the map is looked for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.errors import NotEnoughDataError, UsageError
from bentwing.base.geodesy import LevelFrame, ProjectedSystem
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
    from bentwing.closing.georeference.control_point_file import ControlPoints
    from bentwing.closing.georeference.marks import Marks
    from bentwing.closing.georeference.receivers import Receivers

    Array = NDArray[np.float64]

MAX_HEADING_STD = np.radians(15.0)  # worse than a compass: the map would point anywhere
FEWEST_PICKED = 2
_SLACK = (0.3, 3.0)  # m, least and most by which a mark is looked for beside its place


@dataclass(frozen=True, slots=True)
class Site:
    """Fixes and trajectory, before the map has a place.

    Attributes
    ----------
    original : the trajectory as it was estimated
    receivers : the fixes during the trajectory; None without any
    levers : (N, 3) m, from the IMU to the antenna, in the axes of the map
    positions : of the antenna, or without fixes of marks that were seen, in the map and on the Earth
    frame : level frame near the fixes or marks; None where these are in a system of their own
    system : of the map that is written; None there, too
    segments : first and last time of each stretch of the trajectory without a break, s
    """

    original: Trajectory
    receivers: Receivers | None
    levers: Array
    positions: Positions
    frame: LevelFrame | None
    system: ProjectedSystem | None
    segments: Sequence[tuple[float, float]]

    @classmethod
    def of(
        cls,
        trajectory: Trajectory,
        receivers: Receivers | None,
        segments: Sequence[tuple[float, float]],
        system: ProjectedSystem | None,
        listed: ControlPoints | None = None,
    ) -> Site:
        """Bring fixes and trajectory together; without fixes, control points and the map."""
        if receivers is None:
            return cls._of_marks(trajectory, segments, system, listed)
        first, last = float(trajectory.times[0]), float(trajectory.times[-1])
        seen = receivers.during([(first, last)])
        if segments:
            seen = seen.during(segments)
        times, places = seen.fixes.times, seen.fixes.places
        if len(times) < 2:
            msg = (
                f"{len(times)} of {seen.fixes.counts['messages']} GNSS messages are fixes during the "
                "trajectory; at least 2 are needed"
            )
            raise NotEnoughDataError(msg)
        frame = LevelFrame(*(float(value) for value in np.median(places, axis=0)))
        system = system or ProjectedSystem.utm(frame.longitude, frame.latitude)
        p, q = trajectory.interpolate(times)
        levers = geometry.rotate(q, seen.lever_arms)
        positions = Positions(
            p + levers,
            frame.from_geodetic(places),
            seen.fixes.covariances,
            independent_share(times),
        )
        return cls(trajectory, seen, levers, positions, frame, system, segments)

    @classmethod
    def _of_marks(
        cls,
        trajectory: Trajectory,
        segments: Sequence[tuple[float, float]],
        system: ProjectedSystem | None,
        listed: ControlPoints | None,
    ) -> Site:
        """Return a map that only marks place: in a projected system if one is known, else in their own."""
        empty = np.empty((0, 3))
        nowhere = Positions(empty, empty, np.empty((0, 3, 3)))
        bare = cls(trajectory, None, empty, nowhere, None, system, segments)
        if listed is None:
            return bare
        picked = [
            number
            for number, point in enumerate(listed.points)
            if point.picked is not None and point.use == "control"
        ]
        if len(picked) < FEWEST_PICKED and (picked or listed.in_degrees):
            msg = (
                f"{len(picked)} of {len(listed.points)} control points were seen in the map; without GNSS "
                f"at least {FEWEST_PICKED} must have map_x, map_y, map_z, or a time at which the carrier stood there"
            )
            raise NotEnoughDataError(msg)
        if not picked:
            return bare
        if listed.in_degrees or system is not None:
            bare = bare._around(listed)
        marks = [listed.points[number] for number in picked]
        positions = Positions(
            np.array([mark.picked for mark in marks]),
            bare.targets_of(listed)[picked],
            np.array([mark.sigma**2 * np.eye(3) for mark in marks]),
        )
        return replace(bare, positions=positions)

    def _around(self, listed: ControlPoints) -> Site:
        """Return the site with a level frame in the middle of marks."""
        places = np.array([point.position for point in listed.points])
        if not listed.in_degrees and self.system is not None:
            places = self.system.to_geodetic(places)
        frame = LevelFrame(*(float(value) for value in np.median(places, axis=0)))
        system = self.system or ProjectedSystem.utm(frame.longitude, frame.latitude)
        return replace(self, frame=frame, system=system)

    @property
    def times(self) -> Array:
        """(N,) s, of the fixes."""
        return np.empty(0) if self.receivers is None else self.receivers.fixes.times

    def first_placement(self) -> tuple[Placement, NDArray[np.bool_]]:
        """Place the map by the fixes, or by the marks that were seen in it; without any, where it is."""
        if not len(self.positions.points):
            return Placement(0.0, np.zeros(3), np.zeros(4)), np.empty(0, np.bool_)
        placement, used = place(self.positions, Surfaces.none())
        if self.receivers is not None and placement.std[0] > MAX_HEADING_STD:
            msg = (
                f"the GNSS fixes give the heading of the map to {np.degrees(placement.std[0]):.1f}° "
                "only: the path is too short for their noise"
            )
            raise NotEnoughDataError(msg)
        return placement, used

    def with_antenna(self, run: int, by: Array) -> Site:
        """Return the site with the antenna of one run elsewhere, by (3,) m in the IMU frame."""
        assert self.receivers is not None
        receivers = self.receivers.moved(run, by)
        p, q = self.original.interpolate(self.times)
        levers = geometry.rotate(q, receivers.lever_arms)
        positions = replace(self.positions, points=p + levers)
        return replace(self, receivers=receivers, levers=levers, positions=positions)

    @property
    def n_known(self) -> int:
        """Number of measurements of the place beside those of marks."""
        return 3 * len(self.times)

    def positions_of(self, marks: Marks, numbers: Sequence[int]) -> Positions:
        """Return the fixes, or without any those of some marks that were seen in the map."""
        return marks.seen(numbers) if self.receivers is None else self.positions

    def slack(self) -> float:
        """How far beside its place a control point is looked for, m."""
        if not len(self.times):
            return _SLACK[0]
        variances = np.diagonal(self.positions.covariances, axis1=1, axis2=2)
        return float(np.clip(3 * np.sqrt(np.median(variances.max(axis=1))), *_SLACK))

    def targets_of(self, listed: ControlPoints) -> Array:
        """East, north, up (K, 3) of marks."""
        coordinates = np.array([point.position for point in listed.points])
        if self.frame is None or self.system is None:
            return coordinates
        places = coordinates if listed.in_degrees else self.system.to_geodetic(coordinates)
        targets = self.frame.from_geodetic(places)
        far = float(np.linalg.norm(targets, axis=1).max())
        if not far < 1e5:
            msg = (
                f"a control point is {far / 1000:.0f} km from the others and from any GNSS fix; "
                f"coordinates in metres are taken as easting, northing and height in "
                f"EPSG:{self.system.epsg}; give the system they are in with --epsg"
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
        # slow to import, so only when it is needed
        from bentwing.closing.georeference.bend import bend, of_fixes, of_surfaces

        observations = []
        if self.receivers is not None and used.any():
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
            surfaces, times = marks.surfaces(marks.used)
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
