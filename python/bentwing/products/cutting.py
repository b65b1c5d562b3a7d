# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a plane cuts of a finished map, and the walls in it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bentwing.base.errors import InputError, UsageError
from bentwing.base.value import Value
from bentwing.base.voxels import by_key, voxel_keys
from bentwing.products.floor import floor_height, lowest_surfaces
from bentwing.products.lines import fit_lines
from bentwing.products.plane import CutPlane, Slab, cut

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.progress import Progress
    from bentwing.products.finished_map import FinishedMap

_WALL = 0.05  # m, edge of the cells in which the spacing of points is found
_MOST_FITTED = 200_000  # places; a thin slab of a large building has about as many
_MANY = 10_000_000  # points
_CHORD = np.pi / 4  # mean length of a line in a square, by its edge


@dataclass(frozen=True, slots=True, eq=False)
class Section(Value):
    """What a plane cuts of a map.

    Attributes
    ----------
    plane : in the coordinates of the map's file
    thickness : m, of the slab
    points : (K, 2) m, across and up in the plane: means of the points in cells of 1 cm
    counts : (K,) how many each stands for
    lines : (L, 2, 2) m, ends of the walls, longest first
    spacing : m, of the points on walls, the median
    floor : m, its height in the coordinates of the map; None where nobody asked
    """

    plane: CutPlane
    thickness: float
    points: NDArray[np.float64]
    counts: NDArray[np.int64]
    lines: NDArray[np.float64]
    spacing: float
    floor: float | None = None

    def sentence(self) -> str:
        """Say what there is."""
        length = np.linalg.norm(self.lines[:, 1] - self.lines[:, 0], axis=1).sum()
        floor = "" if self.floor is None else f"; floor at height {self.floor:.2f} m"
        return f"{self.counts.sum():,} points, {len(self.lines)} walls of {length:.1f} m{floor}"


class CutMap(NamedTuple):
    """What a plane cuts, before anything is drawn: all coordinates relative to the map's origin.

    Attributes
    ----------
    plane : through the map's origin where it is level
    slab : the points near it
    floor : m, its height; None where nobody asked
    """

    plane: CutPlane
    slab: Slab
    floor: float | None


def cut_map(
    source: FinishedMap, plane: CutPlane | float, thickness: float, progress: Progress
) -> CutMap:
    """Cut a map by a plane of its file's coordinates, or at a height above the floor.

    Raises
    ------
    UsageError
        If a number cannot be used.
    InputError
        If no point lies in the slab.
    """
    if not 0 < thickness < np.inf:
        msg = f"--thickness {thickness} cannot be used; give a length in metres above 0"
        raise UsageError(msg)
    floor = None
    if not isinstance(plane, CutPlane):
        if not np.isfinite(plane):
            msg = f"--plan {plane} cannot be used; give a height above the floor in metres"
            raise UsageError(msg)
        with progress.stage("finding the floor"):
            floor = _floor(source)
        plane = CutPlane.level(floor + plane)
    # From the zero of projected coordinates a plan is too far for the cells of a slab.
    shift = plane.coordinates(source.origin)[0, :2] if plane.is_level else np.zeros(2)
    near = replace(plane, origin=plane.points_at(shift) - source.origin)
    with progress.stage("cutting the map"):
        slab = cut((part.points for part in source.parts()), near, thickness)
    if not len(slab.counts):
        raise InputError(_nothing(source, near, thickness, floor))
    return CutMap(near, slab, floor)


def cut_section(
    source: FinishedMap, plane: CutPlane | float, thickness: float, progress: Progress
) -> Section:
    """Cut a map and fit walls; see `section_of`."""
    found = cut_map(source, plane, thickness, progress)
    places, counts = found.slab.places, found.slab.counts
    if found.plane.is_level:
        zero = found.plane.origin + source.origin
        given = replace(found.plane, origin=zero * [0.0, 0.0, 1.0])
        shift = zero @ np.stack([given.across, given.up], axis=1)
    else:
        given, shift = replace(found.plane, origin=found.plane.origin + source.origin), np.zeros(2)
    with progress.stage("fitting walls"):
        few = found.slab.at_most(_MOST_FITTED)
        lines = fit_lines(few.places, few.counts)
    spacing = wall_spacing(places, counts, thickness)
    return Section(given, thickness, places + shift, counts, lines + shift, spacing, found.floor)


def _floor(source: FinishedMap) -> float:
    way = source.ways[0].positions if source.ways else None
    floor = floor_height(lowest_surfaces(part.points for part in source.parts()), way)
    if floor is None:
        msg = f"{source.path}: no floor is found in it; give the height in the map's own coordinates with --level"
        raise InputError(msg)
    return floor


def _nothing(source: FinishedMap, plane: CutPlane, thickness: float, floor: float | None) -> str:
    """Say that a slab is empty, and where there are points."""
    low, high = np.inf, -np.inf
    for part in source.parts():
        toward = plane.coordinates(part.points)[:, 2]
        low, high = min(low, float(toward.min())), max(high, float(toward.max()))
    where = f"{source.path}: no point lies within {thickness / 2:g} m of the plane"
    if not plane.is_level:
        return (
            f"{where}, or none between its ends; the points are {low:.1f} to {high:.1f} m before it"
        )
    level = float(plane.origin[2])
    if floor is None:
        return f"{where}; heights are from {low + level:.2f} to {high + level:.2f} m"
    low, high = low + level - floor, high + level - floor
    return (
        f"{where}; give --plan between {low:.2f} and {high:.2f} m above the floor, "
        f"which is at height {floor:.2f} m"
    )


def wall_spacing(points: NDArray[np.float64], counts: NDArray[np.int64], thickness: float) -> float:
    """Return the median distance, m, between neighbouring points on upright surfaces in a slab.

    Parameters
    ----------
    points, counts : (K, 2) m and (K,), places and how many points each stands for
    thickness : m, of the slab
    """
    flat = np.column_stack([points, np.zeros(len(points))])
    order, starts = by_key(voxel_keys(flat, _WALL))
    n = np.add.reduceat(counts[order], starts)
    # The median of the points, not of the squares, of which many hold single ones.
    typical = np.repeat(n, n) if n.sum() < _MANY else n
    return float(np.sqrt(_CHORD * _WALL * thickness / np.median(typical)))
