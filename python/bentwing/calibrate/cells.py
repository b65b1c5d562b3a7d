# SPDX-License-Identifier: MIT OR Apache-2.0
"""Cells of a grid in which both half-scans see the same plane (Fu 2023, section 2.2).

All points of the revolutions are divided into two half-scans by the encoder's angle. Every cell of
a grid has a probability for each half that what the half saw in it is a plane; the cells that are
planes in both are the pairs by which the halves are compared.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.moments import Moments, Planes
from bentwing.base.voxels import by_key, voxel_keys

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

# Edges of the cells, m: what is no pair in the finer ones may be one in the coarser.
SIZES = (0.5, 1.0, 2.0)
# Points of a half in a cell.
MIN_POINTS = 12
# A plane's narrower side, as a standard deviation in cells: less is a single scan line.
MIN_WIDTH = 0.08
# Least probability of a plane in each half.
MIN_PROBABILITY = 0.5
# Cosine of the angle between the planes of a pair.
MIN_COSINE = np.cos(np.radians(15.0))
# Points of which a cell's evidence counts as independent.
EVIDENCE = 10.0
# Across a plane the points scatter by no more than so many times the noise of a range: what is
# wrong with the mount spreads them as well.
SPREAD = 1.5


@dataclass(frozen=True, slots=True)
class Pairs:
    """Points in pairs of planes.

    Attributes
    ----------
    index : (M,) of the points, sorted by cell
    cell : (M,) number of the cell of each, 0 to C - 1
    normals : (C, 3)
    means : (C, 3) m
    probability : (C,) of the less probable plane
    """

    index: NDArray[np.int64]
    cell: NDArray[np.int64]
    normals: Array
    means: Array
    probability: Array

    def __len__(self) -> int:
        return len(self.normals)


def find_pairs(points: Array, halves: NDArray[np.int64], sigma: float) -> Pairs:
    """Find the cells that are planes in both half-scans.

    Parameters
    ----------
    points : (N, 3) m, in the motor's frame
    halves : (N,) 0 or 1
    sigma : m, noise of a range

    References
    ----------
    Fu 2023, section 2.2: two half-scans, a grid, the probability of a plane in each cell.
    """
    left = np.arange(len(points))
    found: list[Pairs] = []
    for size in SIZES:
        pairs = _pairs_of(points, halves, left, size, sigma)
        found.append(pairs)
        left = np.setdiff1d(left, pairs.index, assume_unique=True)
    firsts = np.cumsum([0, *(len(p) for p in found[:-1])])
    return Pairs(
        np.concatenate([p.index for p in found]),
        np.concatenate([p.cell + first for p, first in zip(found, firsts, strict=True)]),
        np.concatenate([p.normals for p in found]),
        np.concatenate([p.means for p in found]),
        np.concatenate([p.probability for p in found]),
    )


def plane_probability(
    planes_across: Array, n: NDArray[np.int64], size: float, sigma: float
) -> Array:
    """Return how probable it is that points with a variance across (C,) are a plane.

    Compared are points that scatter across by the noise of a plane with points that are anywhere
    in the cell, both as likely before: the logarithm of the ratio is
    `n (log(size / (s √(2π))) - λ1 / (2 s²))`.
    """
    s = SPREAD * sigma
    each = np.log(size / (s * np.sqrt(2 * np.pi))) - 0.5 * planes_across / s**2
    evidence = np.clip(each * np.minimum(n, EVIDENCE), -50.0, 50.0)
    return np.asarray(1.0 / (1.0 + np.exp(-evidence)))


def _pairs_of(
    points: Array, halves: NDArray[np.int64], left: NDArray[np.int64], size: float, sigma: float
) -> Pairs:
    order, starts = by_key(voxel_keys(points[left], size))
    index, n_cells = left[order], len(starts)
    cell = np.repeat(np.arange(n_cells), np.diff(np.append(starts, len(order))))
    of = [
        _moments(points[index[halves[index] == h]], cell[halves[index] == h], n_cells)
        for h in (0, 1)
    ]
    planes = [Planes.of(moments.covariances) for moments in of]
    probable = [
        plane_probability(p.variances[:, 0], moments.counts, size, sigma)
        for p, moments in zip(planes, of, strict=True)
    ]
    good = np.abs(np.einsum("ci,ci->c", planes[0].normals, planes[1].normals)) > MIN_COSINE
    for p, moments, probability in zip(planes, of, probable, strict=True):
        good &= (moments.counts >= MIN_POINTS) & (probability > MIN_PROBABILITY)
        good &= p.width > MIN_WIDTH * size
    number = np.cumsum(good) - 1
    taken = good[cell] if n_cells else np.zeros(0, bool)
    both = _moments(points[index[taken]], number[cell[taken]], int(good.sum()))
    return Pairs(
        index[taken],
        number[cell[taken]],
        Planes.of(both.covariances).normals,
        both.means,
        np.minimum(*probable)[good],
    )


def _moments(points: Array, cell: NDArray[np.int64], n_cells: int) -> Moments:
    """Return the moments of the points of each cell, which are sorted by cell; some have none."""
    filled, starts = np.unique(cell, return_index=True)
    found = Moments.of_groups(points, starts)
    whole = Moments(np.zeros(n_cells, np.int64), np.zeros((n_cells, 3)), np.zeros((n_cells, 3, 3)))
    whole.counts[filled], whole.means[filled] = found.counts, found.means
    whole.covariances[filled] = found.covariances
    return whole
