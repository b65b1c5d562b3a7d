# SPDX-License-Identifier: MIT OR Apache-2.0
"""A rough chamber that narrows into a winding tube."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.scenes.mesh import Mesh, column, merge, sheet, smooth_noise
from bentwing.simulate.scenes.world import Site

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def cave(rng: np.random.Generator) -> Site:
    """Carve a chamber about 12 m wide and a tube about 4 m wide, 40 m in all."""
    length, chamber = rng.uniform(36.0, 42.0), rng.uniform(5.5, 6.5)
    along = np.linspace(0.0, length, int(length / 0.22))
    around = np.linspace(0.0, 2 * np.pi, 110)
    mesh = _sweep(rng, along, around, _radii(along, chamber))
    pillars = [
        column((rng.uniform(0.2, 0.4), 0.05), rng.uniform(0.8, 2.0), 8).moved((x, y, -2.2))
        for x, y in rng.uniform((3.0, -3.0), (10.0, 3.0), size=(7, 2))
    ]
    low, high = (1.5, -5.0, -1.2), (length - 1.5, 5.0, 2.4)
    return Site(merge([mesh, *pillars]), low, high, pad_below=-0.9, speed=0.8)


def _radii(along: Array, chamber: float) -> Array:
    """Half the width: closed at both ends, wide in the chamber, narrow in the tube."""
    bulge = chamber * np.sqrt(np.clip(1 - ((along - chamber) / chamber) ** 2, 0.0, None))
    tube = 2.1 * np.clip((along - 1.2 * chamber) / 2.0, 0.0, 1.0)
    end = np.sqrt(np.clip((along[-1] - along) / 1.5, 0.0, 1.0))
    radii: Array = np.maximum(bulge, tube) * end
    return radii


def _sweep(rng: np.random.Generator, along: Array, around: Array, radii: Array) -> Mesh:
    """Rings around a winding line, displaced by noise of three wavelengths, seen from inside."""
    noises = [smooth_noise(rng, w, a, 3) for w, a in ((4.0, 0.10), (1.3, 0.04), (0.45, 0.012))]
    bend = smooth_noise(rng, 16.0, 0.9, 1)
    s, angle = np.meshgrid(along, around, indexing="ij")
    height = np.where(np.sin(angle) < 0, 0.62, 0.9)
    y, z = radii[:, None] * np.cos(angle), radii[:, None] * height * np.sin(angle)
    points = np.stack([s, y, np.maximum(z, -2.4)], axis=-1)
    roughness = sum(noise(points.reshape(-1, 3)) for noise in noises)
    points[..., 1:] *= 1.0 + np.reshape(roughness, (*s.shape, 1))
    points[..., 1] += bend(along[:, None])[:, None]
    points[:, -1] = points[:, 0]
    return sheet(points)
