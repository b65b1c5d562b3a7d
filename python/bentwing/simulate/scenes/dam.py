# SPDX-License-Identifier: MIT OR Apache-2.0
"""A valley with a large curved wall, to be seen from 70 m above (after the dam of Guerlédan)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.scenes.mesh import Mesh, ball, box, ground, merge, sheet, smooth_noise
from bentwing.simulate.scenes.world import Site, Survey

if TYPE_CHECKING:
    from numpy.typing import NDArray

HALF_WIDTH, HEIGHT = 110.0, 42.0
"""m, of the wall."""
RADIUS, BASE = 180.0, 30.0
"""m, of the crest's arc, and how much farther out the wall's foot is than its crest."""


def dam(rng: np.random.Generator) -> Site:
    """Build the valley, about 420 × 320 m, with the wall across it and some trees and houses."""
    rough, waves = smooth_noise(rng, 12.0, 0.5), smooth_noise(rng, 60.0, 3.0)

    def height(xy: NDArray[np.float64]) -> NDArray[np.float64]:
        sides = 55.0 * np.clip((np.abs(xy[:, 1]) - 35.0) / 120.0, 0.0, None) ** 1.3
        return sides + rough(xy) + waves(xy)

    parts = [ground((-120.0, 300.0), (-160.0, 160.0), 2.5, height), _wall()]
    for at in rng.uniform((-80.0, -120.0), (260.0, 120.0), (120, 2)):
        z = float(height(at[None])[0])
        size = rng.uniform(2.0, 4.0)
        crown = ball([size, size, 1.4 * size], 6, smooth_noise(rng, 0.8, 0.12, 3))
        parts.append(crown.moved((*at, z + 1.2 * size)))
    for at in rng.uniform((30.0, -30.0), (250.0, 30.0), (12, 2)):
        high = rng.uniform((6.0, 5.0, 3.0), (14.0, 9.0, 6.0))
        parts.append(
            box((0.0, 0.0, -2.0), high).moved(
                (*at, float(height(at[None])[0])), rng.uniform(0.0, 3.1)
            )
        )
    survey = Survey(((40.0, -50.0, 70.0), (40.0, 50.0, 70.0), (180.0, 50.0, 70.0)), speed=4.0)
    return Site(
        merge(parts), (-60.0, -100.0, 65.0), (240.0, 100.0, 75.0), 3.0, survey.speed, survey
    )


def _wall() -> Mesh:
    """Build an arc whose face leans back from foot to crest."""
    angles = np.linspace(-1.0, 1.0, 60) * np.arcsin(HALF_WIDTH / RADIUS)
    levels = np.linspace(0.0, 1.0, 10)
    out = RADIUS + BASE * (1.0 - levels[:, None]) ** 1.5
    x, y = out * np.cos(angles) - RADIUS - 20.0, out * np.sin(angles)
    z = np.broadcast_to(-4.0 + (HEIGHT + 4.0) * levels[:, None], x.shape)
    return sheet(np.swapaxes(np.stack([x, y, z], axis=-1), 0, 1))
