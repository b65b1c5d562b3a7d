# SPDX-License-Identifier: MIT OR Apache-2.0
"""Cut a run into places: by time and way where these are known, else by tiles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.closing.places.part import MIN_POINTS, Part
from bentwing.closing.places.place import Place, make_place
from bentwing.closing.places.settings import PlaceSettings
from bentwing.closing.places.tiles import tiled

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory

PAUSE = 2.0  # s without points, after which another place begins


def cut_places(
    points: NDArray[np.float64],
    times: NDArray[np.float64] | None = None,
    trajectory: Trajectory | None = None,
    settings: PlaceSettings | None = None,
) -> list[Part]:
    """Cut points into spatially and temporally contiguous parts.

    Parameters
    ----------
    points : (N, 3) m, gravity-aligned map frame
    times : (N,) s, increasing or not; None for points without times, such as those of a terrestrial scan
    trajectory : of the sensor or close to it, on the same clock; tells how far a place reaches,
        and what was seen through
    settings : default: those for all sensors

    Raises
    ------
    ValueError
        If the arrays do not fit each other or a number is not finite.
    """
    settings = settings or PlaceSettings()
    _check(points, times)
    if times is None:
        return list(tiled(lambda: [points], settings))
    order = np.argsort(times, kind="stable")
    points, times = points[order], times[order]
    if trajectory is not None:
        inside = trajectory.covers(times)
        points, times = points[inside], times[inside]
    cuts = np.searchsorted(times, _cuts(times, trajectory, settings))
    return [
        Part(
            points[first:last],
            (float(times[first]), float(times[last - 1])),
            None if trajectory is None else positions_at(trajectory, times[first:last]),
        )
        for first, last in zip([0, *cuts], [*cuts, len(times)], strict=True)
        if last - first >= MIN_POINTS
    ]


def describe_run(
    points: NDArray[np.float64],
    times: NDArray[np.float64] | None = None,
    trajectory: Trajectory | None = None,
    settings: PlaceSettings | None = None,
) -> list[Place]:
    """Cut points into places and describe each; see `cut_places`."""
    parts = cut_places(points, times, trajectory, settings)
    return describe_parts(parts, settings)


def describe_parts(parts: Iterable[Part], settings: PlaceSettings | None = None) -> list[Place]:
    """Describe each part as a place."""
    return [
        make_place(part.points, span=part.span, origins=part.origins, settings=settings)
        for part in parts
    ]


def _cuts(
    times: NDArray[np.float64], trajectory: Trajectory | None, settings: PlaceSettings
) -> list[float]:
    """Find the times at which another place begins, without that of the first."""
    if not len(times):
        return []
    pauses = np.flatnonzero(np.diff(times) > PAUSE)
    starts = [float(times[0]), *times[pauses + 1].tolist()]
    ends = [*times[pauses].tolist(), float(times[-1])]
    cuts: list[float] = []
    for start, end in zip(starts, ends, strict=True):
        cuts += place_starts(trajectory, start, end, settings)
    return cuts[1:]


def place_starts(
    trajectory: Trajectory | None, start: float, end: float, settings: PlaceSettings
) -> list[float]:
    """Return the times at which the places between two times begin, s."""
    way = _way(trajectory, start, end)
    n = max(1, round((end - start) / settings.duration), int(np.ceil(way / settings.tile)))
    return [start + (end - start) * k / n for k in range(n)]


def positions_at(trajectory: Trajectory, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Positions (N, 3) at increasing times inside; rotations, which cost most, are not needed."""
    return np.column_stack(
        [np.interp(times, trajectory.times, trajectory.positions[:, axis]) for axis in range(3)]
    )


def _way(trajectory: Trajectory | None, start: float, end: float) -> float:
    """Length flown, without the noise of single poses."""
    if trajectory is None or end <= start:
        return 0.0
    at = np.linspace(start, end, max(2, int(end - start) + 1))
    return float(np.linalg.norm(np.diff(positions_at(trajectory, at), axis=0), axis=1).sum())


def _check(points: NDArray[np.float64], times: NDArray[np.float64] | None) -> None:
    if points.ndim != 2 or points.shape[1] != 3:
        msg = f"points: expected shape (N, 3), got {points.shape}"
        raise ValueError(msg)
    if times is not None and times.shape != (len(points),):
        msg = f"times: expected shape ({len(points)},), got {times.shape}"
        raise ValueError(msg)
    wrong = ~np.isfinite(points).all(axis=1)
    wrong |= False if times is None else ~np.isfinite(times)
    if wrong.any():
        msg = f"points and times: row {int(np.argmax(wrong))} is not finite"
        raise ValueError(msg)
