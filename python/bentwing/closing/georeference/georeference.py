# SPDX-License-Identifier: MIT OR Apache-2.0
"""From an estimate in its own frame to one on the Earth."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import NotEnoughDataError
from bentwing.base.geodesy import ProjectedSystem
from bentwing.closing.georeference.antenna import find_antennas
from bentwing.closing.georeference.control_point_file import read_control_points
from bentwing.closing.georeference.marks import Marks, summary
from bentwing.closing.georeference.placement import (
    Placement,
    place,
)
from bentwing.closing.georeference.projection import MapProjection
from bentwing.closing.georeference.shares import shares_of
from bentwing.closing.georeference.site import Site
from bentwing.closing.georeference.snooping import contradictions
from bentwing.closing.georeference.standing import with_places

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.closing.georeference.antenna import Antenna
    from bentwing.closing.georeference.receivers import Receivers
    from bentwing.closing.georeference.settings import GeoreferenceSettings
    from bentwing.closing.georeference.snooping import Contradiction, Fit
    from bentwing.map.chunk import MapChunk

    Array = NDArray[np.float64]

DOUBTFUL_HEADING_STD = np.radians(1.0)  # half a metre at the end of a lidar's reach
_MEASURED = 5  # times that surfaces are found anew
_BENT = 2
_GEOID = 8.0  # m; where the geoid is nearer to the ellipsoid, nobody can tell the two by a flight


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
    receivers: Receivers | None,
    settings: GeoreferenceSettings,
    *,
    segments: Sequence[tuple[float, float]] = (),
    reach: float = 100.0,
    chunks: Callable[[], Iterable[MapChunk]] | None = None,
) -> Georeferenced | None:
    """Put a map on the Earth; None where there is nothing to do it with.

    Parameters
    ----------
    trajectory : `T_map_imu`
    receivers : GNSS fixes and their antennas
    settings : how they are used
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
    listed = None
    if settings.control_points is not None:
        listed = read_control_points(settings.control_points)
        listed = replace(listed, points=with_places(listed.points, trajectory))
    if settings.mode == "off" or (receivers is None and listed is None):
        return None
    system = None if settings.epsg is None else ProjectedSystem.of_epsg(settings.epsg)
    site = Site.of(trajectory, receivers, segments, system, listed)
    site, placement, used, antennas = _with_antennas(site)
    marks: Marks | None = None
    before: list[float | None] = []
    found: list[Contradiction] = []
    slack = site.slack()
    if listed is not None and chunks is not None:
        targets = site.targets_of(listed)
        marks = Marks.collect(listed.points, targets, placement, slack, chunks())
        marks.measure(placement, slack)
        if not len(site.positions.points) and not any(marks.found):
            msg = (
                f"the map has no flat surface and no sphere within {slack:.1f} m of any control point: without GNSS it is "
                "in a frame of its own, and two or more marks whose places in the map the file gives "
                "as map_x, map_y, map_z say where that is"
            )
            raise NotEnoughDataError(msg)
        before = marks.residuals(placement)
        placement, used = _measured(site, marks, placement, slack)
        found = contradictions(marks, _fit_of(site, marks, placement), site.n_known)
        marks.false = {one.number for one in found if one.is_certain and one.number in marks.used}
        if marks.false:
            placement, used = _measured(site, marks, placement, slack)
    bent = trajectory
    if settings.mode == "constraints":
        for _ in range(_BENT):
            bent = site.bent(bent, placement, used, marks)
    return _finished(
        site,
        bent,
        placement,
        used=used,
        reach=reach,
        marks=marks,
        before=before,
        contradicting=found,
        antennas=antennas,
        mode=settings.mode,
        columns={} if listed is None else listed.columns,
    )


def _with_antennas(site: Site) -> tuple[Site, Placement, NDArray[np.bool_], list[Antenna]]:
    """Place the map by the fixes, with the antennas where the fixes have them if the payload lets them."""
    placement, used = site.first_placement()
    antennas = find_antennas(site, placement)
    for antenna in antennas:
        if antenna.is_free:
            site = site.with_antenna(antenna.run, antenna.moved)
    if any(antenna.is_free for antenna in antennas):
        placement, used = site.first_placement()
    return site, placement, used, antennas


