# SPDX-License-Identifier: MIT OR Apache-2.0
"""How dense a cloud is: the distance of each point to its nearest neighbour."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from bentwing.base.search_tree import nearest
from bentwing.base.voxels import column_keys
from bentwing.evaluate.statistics import SAMPLES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.evaluate.clouds import Cloud

_BLOCK = 2.0  # m, edge of the columns that are looked at
_MARGIN = 0.25  # m; nearer to a face of its column a point's neighbour may lie in the next one
_MOST = 2_000_000  # points that are looked at, about


@dataclass(frozen=True, slots=True)
class PointSpacing:
    """Distribution of the distances to the nearest neighbour, m.

    Attributes
    ----------
    median, mean, p5, p95 : m
    n_points : whose neighbours were looked for
    distances : (N,) m
    """

    median: float
    mean: float
    p5: float
    p95: float
    n_points: int
    distances: NDArray[np.float32] = field(metadata=SAMPLES)


def point_spacing(cloud: Cloud) -> PointSpacing | None:
    """Measure the spacing of all points, or of those in columns drawn at random.

    Returns
    -------
    None where there are fewer than two points.

    References
    ----------
    Kaul 2015, figure 23.
    """
    points, is_whole = _in_some_columns(cloud)
    if len(points) < 2:
        return None
    asked = points if is_whole else points[_inner(points)]
    distances, _ = nearest(cKDTree(points), asked, [1, 2])
    found = distances[:, 1]
    if not len(found):
        return None
    p5, median, p95 = np.percentile(found, [5, 50, 95]).tolist()
    return PointSpacing(median, float(found.mean()), p5, p95, len(found), found.astype(np.float32))


def _in_some_columns(cloud: Cloud) -> tuple[NDArray[np.float64], bool]:
    """All points of as many columns as memory allows, and whether these are all of the cloud."""
    if cloud.n_points <= _MOST:
        return np.concatenate(list(cloud.parts())), True
    # a share of the columns, not columns up to a number of points, which would avoid dense ones
    columns = np.unique(column_keys(cloud.sample.points, _BLOCK))
    n_kept = max(1, round(len(columns) * _MOST / cloud.n_points))
    kept = np.random.default_rng(0).choice(columns, n_kept, replace=False)
    return np.concatenate(
        [part[np.isin(column_keys(part, _BLOCK), kept)] for part in cloud.parts()]
    ), False


def _inner(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    inside = np.abs(np.mod(points[:, :2], _BLOCK) - _BLOCK / 2) < _BLOCK / 2 - _MARGIN
    found: NDArray[np.bool_] = np.all(inside, axis=1)
    return found
