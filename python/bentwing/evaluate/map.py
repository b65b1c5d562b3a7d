# SPDX-License-Identifier: MIT OR Apache-2.0
"""Quality of a map: against the true surface, and without any reference."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.moments import Moments, Planes
from bentwing.base.voxels import centres_of, unpack, voxel_keys
from bentwing.evaluate.robust import MAD_TO_STD
from bentwing.evaluate.statistics import SAMPLES

if TYPE_CHECKING:
    from numpy.typing import NDArray

MOST_PATCHES = 1000
FEWEST_POINTS = 100  # in a patch
_CLIP = 3.0  # standard deviations
_CLIPPED_STD = 0.98658  # what is left of a normal distribution's by clipping at 3
_PASSES = 6
_FLATTEST = 0.1  # of the patch's edge: thicker is no wall but a corner or a bush
_NARROWEST = 0.15  # of the edge: less spread sideways is a sliver of a wall
_LEAST_KEPT = 0.8  # share of a patch's points on its plane


@dataclass(frozen=True, slots=True)
class SurfaceError:
    """Distances of map points from the true surface.

    Attributes
    ----------
    std : m, from the median absolute deviation
    bias : m, median signed distance
    rms : m, of the points that are not excluded
    n_points, n_excluded : excluded are those beyond the limit: mixed pixels, moving things
    best_ratio : std over that of the best possible map, None without one
    """

    std: float
    bias: float
    rms: float
    n_points: int
    n_excluded: int
    best_ratio: float | None = None


@dataclass(frozen=True, slots=True)
class Thickness:
    """Thickness of the flat surfaces of a map, one standard deviation, m.

    Attributes
    ----------
    median, p25, p75, p90 : of the patches
    centres : (K, 3) m, of the patches
    stds : (K,) m
    """

    median: float
    p25: float
    p75: float
    p90: float
    centres: NDArray[np.float64] = field(metadata=SAMPLES)
    stds: NDArray[np.float64] = field(metadata=SAMPLES)


def surface_error(
    distances: NDArray[np.float64],
    *,
    limit: float = 0.2,
    best: NDArray[np.float64] | None = None,
) -> SurfaceError:
    """Summarize the distances of a map from the true surface.

    Parameters
    ----------
    distances : (N,) m, signed
    limit : m, points farther away are on no surface and are counted, not measured
    best : (M,) m, the same for the map made with the true trajectory and calibration

    Raises
    ------
    ValueError
        If no point is within the limit.
    """
    kept = distances[np.abs(distances) <= limit]
    if not len(kept):
        msg = f"distances: none of {len(distances)} is within the limit of {limit} m"
        raise ValueError(msg)
    bias = float(np.median(kept))
    std = MAD_TO_STD * float(np.median(np.abs(kept - bias)))
    ratio = None if best is None else std / surface_error(best, limit=limit).std
    rms = float(np.sqrt(np.mean(kept**2)))
    return SurfaceError(std, bias, rms, len(distances), len(distances) - len(kept), ratio)


def wall_thickness(points: NDArray[np.float64], *, patch: float = 1.0, seed: int = 0) -> Thickness:
    """Measure how thick flat surfaces are in a map, without any reference.

    The map is cut into cubes of `patch` metres; in up to `MOST_PATCHES` of them, drawn at random,
    a plane is fitted, points off it are clipped at three standard deviations, and what is flat
    and wide enough counts. A wall that was mapped twice with an offset gets thicker.

    Parameters
    ----------
    points : (N, 3) float64, m
    patch : m, edge of the cubes
    seed : of the draw

    Raises
    ------
    ValueError
        If the map has no flat patch.
    """
    local, starts, centres = _patches(points, patch, seed)
    inside = np.ones(len(local), dtype=np.bool_)
    counts = np.diff(np.append(starts, len(local)))
    for _ in range(_PASSES):
        # no patch loses all of its points: at most one in nine is beyond three standard deviations
        found = Moments.of_groups(local[inside], np.searchsorted(np.flatnonzero(inside), starts))
        planes = Planes.of(found.covariances)
        offsets = np.einsum(
            "ni,ni->n",
            local - np.repeat(found.means, counts, 0),
            np.repeat(planes.normals, counts, 0),
        )
        std = planes.thickness
        inside = np.abs(offsets) <= np.repeat(_CLIP * std, counts) + 1e-12
    kept = np.add.reduceat(inside, starts, dtype=np.int64)
    flat = (std < _FLATTEST * patch) & (planes.width > _NARROWEST * patch)
    flat &= kept > _LEAST_KEPT * counts
    if not flat.any():
        msg = f"points: no flat patch of {patch} m with {FEWEST_POINTS} points among {len(points)} points"
        raise ValueError(msg)
    stds = std[flat] / _CLIPPED_STD
    p25, median, p75, p90 = np.percentile(stds, [25, 50, 75, 90]).tolist()
    return Thickness(median, p25, p75, p90, centres[flat], stds)


def _patches(
    points: NDArray[np.float64], patch: float, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Points of the drawn cubes relative to the cubes' centres, their starts, and the centres."""
    keys = voxel_keys(points, patch)
    cubes, counts = np.unique(keys, return_counts=True)
    cubes = cubes[counts >= FEWEST_POINTS]
    if len(cubes) > MOST_PATCHES:
        cubes = np.sort(np.random.default_rng(seed).choice(cubes, MOST_PATCHES, replace=False))
    chosen = np.flatnonzero(np.isin(keys, cubes))
    chosen = chosen[np.argsort(keys[chosen], kind="stable")]
    starts = np.searchsorted(keys[chosen], cubes)
    centres = centres_of(unpack(cubes), patch)
    sizes = np.diff(np.append(starts, len(chosen)))
    return points[chosen] - np.repeat(centres, sizes, axis=0), starts, centres
