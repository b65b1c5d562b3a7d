# SPDX-License-Identifier: MIT OR Apache-2.0
"""From an estimate in its own frame to one on the Earth."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing import geometry
from bentwing.errors import NotEnoughDataError, UsageError
from bentwing.geodesy import LevelFrame, ProjectedSystem
from bentwing.georeference.bend import bend, of_fixes, of_surfaces
from bentwing.georeference.control_points import read_control_points
from bentwing.georeference.marks import Marks, summary
from bentwing.georeference.placement import Placement, Positions, Surfaces, place
from bentwing.georeference.projection import MapProjection

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from numpy.typing import NDArray

    from bentwing.georeference.settings import GeoreferenceSettings
    from bentwing.map.chunk import MapChunk
    from bentwing.recording.fixes import Fixes
    from bentwing.trajectory import Trajectory

    Array = NDArray[np.float64]

MAX_HEADING_STD = np.radians(3.0)  # worse than a compass: the map would point anywhere
_SLACK = (0.3, 3.0)  # m, least and most by which a mark is looked for beside its place
_MEASURED = 5  # times that surfaces are found anew
_BENT = 2


@dataclass(frozen=True, slots=True)
class Georeferenced:
    """Where the map is.

    Attributes
    ----------
    trajectory : in the map frame; another one than before only in the mode `constraints`
    projection : to projected coordinates; None without GNSS, where the control points' own frame
        stands for it
    placement : of the map in that frame
    record : for run.json
    warnings : sentences
    """

    trajectory: Trajectory
    projection: MapProjection | None
    placement: Placement
    record: dict[str, Any] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    def to_projected(self, points: Array) -> Array:
        """Coordinates (N, 3) m that are written, of map points (N, 3) m."""
        if self.projection is None:
            return self.placement.to_level(points)
        return self.projection.to_projected(points)

    @property
    def crs_wkt(self) -> str | None:
        """The coordinate reference system; None where it has no name."""
        return None if self.projection is None else self.projection.system.wkt


def georeference(
    trajectory: Trajectory,
    fixes: Fixes | None,
    settings: GeoreferenceSettings,
    *,
    lever_arm: Sequence[float] = (0.0, 0.0, 0.0),
    segments: Sequence[tuple[float, float]] = (),
    reach: float = 100.0,
    chunks: Callable[[], Iterable[MapChunk]] | None = None,
) -> Georeferenced | None:
    """Put a map on the Earth; None where there is nothing to do it with.

    Parameters
    ----------
    trajectory : `T_map_imu`
    fixes : of the GNSS receiver
    settings : how they are used
    lever_arm : (3,) m, antenna in the IMU frame
    segments : first and last time of each stretch of the trajectory without a break, s
    reach : m, how far from the trajectory there are points
    chunks : gives the points of the map, needed with control points

    Raises
    ------
    NotEnoughDataError
        If heading and place do not follow from the data.
    UsageError, InputError
        If the projected system or the file of the control points cannot be used.
    """
    listed = read_control_points(settings.control_points) if settings.control_points else []
    if settings.mode == "off" or (fixes is None and not listed):
        return None
    system = None if settings.epsg is None else ProjectedSystem.of_epsg(settings.epsg)
    site = _Site.of(trajectory, fixes, segments, lever_arm, system)
    placement, used = site.first_placement()
    marks: Marks | None = None
    before: list[float | None] = []
    slack = site.slack()
    if listed and chunks is not None:
        targets = site.targets_of(np.array([point.position for point in listed]))
        marks = Marks.collect(listed, targets, placement, slack, chunks())
        marks.measure(placement, slack)
        before = marks.residuals(placement)
        for i in range(_MEASURED):
            surfaces, _ = marks.surfaces()
            placement, used = place(site.positions, surfaces, placement)
            marks.measure(placement, slack if i == 0 else min(slack, 0.1))
    bent = trajectory
    if settings.mode == "constraints":
        for _ in range(_BENT):
            bent = site.bent(bent, placement, used, marks)
    return site.finished(bent, placement, used, reach, marks, before, settings)


@dataclass(frozen=True, slots=True)
class _Site:
    """Fixes and trajectory, before the map has a place."""

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
    ) -> _Site:
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
        positions = Positions(p + levers, frame.from_geodetic(places), fixes.covariances[covered])
        counts = dict(fixes.counts)
        return cls(trajectory, times, levers, positions, frame, system, counts, segments)

    def first_placement(self) -> tuple[Placement, NDArray[np.bool_]]:
        if self.frame is None:
            return Placement(0.0, np.zeros(3), np.zeros(4)), np.empty(0, np.bool_)
        placement, used = place(self.positions, Surfaces.none())
        if placement.std[0] > MAX_HEADING_STD:
            msg = (
                f"the GNSS fixes give the heading of the map to {np.degrees(placement.std[0]):.1f}° "
                "only: the way is too short for their noise"
            )
            raise NotEnoughDataError(msg)
        return placement, used

    def slack(self) -> float:
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
        observations = []
        if used.any():
            antenna, levers = self._antenna(trajectory)
            positions = Positions(
                antenna[used], self.positions.targets[used], self.positions.covariances[used]
            )
            targets = placement.to_map(positions.targets)
            turned = np.einsum(
                "ji,njk,kl->nil", placement.rotation, positions.covariances, placement.rotation
            )
            local = Positions(positions.points, positions.targets, turned)
            observations.append(of_fixes(self.times[used], levers[used], local, targets))
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

    def _antenna(self, trajectory: Trajectory) -> tuple[Array, Array]:
        """Antenna positions and lever arms (N, 3) m on another trajectory."""
        p, q = trajectory.interpolate(self.times)
        _, first = self.original.interpolate(self.times)
        turn = geometry.multiply(q, geometry.inverse(first))
        levers = geometry.rotate(turn, self.levers)
        return p + levers, levers

    def finished(
        self,
        trajectory: Trajectory,
        placement: Placement,
        used: NDArray[np.bool_],
        reach: float,
        marks: Marks | None,
        before: Sequence[float | None],
        settings: GeoreferenceSettings,
    ) -> Georeferenced:
        projection, record = None, {"mode": settings.mode}
        if self.frame is not None and self.system is not None:
            low = trajectory.positions.min(axis=0) - reach
            high = trajectory.positions.max(axis=0) + reach
            projection = MapProjection.over(low, high, self.frame, placement, self.system)
            record |= projection.record()
            gaps = placement.to_level(self._antenna(trajectory)[0]) - self.positions.targets
            kept = gaps[used]
            record["fixes"] = {
                **self.counts,
                "used": int(np.count_nonzero(used)),
                "rejected": int(np.count_nonzero(~used)),
                "rms_horizontal": float(np.sqrt(np.mean(np.sum(kept[:, :2] ** 2, axis=1)))),
                "rms_vertical": float(np.sqrt(np.mean(kept[:, 2] ** 2))),
            }
        else:
            record |= {"heading": placement.heading, "translation": placement.translation}
        warnings = []
        if marks is not None:
            rows = marks.table(placement, before)
            record["control_points"], record["residuals"] = rows, summary(rows)
            missing = [row["id"] for row in rows if row["residual"] is None]
            if missing:
                warnings.append(
                    f"no flat surface was found within the radius of {', '.join(missing)}: these "
                    "control points are not used"
                )
        if trajectory is not self.original:
            moved = np.linalg.norm(trajectory.positions - self.original.positions, axis=1)
            record["bent_by"] = float(moved.max())
        return Georeferenced(trajectory, projection, placement, record, warnings)
