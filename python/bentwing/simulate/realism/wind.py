# SPDX-License-Identifier: MIT OR Apache-2.0
"""Foliage that sways in the wind."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing._core import Scene
from bentwing.simulate.ranging import incidence
from bentwing.simulate.scenes.world import face_normals

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.beams import Beams
    from bentwing.simulate.scenes.mesh import Mesh

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Wind:
    """Crowns and bushes that sway as one; stems stand.

    Attributes
    ----------
    frequencies, phases : (2, 2) Hz, rad; of two tones, for x and y
    sways : (2, 2) m
    """

    frequencies: Array
    phases: Array
    sways: Array
    foliage: Scene = field(repr=False)
    normals: Array = field(repr=False)
    max_range: float = field(repr=False)

    def shifts(self, times: Array) -> Array:
        """Displacement (N, 3), m, at `times`."""
        tones = np.sin(2 * np.pi * self.frequencies * times[:, None, None] + self.phases)
        level = (self.sways * tones).sum(axis=1)
        return np.column_stack([level, np.zeros(len(times))])

    def cast(self, beams: Beams, origins: Array, directions: Array) -> tuple[Array, Array]:
        """Casts in the frame of the foliage, which does not turn."""
        still = origins - self.shifts(beams.times.ravel())
        ranges, faces = self.foliage.cast(still, np.ascontiguousarray(directions), self.max_range)
        return ranges, incidence(self.normals, faces, directions)


def draw_wind(rng: np.random.Generator, level: float, foliage: Mesh, max_range: float) -> Wind:
    """Draw sways of about 3 cm times the level at 0.2 to 1 Hz."""
    return Wind(
        rng.uniform(0.2, 1.0, (2, 2)),
        rng.uniform(0.0, 2 * np.pi, (2, 2)),
        rng.uniform(0.7, 1.3, (2, 2)) * 0.03 * level / np.sqrt(2),
        Scene(foliage.vertices, foliage.triangles),
        face_normals(foliage),
        max_range,
    )
