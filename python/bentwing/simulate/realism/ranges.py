# SPDX-License-Identifier: MIT OR Apache-2.0
"""Ranges that are wrong in the same way each time: they do not average out."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.realism.effect import of_about

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.ranging import Shots

    Array = NDArray[np.float64]

COOLING = 1200.0
"""s, in which a rangefinder that warms up loses all but a third of its first error."""
BEAM_WIDTH = 3e-3
"""rad, full width of a beam."""
LARGEST_GRAZING = 0.2
"""m."""
N_MATERIALS = 40
PATCH = 1.5
"""m, edge of the cubes of one material."""


@dataclass(frozen=True, slots=True)
class Reading:
    """What a rangefinder makes of a range.

    Attributes
    ----------
    offset : m
    scale : share of the range by which it is too long
    cold : m, by how much it is longer when switched on
    age : s, since when it was switched on at the recording's start
    """

    offset: float
    scale: float
    cold: float
    age: float

    def apply(self, shots: Shots) -> Shots:
        """Change all ranges by offset, scale and warm-up."""
        warm_up = self.cold * np.exp(-(self.age + shots.beams.times) / COOLING)
        return replace(shots, ranges=shots.ranges * (1.0 + self.scale) + self.offset + warm_up)

    @classmethod
    def draw(cls, rng: np.random.Generator, level: float) -> Reading:
        """Draw 10 mm, 0.05 % and 8 mm when cold, each times the level."""
        return cls(
            of_about(rng, 0.010 * level),
            of_about(rng, 5e-4 * level),
            of_about(rng, 0.008 * level),
            float(rng.uniform(0.0, 600.0)),
        )


@dataclass(frozen=True, slots=True)
class FarNoise:
    """Noise that grows with the range.

    Attributes
    ----------
    growth : m per m beyond `start`, standard deviation
    start, most : m
    """

    growth: float
    rng: np.random.Generator = field(repr=False)
    start: float = 10.0
    most: float = 0.05

    def apply(self, shots: Shots) -> Shots:
        """Add the noise."""
        far = np.where(np.isfinite(shots.ranges), shots.ranges, 0.0) - self.start
        sigma = np.clip(self.growth * far, 0.0, self.most)
        noise = self.rng.normal(0.0, 1.0, far.shape) * sigma
        return replace(shots, ranges=shots.ranges + noise)


@dataclass(frozen=True, slots=True)
class Patches:
    """Materials, by which ranges and intensities differ from place to place.

    Attributes
    ----------
    offsets : (N_MATERIALS,) m
    reflectivities : (N_MATERIALS,) 0 … 1
    retro : material whose returns are so strong that the neighbouring shots see it as well
    corner : (3,) m, of the cubes
    """

    offsets: Array
    reflectivities: Array
    retro: int
    corner: Array

    def apply(self, shots: Shots) -> Shots:
        """Shift each range by its material's offset, and spread the returns of the retro-reflector."""
        hit = np.isfinite(shots.ranges)
        points = shots.origins + shots.directions * np.where(hit, shots.ranges, 0.0)[..., None]
        material = self.material(points)
        ranges = shots.ranges + self.offsets[material]
        cosines = shots.cosines * self.reflectivities[material]
        bright = np.where(hit & (material == self.retro), ranges, np.inf)
        for shift in (1, -1):
            halo = np.roll(bright, shift, axis=shots.beams.sweep_axis)
            ranges = np.minimum(ranges, halo)
        return replace(shots, ranges=ranges, cosines=cosines)

    def material(self, points: Array) -> NDArray[np.int64]:
        """Return the number of the material at points (…, 3), m, map frame."""
        cube = np.floor((points - self.corner) / PATCH).astype(np.int64)
        mixed = cube @ np.array([73_856_093, 19_349_663, 83_492_791])
        return np.asarray((mixed ^ (mixed >> 13)) % N_MATERIALS)

    @classmethod
    def draw(cls, rng: np.random.Generator, level: float) -> Patches:
        """Draw 8 mm times the level, and up to ± 33 mm times the level for a retro-reflector."""
        offsets = rng.normal(0.0, 0.008 * level, N_MATERIALS)
        reflectivities = rng.uniform(0.15, 1.0, N_MATERIALS)
        offsets[0], reflectivities[0] = rng.uniform(-0.033, 0.033) * level, 1.0
        return cls(offsets, reflectivities, 0, rng.uniform(0.0, PATCH, 3))


@dataclass(frozen=True, slots=True)
class Grazing:
    """A wide beam on a slanted surface returns a little too late.

    Attributes
    ----------
    share : of the beam's footprint along the range, by which it is late
    """

    share: float

    def apply(self, shots: Shots) -> Shots:
        """Lengthen ranges by c · r · w · tan θ, at most `LARGEST_GRAZING` (Laconte 2019)."""
        cosines = np.clip(shots.cosines, 1e-3, 1.0)
        slant = np.sqrt(1.0 - cosines**2) / cosines
        reach = np.where(np.isfinite(shots.ranges), shots.ranges, 0.0)
        late = np.minimum(self.share * reach * BEAM_WIDTH * slant, LARGEST_GRAZING)
        return replace(shots, ranges=shots.ranges + late)

    @classmethod
    def draw(cls, rng: np.random.Generator, level: float) -> Grazing:
        """Draw up to 0.3 times the level."""
        return cls(float(rng.uniform(0.1, 0.3)) * level)


@dataclass(frozen=True, slots=True)
class Clutter:
    """Drops, flakes and dust near the lidar.

    Attributes
    ----------
    share : of the shots that return from them
    nearest, farthest : m
    """

    share: float
    rng: np.random.Generator = field(repr=False)
    nearest: float = 0.5
    farthest: float = 5.0

    def apply(self, shots: Shots) -> Shots:
        """Let a share of the shots end early."""
        at = self.rng.uniform(self.nearest, self.farthest, shots.ranges.shape)
        hit = (self.rng.random(at.shape) < self.share) & (at < shots.ranges)
        ranges = np.where(hit, at, shots.ranges)
        return replace(shots, ranges=ranges, cosines=np.where(hit, 1.0, shots.cosines))

    @classmethod
    def draw(cls, rng: np.random.Generator, level: float) -> Clutter:
        """Draw 0.1 to 0.3 % times the level."""
        return cls(
            float(rng.uniform(0.001, 0.003)) * level, np.random.default_rng(rng.integers(2**63))
        )
