# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which disc of a reference a point belongs to, and how far along its normal the point is."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from bentwing.base.search_tree import nearest

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.evaluate.surfels import Surfels

_NEIGHBOURS = (
    8  # discs around a point; where two walls meet the nearest centre may be the wrong one
)
_BESIDE = 0.5  # edges beyond the rim of a disc from which on a point is not on it
# A disc is chosen by across² + (0.3 sideways)²: of two walls the nearer one, but of the discs of one
# wall the nearest centre, not the one that by its noise comes nearest to the point.
_SIDEWAYS = 0.3
_AT_ONCE = 200_000  # points
_ROUGH = 5.0  # edges; with a limit beyond, the nearest centre is near enough


class Surface:
    """Discs in a search tree.

    Parameters
    ----------
    surfels : of the reference
    tree : of their centres, if there is one already
    """

    def __init__(self, surfels: Surfels, tree: cKDTree | None = None) -> None:
        self.surfels = surfels
        self._tree = cKDTree(surfels.centres) if tree is None else tree

    def facing(self, viewpoints: NDArray[np.float64]) -> Surface:
        """Return the same with all normals turned to the nearest of viewpoints `(M, 3)`."""
        _, closest = nearest(cKDTree(viewpoints), self.surfels.centres, [1])
        toward = viewpoints[closest[:, 0]] - self.surfels.centres
        away = np.einsum("ni,ni->n", toward, self.surfels.normals) < 0
        normals = np.where(away[:, None], -self.surfels.normals, self.surfels.normals)
        return Surface(replace(self.surfels, normals=normals), self._tree)

    def distances(
        self, points: NDArray[np.float64], limit: float
    ) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        """Find the nearest disc of each point.

        Returns
        -------
        distances : (N,) m along the normal, positive behind the surface, that is, on the side its
            normal does not point to; not a number where no disc is within `limit`
        discs : (N,) index of the disc, -1 without one
        """
        parts = [
            self._distances(points[i : i + _AT_ONCE], limit)
            for i in range(0, len(points), _AT_ONCE)
        ]
        if not parts:
            return np.empty(0), np.empty(0, np.intp)
        return np.concatenate([d for d, _ in parts]), np.concatenate([i for _, i in parts])

    def within(self, points: NDArray[np.float64], distance: float) -> NDArray[np.intp]:
        """Return the indices of the discs whose centre is within a distance of any of the points."""
        count = min(_NEIGHBOURS, len(self.surfels))
        _, found = nearest(self._tree, points, range(1, count + 1), distance)
        return np.unique(found[found < len(self.surfels)])

    def _distances(
        self, points: NDArray[np.float64], limit: float
    ) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        surfels = self.surfels
        is_rough = limit > _ROUGH * surfels.edge
        count = 1 if is_rough else min(_NEIGHBOURS, len(surfels))
        reach = float(np.hypot(limit, surfels.radius + _BESIDE * surfels.edge))
        lengths, found = nearest(self._tree, points, range(1, count + 1), reach)
        exists = np.isfinite(lengths)
        discs = np.where(exists, found, 0)
        across = np.einsum(
            "nki,nki->nk", surfels.centres[discs] - points[:, None], surfels.normals[discs]
        )
        sideways = np.sqrt(np.maximum(np.where(exists, lengths, np.inf) ** 2 - across**2, 0.0))
        gaps = np.where(exists, np.hypot(_SIDEWAYS * np.minimum(sideways, reach), across), np.inf)
        best = np.argmin(gaps, axis=1)
        rows = np.arange(len(points))
        distances, disc = across[rows, best], discs[rows, best]
        off = sideways[rows, best] > surfels.radius + _BESIDE * surfels.edge
        off |= ~exists[rows, best] | (np.abs(distances) > limit)
        return np.where(off, np.nan, distances), np.where(off, -1, disc)
