# SPDX-License-Identifier: MIT OR Apache-2.0
"""How well a map agrees with itself where it was measured more than once."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.moments import Moments, Planes
from bentwing.base.voxels import by_key, voxel_keys
from bentwing.evaluate.robust import MAD_TO_STD
from bentwing.evaluate.statistics import SAMPLES

if TYPE_CHECKING:
    from numpy.typing import NDArray

EDGE = 0.5  # m, of the patches
APART = 10.0  # s without any point of a patch, which divide two visits
_FEWEST = 20  # points of a visit on a patch
_FLATTEST = 0.1  # of the edge
_NARROWEST = 0.15
_SAME_SIDE = 0.95  # cosine between the normals of two visits: the same wall, not one's other edge
_COMMON = 0.5  # edges that the middles of two visits may lie apart


@dataclass(frozen=True, slots=True)
class Revisits:
    """Offsets, along the normal, between flat patches as two visits have measured them.

    Attributes
    ----------
    std : m, robust, of the signed offsets
    median, p95 : m, of their sizes
    n_patches : pairs of successive visits
    offsets, intervals : (K,) m, and s between the middles of the visits
    middles : (K,) s, of the later visits
    """

    std: float
    median: float
    p95: float
    n_patches: int
    offsets: NDArray[np.float64] = field(metadata=SAMPLES)
    intervals: NDArray[np.float64] = field(metadata=SAMPLES)
    middles: NDArray[np.float64] = field(metadata=SAMPLES)


def revisit_consistency(
    points: NDArray[np.float64], times: NDArray[np.float64], *, edge: float = EDGE
) -> Revisits | None:
    """Compare patches of the map between visits; None where no patch was visited twice.

    Parameters
    ----------
    points, times : (N, 3) m and (N,) s
    edge : m, of the cubes that hold one patch
    """
    keys = voxel_keys(points, edge)
    order, _ = by_key(keys, times)
    keys, points, times = keys[order], points[order], times[order]
    is_new_cube = np.append(True, keys[1:] != keys[:-1])
    is_new = is_new_cube | np.append(True, np.diff(times) > APART)
    starts = np.flatnonzero(is_new)
    visits = Moments.of_groups(points, starts)
    planes = Planes.of(visits.covariances)
    means, normals = visits.means, planes.normals
    flat = (planes.thickness < _FLATTEST * edge) & (planes.width > _NARROWEST * edge)
    usable = flat & (visits.counts >= _FEWEST)
    # a visit and the one before it in the same cube
    later = np.flatnonzero(~is_new_cube[starts])
    later = later[usable[later] & usable[later - 1]]
    cosines = np.einsum("ni,ni->n", normals[later], normals[later - 1])
    between = means[later] - means[later - 1]
    normal = normals[later] + np.sign(cosines)[:, None] * normals[later - 1]
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    offsets = np.einsum("ni,ni->n", between, normal)
    same = (np.abs(cosines) > _SAME_SIDE) & (np.linalg.norm(between, axis=1) < _COMMON * edge)
    if not same.any():
        return None
    middles = np.add.reduceat(times, starts) / visits.counts
    offsets, intervals = offsets[same], (middles[later] - middles[later - 1])[same]
    lengths = np.abs(offsets)
    return Revisits(
        MAD_TO_STD * float(np.median(lengths)),
        float(np.median(lengths)),
        float(np.percentile(lengths, 95)),
        len(offsets),
        offsets,
        intervals,
        middles[later][same],
    )
