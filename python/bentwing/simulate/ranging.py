# SPDX-License-Identifier: MIT OR Apache-2.0
"""From beams to ranges: ray casting with each beam's own pose, and the errors of real rangefinders."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bentwing._core import Scene
from bentwing.simulate.kinematics import Nodes
from bentwing.simulate.scenes.world import face_normals

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bentwing.simulate.beams import Beams
    from bentwing.simulate.kinematics import Motion
    from bentwing.simulate.rig import Rig
    from bentwing.simulate.scenes.mesh import Mesh

    Array = NDArray[np.float64]

NODE_STEP = 1e-3
AIRFRAME_RANGE = 1.2
"""m; farther away there is nothing of the carrier."""


@dataclass(frozen=True, slots=True)
class RangeErrors:
    """Errors of a rangefinder; zeros make it perfect.

    Attributes
    ----------
    sigma : m, white noise
    resolution : m, ranges are multiples of it; 0 for none
    dropout : share of beams lost anywhere
    grazing : cosine of incidence below which beams get lost more and more often
    mixing : chance that a beam next to a depth edge returns a range in between
    edge : m, a larger difference between neighbours is a depth edge
    """

    sigma: float
    resolution: float = 0.001
    dropout: float = 0.012
    grazing: float = 0.12
    mixing: float = 0.15
    edge: float = 0.3


class Body(Protocol):
    """What can be hit: the world, or a body that moves in it or with the lidar."""

    def cast(self, beams: Beams, origins: Array, directions: Array) -> tuple[Array, Array]:
        """Ranges (N,) and cosines of incidence (N,) of the beams on this body."""
        ...


@dataclass(frozen=True, slots=True)
class Surfaces:
    """Surfaces that stand still.

    Attributes
    ----------
    normals : (T, 3) unit normals of the triangles
    max_range : m, beyond it nothing returns
    """

    scene: Scene
    normals: Array
    max_range: float

    def cast(self, beams: Beams, origins: Array, directions: Array) -> tuple[Array, Array]:
        """Casts in the map frame."""
        del beams
        ranges, faces = self.scene.cast(origins, directions, self.max_range)
        return ranges, incidence(self.normals, faces, directions)


class Airframe:
    """The carrier as its own lidar sees it: legs and arms."""

    def __init__(self, mesh: Mesh, rig: Rig) -> None:
        self._scene = Scene(mesh.vertices, mesh.triangles)
        self._normals = face_normals(mesh)
        self._rig = rig

    def cast(self, beams: Beams, origins: Array, directions: Array) -> tuple[Array, Array]:
        """Casts in the body frame; the map-frame rays are not needed."""
        del origins, directions
        nodes = nodes_around(beams, self._rig.lidar_in_body)
        o, d = nodes.place(beams.times.ravel(), beams.directions.reshape(-1, 3))
        ranges, faces = self._scene.cast(o, d, AIRFRAME_RANGE)
        return ranges, incidence(self._normals, faces, d)


@dataclass(frozen=True, slots=True)
class Shots:
    """Where beams began and what they hit, in the grid (A, B) of the beams.

    Attributes
    ----------
    beams : where they truly point to
    origins, directions : (A, B, 3) m, unit vectors; map frame
    ranges : (A, B) m, infinite where nothing is hit
    cosines : (A, B) of incidence, times the reflectivity where surfaces differ in it
    """

    beams: Beams
    origins: Array
    directions: Array
    ranges: Array
    cosines: Array


class RangeEffect(Protocol):
    """Something that makes ranges wrong."""

    def apply(self, shots: Shots) -> Shots:
        """Return the shots with the ranges and cosines that the lidar gets."""
        ...


class Aim(Protocol):
    """Where beams point to."""

    def actual(self, beams: Beams) -> Beams:
        """Return where the beams truly point to, given where they are said to."""
        ...


@dataclass(frozen=True, slots=True)
class Ranger:
    """Measures ranges to bodies from a moving lidar.

    Attributes
    ----------
    bodies : what can be hit, at least one
    max_range : m, beyond it nothing returns
    aim : where the beams point to, if not where they are said to
    effects : what makes ranges wrong beside `errors`, in this order
    """

    bodies: Sequence[Body]
    rig: Rig
    errors: RangeErrors
    max_range: float
    rng: np.random.Generator
    aim: Aim | None = None
    effects: Sequence[RangeEffect] = ()

    def measure(self, beams: Beams) -> tuple[Array, Array]:
        """Ranges (A, B), infinite where nothing returned, NaN where lost, and cosines of incidence."""
        shots = self._shoot(beams if self.aim is None else self.aim.actual(beams))
        for effect in self.effects:
            shots = effect.apply(shots)
        return self._spoil(shots.ranges, shots.cosines, beams.sweep_axis), shots.cosines

    def _shoot(self, beams: Beams) -> Shots:
        nodes = nodes_around(beams, self.rig.lidar)
        origins, directions = nodes.place(beams.times.ravel(), beams.directions.reshape(-1, 3))
        ranges, cosines = self.bodies[0].cast(beams, origins, directions)
        for body in self.bodies[1:]:
            nearer, others = body.cast(beams, origins, directions)
            cosines = np.where(nearer < ranges, others, cosines)
            ranges = np.minimum(ranges, nearer)
        grid = beams.times.shape
        return Shots(
            beams,
            origins.reshape(*grid, 3),
            directions.reshape(*grid, 3),
            ranges.reshape(grid),
            cosines.reshape(grid),
        )

    def _spoil(self, ranges: Array, cosines: Array, sweep_axis: int) -> Array:
        e, rng = self.errors, self.rng
        mixed = _mix(ranges, sweep_axis, e, rng) if e.mixing > 0 else ranges
        noisy = mixed + rng.normal(0.0, 1.0, ranges.shape) * e.sigma
        if e.resolution > 0:
            noisy = np.round(noisy / e.resolution) * e.resolution
        if e.dropout > 0:
            chance = e.dropout + 0.9 * np.clip(1.0 - cosines / e.grazing, 0.0, 1.0)
            lost = rng.random(ranges.shape) < chance
            noisy = np.where(lost & np.isfinite(noisy), np.nan, noisy)
        return np.where(noisy > self.max_range, np.inf, noisy)


def _mix(ranges: Array, axis: int, errors: RangeErrors, rng: np.random.Generator) -> Array:
    """Beams on the far side of a depth edge partly return from the near side."""
    finite = np.where(np.isfinite(ranges), ranges, 0.0)
    share = rng.random(ranges.shape)
    chosen = rng.random(ranges.shape) < errors.mixing
    for shift in (1, -1):
        neighbour = np.roll(finite, shift, axis=axis)
        is_edge = (neighbour > 0) & (finite - neighbour > errors.edge) & (finite < 40.0)
        ranges = np.where(is_edge & chosen, neighbour + share * (finite - neighbour), ranges)
    return ranges


def incidence(normals: Array, faces: NDArray[np.int32], directions: Array) -> Array:
    """Cosine (N,) between beams and the normals of the faces they hit."""
    cosines: Array = abs(np.einsum("ni,ni->n", normals[faces], directions))
    return cosines


def nodes_around(beams: Beams, motion: Callable[[Array], Motion]) -> Nodes:
    """Exact poses every millisecond, over the time of the beams."""
    start = float(beams.times.min())
    times = start + NODE_STEP * np.arange(int((beams.times.max() - start) / NODE_STEP) + 2.0)
    return Nodes(start, NODE_STEP, motion(times))
