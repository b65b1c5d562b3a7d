# SPDX-License-Identifier: MIT OR Apache-2.0
"""The surfels of a map, whatever the time at which its points were measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core
from bentwing.base.moments import Moments, Planes, VoxelMoments
from bentwing.closing.global_registration import STAMP

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.odometry.continuous.settings import SurfelSettings

# A voxel of a map has been seen many times; fewer points than this were seen by chance.
_MIN_POINTS = 12
# The side from which a voxel was seen says where its normal points if all directions of the octant agree
# on it but for this share.
_UNDECIDED = 0.3
_SIDES = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)


@dataclass(frozen=True, slots=True)
class MapSurfels:
    """Surfels of one level.

    Attributes
    ----------
    voxel_size : m
    means : (N, 3) m, map frame
    covariances : (N, 3, 3) m²
    normals : (N, 3) unit, towards where they were seen from; a surfel of which that is not known is
        there twice, with both signs
    """

    voxel_size: float
    means: NDArray[np.float64]
    covariances: NDArray[np.float64]
    normals: NDArray[np.float64]

    def near(self, positions: NDArray[np.float64], reach: float) -> MapSurfels:
        """Return those within the box that reaches `reach` (m) beyond positions (N, 3)."""
        low, high = positions.min(axis=0) - reach, positions.max(axis=0) + reach
        inside = ((self.means >= low) & (self.means <= high)).all(axis=1)
        return MapSurfels(
            self.voxel_size, self.means[inside], self.covariances[inside], self.normals[inside]
        )


class SurfelMaker:
    """Makes the surfels of a cloud that is never in memory as a whole.

    Points are kept apart by the octant of the direction they were seen from, so that the two sides of a
    wall do not become one thick surface.

    Parameters
    ----------
    settings : sizes of the voxels, and what makes a surfel
    """

    def __init__(self, settings: SurfelSettings) -> None:
        self._settings = settings
        self._finest = [VoxelMoments(settings.voxel_size) for _ in range(len(_SIDES) + 1)]

    def add(self, points: NDArray[np.float64], origins: NDArray[np.float64] | None) -> None:
        """Add points (N, 3) m, seen from `origins` (N, 3) m if that is known."""
        if origins is None:
            self._finest[-1].add(points)
            return
        x, y, z = ((origins - points) > 0).T
        octants = 4 * x + 2 * y + 1 * z
        for octant, moments in enumerate(self._finest[:-1]):
            moments.add(points[octants == octant])

    def levels(self) -> list[MapSurfels]:
        """Return the surfels of all levels, finest first."""
        return [
            self._level(self._settings.voxel_size * 2**level)
            for level in range(self._settings.n_levels)
        ]

    def _level(self, size: float) -> MapSurfels:
        parts = []
        for number, finest in enumerate(self._finest):
            found = finest.result()
            if size > self._settings.voxel_size:
                coarse = VoxelMoments(size)
                coarse.add_moments(found)
                found = coarse.result()
            side = _SIDES[number] if number < len(_SIDES) else None
            parts.append(self._surfels(found, size, side))
        means, covariances, normals = (
            np.concatenate(column) for column in zip(*parts, strict=True)
        )
        return MapSurfels(size, means, covariances, normals)

    def _surfels(
        self,
        found: Moments,
        size: float,
        side: NDArray[np.float64] | None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        planes = Planes.of(found.covariances)
        _, middle, most = planes.variances.T
        s = self._settings
        good = (
            (found.counts >= _MIN_POINTS)
            & (planes.planarity > s.min_planarity)
            & (middle > s.min_width_ratio * most)
            & (planes.width > s.min_width * size)
        )
        means, covariances = found.means[good], found.covariances[good]
        normals = planes.normals[good]
        if side is None:
            towards = away = np.ones(len(means), dtype=np.bool_)
        else:
            shares = normals * side
            for_it, against = np.maximum(shares, 0).sum(axis=1), np.maximum(-shares, 0).sum(axis=1)
            towards, away = for_it > _UNDECIDED * against, against > _UNDECIDED * for_it
        return (
            np.concatenate([means[towards], means[away]]),
            np.concatenate([covariances[towards], covariances[away]]),
            np.concatenate([normals[towards], -normals[away]]),
        )


def core_surfels(levels: list[MapSurfels]) -> _core.Surfels:
    """Return the surfels as the core takes those of a map."""
    counts = [len(level.means) for level in levels]
    n = sum(counts)
    return _core.Surfels(
        [level.voxel_size for level in levels],
        np.cumsum([0, *counts]).tolist(),
        np.concatenate([level.means for level in levels]),
        np.concatenate([level.covariances.reshape(-1, 9) for level in levels]),
        np.concatenate([level.normals for level in levels]),
        np.full(n, STAMP),
        np.zeros(n),
        np.ones(n, np.uint32),  # nothing asks how many points a known surfel had
    )
