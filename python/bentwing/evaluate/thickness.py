# SPDX-License-Identifier: MIT OR Apache-2.0
"""How thick flat surfaces are in a map, each seen in one visit, without any reference."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.moments import Moments, Planes
from bentwing.base.voxels import by_key, centres_of, unpack, voxel_keys
from bentwing.evaluate.revisits import APART
from bentwing.evaluate.statistics import SAMPLES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

MOST_PATCHES = 2000
FEWEST_POINTS = 50  # in a patch
# Small patches hold one surface each; larger ones are needed where points are few. m
EDGES = (0.2, 0.3, 0.5, 0.7, 1.0)
_SHARE = 0.5  # of the points that are in patches of enough points
_CLIP = 3.0  # standard deviations
_CLIPPED_STD = 0.98658  # what is left of a normal distribution's by clipping at 3
_PASSES = 6
_FREE = 3  # numbers that a plane takes from the points
_FLATTEST = 0.15  # of the edge: thicker is no wall but a corner or a bush
_USUAL = (
    0.06  # of the edge: where the median is thicker, larger patches are needed to see all of it
)
_NARROWEST = 0.15  # of the edge: less spread sideways is a sliver of a wall
_LEAST_KEPT = 0.8  # share of a patch's points on its plane
# Share of the variance that two sheets explain: 0.64 of a normal distribution and 0.75 of a uniform one.
# Two equal sheets reach it at 3.5 standard deviations from each other.
_TWO_SHEETS = 0.75
_BENT = 0.2  # share of the variance that a bend explains, beyond what chance does
_OF_BEND = 6  # numbers that a bend has


@dataclass(frozen=True, slots=True)
class Thickness:
    """Thickness of the flat surfaces of a map, one standard deviation, m.

    Attributes
    ----------
    median, p25, p75, p90 : of the patches
    edge : m, of the patches
    centres : (K, 3) m, of the patches
    stds : (K,) m
    is_later : (K,) whether the patch had been seen in a visit before
    """

    median: float
    p25: float
    p75: float
    p90: float
    edge: float
    centres: Array = field(metadata=SAMPLES)
    stds: Array = field(metadata=SAMPLES)
    is_later: NDArray[np.bool_] = field(metadata=SAMPLES)


@dataclass(frozen=True, slots=True)
class _Patches:
    """Points of patches, patch by patch: relative to the cubes' centres, and the patch of each."""

    edge: float
    local: Array
    starts: NDArray[np.intp]
    centres: Array
    is_later: NDArray[np.bool_]

    @property
    def counts(self) -> NDArray[np.intp]:
        return np.diff(np.append(self.starts, len(self.local)))

    @property
    def owner(self) -> NDArray[np.intp]:
        return np.repeat(np.arange(len(self.starts)), self.counts)


def wall_thickness(points: Array, times: Array | None = None, *, seed: int = 0) -> Thickness:
    """Measure how thick flat surfaces are in a map, without any reference.

    The map is cut into cubes, as small as the density of the points allows, and the points of a cube
    into visits, which are ten seconds apart: each is a patch. In up to `MOST_PATCHES` of them, drawn at
    random, a plane is fitted, and points off it are clipped at three standard deviations. Patches that
    are bent, such as corners, and those of two sheets, such as both faces of a partition, are no flat
    surface and do not count. How far two visits lie apart tells `revisit_consistency`.

    Parameters
    ----------
    points : (N, 3) float64, m
    times : (N,) s, of the points; without them all are one visit, in which a wall that was mapped twice
        with an offset is thicker
    seed : of the draw

    Raises
    ------
    ValueError
        If the map has no flat patch.
    """
    for edge in EDGES:
        patches, share = _patches(points, times, edge, seed)
        is_last = edge == EDGES[-1]
        if share < _SHARE and not is_last:
            continue
        stds, flat = _thicknesses(patches, is_timed=times is not None)
        if is_last or (len(stds) and np.median(stds) <= _USUAL * edge):
            break
    if not len(stds):
        msg = f"points: no flat patch of {edge} m with {FEWEST_POINTS} points among {len(points)} points"
        raise ValueError(msg)
    p25, median, p75, p90 = np.percentile(stds, [25, 50, 75, 90]).tolist()
    found = patches.centres[flat], stds, patches.is_later[flat]
    return Thickness(median, p25, p75, p90, edge, *found)


