# SPDX-License-Identifier: MIT OR Apache-2.0
"""Virtual compression springs between the carrier and the occupied boundary (Kaul 2015, Fig. 26)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.flight.control.checks import require_positive

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

N_SECTORS = 72
"""Springs all around, one per 5°."""
_N_SIDES = 16
_SIDES = 2 * np.pi * np.arange(_N_SIDES) / _N_SIDES
_SIDE_VECTORS = np.column_stack([np.cos(_SIDES), np.sin(_SIDES)])


@dataclass(frozen=True, slots=True)
class SpringSettings:
    """Springs per unit of mass.

    Attributes
    ----------
    length : m, at rest, from the hull outwards; nothing farther away pushes
    stiffness : 1/s², acceleration per compression
    damping : 1/s, acceleration per speed of approach at full compression; without it a spring
        throws the carrier back as fast as it came
    """

    length: float = 2.0
    stiffness: float = 3.0
    damping: float = 3.0

    def __post_init__(self) -> None:
        require_positive({name: getattr(self, name) for name in self.__slots__})


@dataclass(frozen=True, slots=True)
class Springs:
    """The compressed ones.

    Attributes
    ----------
    directions : (S, 2) unit vectors from the carrier to the boundary
    gaps : (S,) m, from the hull to the boundary; never below zero
    """

    directions: Array
    gaps: Array


def springs_to(settings: SpringSettings, boundary: Array, centre: Array, hull: float) -> Springs:
    """Span a spring to the nearest occupied place of each sector.

    Parameters
    ----------
    boundary : (K, 2) m, occupied places
    centre : (2,) m, the carrier
    hull : m, its radius
    """
    away = boundary - centre
    distances = np.linalg.norm(away, axis=1)
    near = (distances < hull + settings.length) & (distances > 0)
    away, distances = away[near], distances[near]
    sectors = (np.arctan2(away[:, 1], away[:, 0]) * (N_SECTORS / (2 * np.pi))).astype(np.int64)
    order = np.lexsort((distances, sectors))
    _, first = np.unique(sectors[order], return_index=True)
    nearest = order[first]
    gaps = np.maximum(distances[nearest] - hull, 0.0)
    return Springs(away[nearest] / distances[nearest, None], gaps)


def push(settings: SpringSettings, springs: Springs, velocity: Array) -> Array:
    """Acceleration (2,), m/s², with which the springs push a carrier of `velocity` (2,), m/s.

    In each of 16 directions the strongest spring counts, and the directions are summed such that
    one spring alone gives its own force. A sum of all springs would let a wall push twenty times as
    hard as a tree at the same distance, which hurts no less; two walls of a corridor still cancel.
    """
    if not len(springs.gaps):
        return np.zeros(2)
    compression = settings.length - springs.gaps
    approach = np.maximum(springs.directions @ velocity, 0.0)
    forces = compression * (settings.stiffness + settings.damping / settings.length * approach)
    toward = np.maximum(-springs.directions @ _SIDE_VECTORS.T, 0.0)
    strongest = (forces[:, None] * toward).max(axis=0)
    return np.asarray(4.0 / _N_SIDES * strongest @ _SIDE_VECTORS)
