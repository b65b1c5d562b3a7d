# SPDX-License-Identifier: MIT OR Apache-2.0
"""A terrestrial laser scanner on a tripod, moved from station to station."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.instruments.places import sees, standing_places

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from bentwing.simulate.scenes import World

    Array = NDArray[np.float64]

_PLACES = 80  # tried
_TARGETS = 3000  # points of the site that stations are chosen by
_SLACK = 0.02  # m before a target at which the view may end
_LOWEST = np.radians(-60.0)  # below it is the tripod
_COLUMNS = 128  # of a scan that are measured at once


@dataclass(frozen=True, slots=True)
class TerrestrialErrors:
    """Errors of a Faro Focus 3D (Kaul 2015, section 4.2), and of putting its scans together.

    Attributes
    ----------
    bias : m, of all ranges; the manufacturer allows twice as much
    sigma : m, of a range
    station_sigma, station_turn : m and rad, of a scan's place among the others after registration
    max_range : m
    """

    bias: float = 0.001
    sigma: float = 0.0015
    station_sigma: float = 0.001
    station_turn: float = 5e-5
    max_range: float = 60.0


@dataclass(frozen=True, slots=True)
class Station:
    """A scan's place (3,) m in the world, and where the registration believes it to be.

    Attributes
    ----------
    place : (3,) m
    shift : (3,) m, error of the registered place
    turn : (3, 3) rotation, error of the registered attitude
    """

    place: Array
    shift: Array
    turn: Array


def choose_stations(
    world: World, rng: np.random.Generator, n: int, errors: TerrestrialErrors
) -> list[Station]:
    """Choose places one after the other, each where most is seen that was not seen before."""
    places = standing_places(world, rng, _PLACES)
    targets = _surface_points(world, rng)
    seen = np.stack([sees(world, place, targets, _SLACK) for place in places])
    missing = np.ones(len(targets), np.bool_)
    stations = []
    for _ in range(n):
        best = int(np.argmax((seen & missing).sum(axis=1)))
        missing &= ~seen[best]
        a, b, c = rng.normal(0.0, errors.station_turn, 3)
        turn = np.array([[1.0, -c, b], [c, 1.0, -a], [-b, a, 1.0]])
        stations.append(Station(places[best], rng.normal(0.0, errors.station_sigma, 3), turn))
    return stations


def scan(
    world: World, station: Station, step: float, rng: np.random.Generator, errors: TerrestrialErrors
) -> Iterator[Array]:
    """Scan all round, with `step` rad between neighbouring beams.

    Yields
    ------
    Points (N, 3) float64, m in the world, as the registered scans have them.
    """
    elevations = np.arange(_LOWEST, np.pi / 2, step)
    azimuths = np.arange(0.0, 2 * np.pi, step)
    for first in range(0, len(azimuths), _COLUMNS):
        azimuth = azimuths[first : first + _COLUMNS, None]
        level = np.cos(elevations)
        rays = np.stack(
            [
                np.cos(azimuth) * level,
                np.sin(azimuth) * level,
                np.broadcast_to(np.sin(elevations), (len(azimuth), len(elevations))),
            ],
            axis=-1,
        ).reshape(-1, 3)
        origins = np.broadcast_to(station.place, rays.shape)
        ranges, _ = world.scene.cast(np.ascontiguousarray(origins), rays, errors.max_range)
        hit = np.isfinite(ranges)
        noise = errors.bias + rng.normal(0.0, errors.sigma, np.count_nonzero(hit))
        yield (
            station.place
            + station.shift
            + ((ranges[hit] + noise)[:, None] * rays[hit]) @ (station.turn.T)
        )


def _surface_points(world: World, rng: np.random.Generator) -> Array:
    """Points on the site's surfaces near its box, by area."""
    mesh = world.site.mesh
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    chosen = rng.choice(len(areas), _TARGETS, p=areas / areas.sum())
    u, v = rng.uniform(0.0, 1.0, (2, _TARGETS, 1))
    flip = u + v > 1.0
    u, v = np.where(flip, 1.0 - u, u), np.where(flip, 1.0 - v, v)
    points: Array = a[chosen] + u * (b - a)[chosen] + v * (c - a)[chosen]
    return np.ascontiguousarray(points)