def _thicknesses(patches: _Patches, *, is_timed: bool) -> tuple[Array, NDArray[np.bool_]]:
    """Return the standard deviations (K,) m of the flat patches, and which of all are flat."""
    if not len(patches.starts):
        return np.empty(0), np.empty(0, np.bool_)
    offsets, inside, planes = _clipped(patches)
    kept = np.add.reduceat(inside, patches.starts, dtype=np.int64)
    variances = planes.variances[:, 0]
    flat = planes.thickness < _FLATTEST * patches.edge
    flat &= planes.width > _NARROWEST * patches.edge
    flat &= kept > _LEAST_KEPT * patches.counts
    total = np.maximum(kept * variances, 1e-18)
    flat &= _bend(patches, offsets, inside) / total < _BENT + _OF_BEND / kept
    if is_timed:  # without times nobody can tell a doubled wall from a partition
        flat &= _sheets(patches, offsets, inside) / total < _TWO_SHEETS
    free = kept[flat] / np.maximum(kept[flat] - _FREE, 1)
    return np.sqrt(variances[flat] * free) / _CLIPPED_STD, flat


def _patches(points: Array, times: Array | None, edge: float, seed: int) -> tuple[_Patches, float]:
    """Draw patches; return the share of all points that is in patches of enough points, too."""
    keys = voxel_keys(points, edge)
    order, _ = by_key(keys, times)
    keys = keys[order]
    is_new_cube = np.append(True, keys[1:] != keys[:-1])[: len(keys)]
    is_new = is_new_cube.copy()
    if times is not None:
        is_new[1:] |= np.diff(times[order]) > APART
    starts = np.flatnonzero(is_new)
    counts = np.diff(np.append(starts, len(keys)))
    usable = np.flatnonzero(counts >= FEWEST_POINTS)
    share = float(counts[usable].sum() / max(len(keys), 1))
    if len(usable) > MOST_PATCHES:
        usable = np.sort(np.random.default_rng(seed).choice(usable, MOST_PATCHES, replace=False))
    sizes, firsts = counts[usable], np.cumsum(counts[usable]) - counts[usable]
    rows = np.arange(int(sizes.sum())) + np.repeat(starts[usable] - firsts, sizes)
    centres = centres_of(unpack(keys[starts[usable]]), edge)
    local = points[order[rows]] - np.repeat(centres, sizes, axis=0)
    return _Patches(edge, local, firsts, centres, ~is_new_cube[starts[usable]]), share


def _clipped(patches: _Patches) -> tuple[Array, NDArray[np.bool_], Planes]:
    """Fit planes; return the points' distances from them, which are not clipped, and the planes."""
    local, owner = patches.local, patches.owner
    inside = np.ones(len(local), dtype=np.bool_)
    for _ in range(_PASSES):
        # no patch loses all of its points: at most one in nine is beyond three standard deviations
        firsts = np.searchsorted(np.flatnonzero(inside), patches.starts)
        found = Moments.of_groups(local[inside], firsts)
        planes = Planes.of(found.covariances)
        offsets = np.einsum("ni,ni->n", local - found.means[owner], planes.normals[owner])
        inside = np.abs(offsets) <= _CLIP * planes.thickness[owner] + 1e-12
    return offsets, inside, planes


def _bend(patches: _Patches, offsets: Array, inside: NDArray[np.bool_]) -> Array:
    """Return the sum of squares (K,) m² that a surface of second order explains of each patch."""
    planes = Planes.of(Moments.of_groups(patches.local, patches.starts).covariances)
    across = np.argmax(np.abs(planes.normals), axis=1)
    # The two axes of the cube that are least across the patch are coordinates in it.
    axes = np.array([[1, 2], [0, 2], [0, 1]])[across][patches.owner]
    rows = np.arange(len(offsets))
    u, v = (patches.local[rows, axes[:, i]] / patches.edge for i in (0, 1))
    terms = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v]) * inside
    left = np.empty((len(patches.starts), _OF_BEND, _OF_BEND))
    for i, j in zip(*np.triu_indices(_OF_BEND), strict=True):
        left[:, i, j] = left[:, j, i] = np.add.reduceat(terms[i] * terms[j], patches.starts)
    right = np.add.reduceat(terms * offsets, patches.starts, axis=1).T
    solved = np.linalg.solve(left + 1e-9 * np.eye(_OF_BEND), right[..., None])[..., 0]
    explained: Array = np.einsum("ki,ki->k", solved, right)
    return explained


def _sheets(patches: _Patches, offsets: Array, inside: NDArray[np.bool_]) -> Array:
    """Return the sum of squares (K,) m² that the best two sheets explain of each patch."""
    owner, starts = patches.owner, patches.starts
    order = np.lexsort((offsets, owner))
    weights = inside[order].astype(np.float64)
    values = weights * offsets[order]
    n, total = (np.add.reduceat(x, starts)[owner] for x in (weights, values))
    below, sums = (
        np.cumsum(x) - np.append(0.0, np.cumsum(x))[starts][owner] for x in (weights, values)
    )
    above = n - below
    is_split = (below > 0.5) & (above > 0.5)
    between = (
        sums**2 / np.maximum(below, 1.0)
        + (total - sums) ** 2 / np.maximum(above, 1.0)
        - total**2 / np.maximum(n, 1.0)
    )
    best: Array = np.maximum.reduceat(np.where(is_split, between, 0.0), starts)
    return best
