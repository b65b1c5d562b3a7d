# SPDX-License-Identifier: MIT OR Apache-2.0
"""A place: what one stretch of a run saw, described so that another run can find it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.closing.places.cloud import Surfels, surfels_of, voxel_means
from bentwing.closing.places.free_space import FreeSpace, seen_through
from bentwing.closing.places.gestalt import describe
from bentwing.closing.places.keypoints import Keypoints, draw_keypoints
from bentwing.closing.places.settings import PlaceSettings

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Place:
    """Spatially and temporally contiguous points of one run, in its gravity-aligned map.

    Attributes
    ----------
    span : s, first and last time of its points, None where they have no times
    centre : (3,) m, median of its surfels
    keypoints : with upright frames
    descriptors : (K, SIZE) of the keypoints
    surfels : to verify and refine a match by
    free : what was seen through, None where nobody knows from where
    """

    span: tuple[float, float] | None
    centre: NDArray[np.float64]
    keypoints: Keypoints
    descriptors: NDArray[np.float64]
    surfels: Surfels
    free: FreeSpace | None


def make_place(
    points: NDArray[np.float64],
    *,
    span: tuple[float, float] | None = None,
    origins: NDArray[np.float64] | None = None,
    settings: PlaceSettings | None = None,
) -> Place:
    """Describe points as one place.

    Parameters
    ----------
    points : (N, 3) m, finite, gravity-aligned map frame
    span : s, first and last time of the points
    origins : (N, 3) or (1, 3) m, where each of them was measured from, if that is known
    settings : default: those for all sensors
    """
    settings = settings or PlaceSettings()
    step = -(-len(points) // settings.max_points) or 1
    origins = None if origins is None else np.broadcast_to(origins, points.shape)[::step]
    points = points[::step]
    cloud = voxel_means(points, settings.voxel)
    keypoints = draw_keypoints(cloud, settings.n_keypoints)
    surfels = surfels_of(points, settings.surfel, origins)
    centre = np.median(surfels.means, axis=0) if len(surfels) else points.mean(axis=0)
    free = None if origins is None else seen_through(points, origins)
    return Place(span, centre, keypoints, describe(cloud, keypoints), surfels, free)
