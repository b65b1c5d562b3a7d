# SPDX-License-Identifier: MIT OR Apache-2.0
"""Panes of glass: mostly looked through, sometimes a mirror, seen only from the front."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.ranging import incidence

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing._core import Scene
    from bentwing.simulate.beams import Beams

    Array = NDArray[np.float64]

FRONT = float(np.cos(np.radians(10.0)))
"""Cosine of incidence beyond which a pane itself is seen."""
BEHIND = 1e-3
"""m, from where a ray goes on behind or before the pane."""


@dataclass(frozen=True, slots=True)
class Glass:
    """Surfaces of which some are panes.

    Attributes
    ----------
    passing, mirrored : shares of the shots that go through a pane, and that are reflected by it
    clear : share of the panes that are of clear glass
    scene, normals : all surfaces, and unit normals (T, 3)
    is_glass : (T,) which of the triangles are of clear glass
    """

    passing: float
    mirrored: float
    clear: float
    scene: Scene = field(repr=False)
    normals: Array = field(repr=False)
    is_glass: NDArray[np.bool_] = field(repr=False)
    max_range: float = field(repr=False)
    rng: np.random.Generator = field(repr=False)

    def cast(self, beams: Beams, origins: Array, directions: Array) -> tuple[Array, Array]:
        """Ranges (N,) and cosines of incidence (N,)."""
        del beams
        ranges, faces = self.scene.cast(origins, directions, self.max_range)
        cosines = incidence(self.normals, faces, directions)
        at = np.flatnonzero(np.isfinite(ranges) & self.is_glass[faces] & (cosines < FRONT))
        fate = self.rng.random(len(at))
        normals = self.normals[faces]
        for low, high, mirrors in (
            (0.0, self.passing, False),
            (self.passing, self.passing + self.mirrored, True),
        ):
            chosen = at[(fate >= low) & (fate < high)]
            if not len(chosen):
                continue
            onward = directions[chosen]
            if mirrors:
                n = normals[chosen]
                onward = onward - 2 * np.einsum("ni,ni->n", onward, n)[:, None] * n
            starts = origins[chosen] + directions[chosen] * ranges[chosen, None] + BEHIND * onward
            further, hit = self.scene.cast(starts, np.ascontiguousarray(onward), self.max_range)
            total = ranges[chosen] + BEHIND + further
            ranges[chosen] = np.where(total <= self.max_range, total, np.inf)
            cosines[chosen] = incidence(self.normals, hit, onward)
        return ranges, cosines


def draw_glass(
    rng: np.random.Generator,
    level: float,
    surfaces: tuple[Scene, Array],
    is_pane: NDArray[np.bool_],
    max_range: float,
) -> Glass:
    """Choose the panes of clear glass: a third of all times the level."""
    clear = min(1.0, level / 3.0)
    is_glass = np.zeros(len(is_pane), dtype=np.bool_)
    panes = np.flatnonzero(is_pane)
    # A pane is two triangles that follow each other.
    chosen = rng.random((len(panes) + 1) // 2) < clear
    is_glass[panes] = np.repeat(chosen, 2)[: len(panes)]
    passing, mirrored = 0.8, float(rng.uniform(0.1, 0.2))
    seed = np.random.default_rng(rng.integers(2**63))
    return Glass(passing, mirrored, clear, *surfaces, is_glass, max_range, seed)
