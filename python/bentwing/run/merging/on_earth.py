# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where on the Earth a merged map is: by the fixes of all its runs, and by control points."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from bentwing.base.errors import NotEnoughDataError, UsageError
from bentwing.base.trajectory import Trajectory
from bentwing.closing.georeference.control_point_file import read_control_points
from bentwing.closing.georeference.georeference import georeference
from bentwing.closing.georeference.receivers import Receivers
from bentwing.run.gnss import receivers_of
from bentwing.run.mapping import follow_each_other, in_turn, joined_trajectory

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.base.estimate import Estimate
    from bentwing.closing.georeference.georeference import Georeferenced
    from bentwing.closing.georeference.settings import GeoreferenceSettings
    from bentwing.run.mapping import MapSource
    from bentwing.run.merging.source import Source


@dataclass(frozen=True, slots=True)
class OnEarth:
    """Runs with their place on the Earth.

    Attributes
    ----------
    estimates : of the runs, bent by the fixes where that was asked for
    placed : None where nothing says where they are
    warnings : sentences
    """

    estimates: list[Estimate]
    placed: Georeferenced | None = None
    warnings: tuple[str, ...] = ()


def settings_of_runs(
    wanted: GeoreferenceSettings, sources: Sequence[Source]
) -> GeoreferenceSettings:
    """Return what is wanted, and for the rest what the runs were mapped with, where they agree."""
    agreed: dict[str, Any] = {}
    for name in type(wanted).model_fields.keys() - wanted.model_fields_set:
        values = {getattr(source.georeferencing, name) for source in sources} - {None}
        if len(values) == 1:
            agreed[name] = values.pop()
    return wanted.model_copy(update=agreed)


def require_places(wanted: GeoreferenceSettings) -> None:
    """Refuse marks with times of standing, which several recordings would all understand.

    Raises
    ------
    UsageError
    """
    if wanted.control_points is None:
        return
    timed = [p.name for p in read_control_points(wanted.control_points).points if p.standing]
    if timed:
        msg = (
            f"{wanted.control_points}: {', '.join(timed[:3])} have times, and of several recordings nobody knows "
            "of which; give their places in the merged map as map_x, map_y, map_z"
        )
        raise UsageError(msg)


def place_on_earth(
    sources: Sequence[Source], points: Sequence[MapSource], settings: GeoreferenceSettings
) -> OnEarth:
    """Put runs that are in one frame on the Earth, all by one placement.

    Parameters
    ----------
    points : of the runs, in the same order
    settings : how fixes and control points are used

    Raises
    ------
    UsageError, InputError
        If the projected system or the file of the control points cannot be used.
    """
    estimates = [one.estimate for one in points]
    offsets = follow_each_other(estimates)
    receivers = [
        found.during(estimate.spans, offset)
        for source, estimate, offset in zip(sources, estimates, offsets, strict=True)
        if (found := _receivers(source)) is not None
    ]
    spans = [(a + o, b + o) for e, o in zip(estimates, offsets, strict=True) for a, b in e.spans]
    trajectory = joined_trajectory(estimates)
    try:
        placed = georeference(
            trajectory,
            Receivers.joined(receivers) if receivers else None,
            settings,
            segments=spans,
            reach=max(source.payload.lidar.max_range for source in sources),
            chunks=lambda: in_turn(points, {}),
        )
    except NotEnoughDataError as error:
        return OnEarth(estimates, None, (f"{error}; the map stays in its own frame",))
    if placed is None:
        return OnEarth(estimates)
    if placed.trajectory is not trajectory:
        estimates = _taken_apart(placed.trajectory, estimates)
    return OnEarth(estimates, placed, tuple(placed.warnings))


def _receivers(source: Source) -> Receivers | None:
    with source.part() as part:
        return receivers_of(part, source.georeferencing, source.name)


def _taken_apart(bent: Trajectory, estimates: Sequence[Estimate]) -> list[Estimate]:
    """Return the estimates with what `joined_trajectory` has joined, after it was bent."""
    found, first = [], 0
    for estimate in estimates:
        times = estimate.trajectory.within(estimate.segments).times
        last = first + len(times)
        own = Trajectory(times, bent.positions[first:last], bent.quats_xyzw[first:last])
        # Bent by fixes, it is no longer what the covariances are of.
        found.append(replace(estimate, trajectory=own, covariances=None, short_variances=None))
        first = last
    return found
