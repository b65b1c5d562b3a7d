# SPDX-License-Identifier: MIT OR Apache-2.0
"""The volume between a surface of a map and a base, with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.ndimage import label

from bentwing.base.errors import InputError, UsageError
from bentwing.base.progress import Progress
from bentwing.base.value import Value
from bentwing.products.area import Area, read_area
from bentwing.products.base_surface import Base, ground_around, plane_around
from bentwing.products.finished_map import open_map_of
from bentwing.products.floor import EDGE
from bentwing.products.ground import Terrain, carried_on
from bentwing.products.surface import lowest_terrain, measured_surface, require_cell
from bentwing.products.terrain import find_terrain

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from bentwing.products.finished_map import FinishedMap

    Array = NDArray[np.float64]

# m below and above what is known of the surface so far; a first guess is too low where it is steep
_BANDS = ((0.3, 0.6), (0.3, 0.3))
_COVERED = 0.99  # share of the area that has to be known for the result to go without a warning


@dataclass(frozen=True, slots=True, eq=False)
class Volume(Value):
    """A volume over an area.

    Attributes
    ----------
    volume : m³, above the base less below it
    above, below : m³, both positive
    sigma : m³, standard uncertainty; of `volume`
    parts : m³, what makes it: `points`, `gaps`, `map` and `base`, which add up as squares
    area : m²
    measured, interpolated, unknown : shares of the area; what is unknown adds nothing to the volume
    is_stated : whether the runs state their accuracy; without it `map` is zero
    """

    volume: float
    above: float
    below: float
    sigma: float
    parts: Mapping[str, float]
    area: float
    measured: float
    interpolated: float
    unknown: float
    is_stated: bool

    def sentence(self) -> str:
        """Say it, with what 95 % of the errors are below."""
        said = (
            f"{self.volume:.3f} m³ ± {2 * self.sigma:.3f} m³ (95 %) over {self.area:.2f} m²: "
            f"{self.above:.3f} m³ above the base, {self.below:.3f} m³ below it; "
            f"{100 * self.measured:.1f} % of the area measured, {100 * self.interpolated:.1f} % interpolated"
        )
        if self.unknown > 1 - _COVERED:
            said += (
                f"; {100 * self.unknown:.1f} % was not seen and is left out, so that the volume is "
                "incomplete: fly there again, or give a smaller area"
            )
        if not self.is_stated:
            said += (
                "; the map states no accuracy, so that only the scatter of its points is counted"
            )
        return said


def measure_volume(
    run: Path | str,
    area: Path | str | Area,
    *,
    base: Path | str = "plane",
    cell: float = 0.1,
    progress: Progress | None = None,
) -> Volume:
    """Measure the volume between a surface of a finished run and a base.

    Parameters
    ----------
    run : folder that `map`, `merge` or `localize` has written
    area : polygon in the coordinates of the map, or a GeoJSON file with one
    base : `plane`, fitted to the surface within a metre around the area; `dtm`, the ground around,
        carried on below it; or the folder of another run in the same coordinates
    cell : m, edge of a cell

    Raises
    ------
    UsageError
        If a folder holds no complete run, the runs have different coordinates, or a number cannot be used.
    InputError
        If a file cannot be used, or nothing of the surface is in the area.
    """
    progress = progress or Progress()
    require_cell(cell)
    source = open_map_of(run)
    polygon = area if isinstance(area, Area) else read_area(Path(area))
    local = polygon.moved(-source.origin[:2])
    with progress.stage("measuring the surface"):
        top = surface_of(source, cell)
    with progress.stage("finding the base"):
        below, records = _base(source, str(base), top, local, progress)
    stated = [_stated(record) for record in (source.run.record, *records)]
    sigma = float(np.sqrt(sum((s or 0.0) ** 2 for s in stated)))
    found = volume_between(top, below, local, sigma, is_stated=None not in stated)
    if found.measured == 0.0:
        msg = f"{source.path}: no surface and base are known in the area of {found.area:.1f} m²; are its coordinates those of the map?"
        raise InputError(msg)
    return found


def surface_of(source: FinishedMap, cell: float) -> Terrain:
    """Measure the lowest surface of a map: of a pile or a floor, and not what is above."""
    lowest = lowest_terrain(source)
    filled = carried_on(lowest.heights, EDGE)
    guess = Terrain(filled, lowest.measured, lowest.sigmas, lowest.counts, EDGE, lowest.origin)
    return measured_surface(source, guess, cell, _BANDS)


def volume_between(
    top: Terrain, base: Base, area: Area, map_sigma: float = 0.0, *, is_stated: bool = True
) -> Volume:
    """Sum the differences of two surfaces over an area.

    Parameters
    ----------
    top : the surface
    base : its heights in the cells of `top`
    area : in the same coordinates
    map_sigma : m, of the distance of the surfaces, taken as the same all over the area

    References
    ----------
    JCGM 100:2008, eq. (10) and (13): independent parts add up as squares, errors that are common to
    cells as sums.
    """
    shares = area.shares(top.origin, top.heights.shape, top.cell)  # m²
    covered = shares > 0
    known = covered & np.isfinite(top.heights) & np.isfinite(base.heights)
    weights = np.where(known, shares, 0.0)
    difference = np.where(known, top.heights - base.heights, 0.0)
    measured = known & top.measured
    n = np.maximum(top.counts, 1)
    points = np.where(measured, weights * np.nan_to_num(top.sigmas) / np.sqrt(n), 0.0)
    parts = {
        "points": float(np.sqrt((points**2).sum())),
        "gaps": _of_gaps(top, known & ~top.measured, weights),
        "map": map_sigma * float(weights.sum()),
        "base": base.sigma(top.centres(), weights),
    }
    cut = weights * difference
    total = area.size
    return Volume(
        volume=float(cut.sum()),
        above=float(cut[cut > 0].sum()),
        below=float(-cut[cut < 0].sum()),
        sigma=float(np.sqrt(sum(part**2 for part in parts.values()))),
        parts=parts,
        area=total,
        measured=float(weights[measured].sum()) / total,
        interpolated=float(weights[known & ~measured].sum()) / total,
        unknown=max(1.0 - float(weights.sum()) / total, 0.0),
        is_stated=is_stated,
    )


def _of_gaps(top: Terrain, gaps: NDArray[np.bool_], weights: Array) -> float:
    """Return the uncertainty, m³, of gaps: by how much the surface bends over as much, for all of a gap."""
    numbers, count = label(gaps)
    cells = np.bincount(numbers.ravel(), minlength=count + 1)[1:]
    areas = np.bincount(numbers.ravel(), weights.ravel(), minlength=count + 1)[1:]
    reach = np.maximum(np.ceil(np.sqrt(cells) / 2), 1).astype(int)
    bends = {lag: _bend(top, lag) for lag in np.unique(reach).tolist()}
    return float(
        np.sqrt(
            sum(
                (area * bends[lag]) ** 2
                for area, lag in zip(areas.tolist(), reach.tolist(), strict=True)
            )
        )
    )


def _bend(top: Terrain, lag: int) -> float:
    """Return by how much, m, measured heights usually differ from the mean of those so many cells beside."""
    heights = np.where(top.measured, top.heights, np.nan)
    bends = [
        np.abs(h[lag:-lag] - 0.5 * (h[: -2 * lag] + h[2 * lag :])).ravel()
        for h in (heights, heights.T)
        if len(h) > 2 * lag
    ]
    found = np.concatenate(bends) if bends else np.empty(0)
    found = found[np.isfinite(found)]
    return float(np.sqrt((found**2).mean())) if len(found) else float(np.nanstd(heights))


def _base(
    source: FinishedMap, base: str, top: Terrain, area: Area, progress: Progress
) -> tuple[Base, list[Mapping[str, Any]]]:
    """Return the base, and the records of further runs that it is made of."""
    if base == "plane":
        return plane_around(top, area), []
    if base == "dtm":
        return ground_around(find_terrain(source, top.cell, progress), top, area), []
    other = open_map_of(base)
    if other.epsg != source.epsg:
        names = [f"EPSG:{s.epsg}" if s.epsg else "a frame of its own" for s in (source, other)]
        msg = f"{source.run.folder} is in {names[0]}, {other.run.folder} in {names[1]}; give two runs in the same coordinates"
        raise UsageError(msg)
    surface = surface_of(other, top.cell)
    shift = (source.origin - other.origin)[:2]
    heights = surface.height_at(top.centres().reshape(-1, 2) + shift).reshape(top.heights.shape)
    return Base(heights), [other.run.record]


def _stated(record: Mapping[str, Any]) -> float | None:
    """Return by how much, m, the surfaces of a map scatter, as its run says."""
    expected = record.get("expected_accuracy") or {}
    value = expected.get("map_thickness") if isinstance(expected, dict) else None
    return float(value) if isinstance(value, (int, float)) else None