def _measured(
    site: Site, marks: Marks, placement: Placement, slack: float
) -> tuple[Placement, NDArray[np.bool_]]:
    """Place the map, and find the surfaces around the marks anew where they are then."""
    used = np.empty(0, np.bool_)
    for i in range(_MEASURED):
        surfaces, _ = marks.surfaces(marks.used)
        placement, used = place(site.positions_of(marks, marks.used), surfaces, placement)
        marks.measure(placement, slack if i == 0 else min(slack, 0.1))
    return placement, used


def _fit_of(site: Site, marks: Marks, start: Placement) -> Fit:
    def fit(numbers: Sequence[int]) -> Placement:
        return place(site.positions_of(marks, numbers), marks.surfaces(numbers)[0], start)[0]

    return fit


def _finished(
    site: Site,
    trajectory: Trajectory,
    placement: Placement,
    *,
    used: NDArray[np.bool_],
    reach: float,
    marks: Marks | None,
    before: Sequence[float | None],
    contradicting: Sequence[Contradiction],
    antennas: Sequence[Antenna],
    mode: str,
    columns: Mapping[str, str],
) -> Georeferenced:
    projection, record = _projected(site, trajectory, placement, reach)
    record["mode"] = mode
    warnings: list[str] = []
    if site.receivers is not None:
        gaps = placement.to_level(site.antenna(trajectory)[0]) - site.positions.targets
        record["fixes"], said = _of_fixes(site.receivers, gaps, used)
        record["antennas"] = [antenna.record() for antenna in antennas]
        warnings += said
        warnings += [a.sentence() for a in antennas if a.is_elsewhere and not a.is_free]
    if placement.std[0] > DOUBTFUL_HEADING_STD:
        known = f"the heading of the map is known to {np.degrees(placement.std[0]):.1f}° only"
        advice = (
            "give marks farther apart"
            if site.receivers is None
            else "fly a longer way, or give control points"
        )
        warnings.append(f"{known}: {advice}")
    if marks is not None:
        rows = marks.table(placement, before)
        record["control_points"], record["residuals"] = rows, summary(rows)
        record["control_point_columns"] = dict(columns)
        record["contradictions"] = [one.record(marks) for one in contradicting]
        warnings += [*marks.warnings(), *_other_heights(site, marks)]
    if trajectory is not site.original:
        moved = np.linalg.norm(trajectory.positions - site.original.positions, axis=1)
        record["bent_by"] = float(moved.max())
    return Georeferenced(trajectory, projection, placement, record, warnings)


def _other_heights(site: Site, marks: Marks) -> list[str]:
    """Say that marks are above or below all fixes, as heights above the sea are."""
    if not len(site.times):
        return []
    gap = float(np.median(marks.targets[:, 2]) - np.median(site.positions.targets[:, 2]))
    if abs(gap) < _GEOID or any(marks.found):
        return []
    where = "above" if gap > 0 else "below"
    return [
        f"the control points lie {abs(gap):.0f} m {where} the GNSS fixes, whose heights are above the "
        "ellipsoid; if those of the control points are above the sea, choose a system with such heights by "
        "--epsg"
    ]


def _projected(
    site: Site, trajectory: Trajectory, placement: Placement, reach: float
) -> tuple[MapProjection | None, dict[str, Any]]:
    """Return the projection, None into a frame that the marks have of their own, and its record."""
    if site.frame is None or site.system is None:
        zero = np.zeros(3)
        linear = {"map": zero, "projected": placement.translation, "matrix": placement.rotation}
        described = {"translation": placement.translation, "std": placement.std_record()}
        return None, {"heading": placement.heading, **described, "linear": linear}
    low = trajectory.positions.min(axis=0) - reach
    high = trajectory.positions.max(axis=0) + reach
    projection = MapProjection.over(low, high, site.frame, placement, site.system)
    return projection, projection.record()


def _of_fixes(
    receivers: Receivers, gaps: Array, used: NDArray[np.bool_]
) -> tuple[dict[str, Any], list[str]]:
    """Return what is recorded of the fixes, and what is said of runs that contradict them."""
    kept = gaps[used]
    record: dict[str, Any] = {
        **receivers.fixes.counts,
        "used": int(np.count_nonzero(used)),
        "rejected": int(np.count_nonzero(~used)),
        "rms_horizontal": float(np.sqrt(np.mean(np.sum(kept[:, :2] ** 2, axis=1)))),
        "rms_vertical": float(np.sqrt(np.mean(kept[:, 2] ** 2))),
    }
    if len(receivers.names) == 1:
        return record, []
    shares = shares_of(receivers, gaps, used)
    record["runs"] = [share.to_json() for share in shares]
    return record, [share.sentence() for share in shares if share.disagrees]
