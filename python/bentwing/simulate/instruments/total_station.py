# SPDX-License-Identifier: MIT OR Apache-2.0
"""A robotic total station that follows a prism on the payload.

It is built for targets that stand still: while it measures, up to 0.15 s, the target moves on, so that
its error grows with speed (Kaul 2015, section 4.2 and figure 20).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.instruments.places import sees, standing_places

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.rig import Rig
    from bentwing.simulate.scenes import World

    Array = NDArray[np.float64]

_PLACES = 24  # tried, of which the one that sees most of the flight is taken
_LOOKED_AT = 300  # instants of the flight at which that is decided


@dataclass(frozen=True, slots=True)
class TotalStation:
    """Errors of a Leica Viva TS12 in tracking mode, and the prism it follows.

    Attributes
    ----------
    sigma : m, of each coordinate of a target at rest
    measuring_time : s, during which the two angles and the distance are read, at an instant each
    interval : s, between two measurements
    clock_offset : s, how far its clock is ahead of the IMU's
    prism : m, in the IMU frame
    """

    sigma: float = 0.003
    measuring_time: float = 0.15
    interval: float = 0.2
    clock_offset: float = 2.75
    prism: tuple[float, float, float] = (0.07, 0.03, 0.1)


@dataclass(frozen=True, slots=True)
class Sighting:
    """What a total station has measured.

    Attributes
    ----------
    times : (N,) s on its own clock; where the prism was hidden there are none
    positions : (N, 3) m in its own levelled frame
    share_seen : of all measurements that were tried
    """

    times: Array
    positions: Array
    share_seen: float


def track(
    world: World,
    rig: Rig,
    span: tuple[float, float],
    rng: np.random.Generator,
    station: TotalStation | None = None,
) -> Sighting:
    """Follow the prism from the place on the ground that sees most of the flight.

    Parameters
    ----------
    span : first and last time of the flight, s
    """
    station = station or TotalStation()
    times = np.arange(*span, station.interval)
    looks = times[:: -(-len(times) // _LOOKED_AT)]
    places = standing_places(world, rng, _PLACES)
    prisms = _prism(rig, looks, station)
    place = max(places, key=lambda p: np.count_nonzero(sees(world, p, prisms, 0.0)))
    read_at = times[:, None] + station.measuring_time * rng.uniform(-0.5, 0.5, (len(times), 3))
    measured = _measured(rig, read_at, place, station) + rng.normal(
        0.0, station.sigma, (len(times), 3)
    )
    seen = sees(world, place, _prism(rig, times, station), 0.0)
    yaw = rng.uniform(-np.pi, np.pi)
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    own = (measured[seen] - place) @ turn.T
    return Sighting(times[seen] + station.clock_offset, own, float(seen.mean()))


def _prism(rig: Rig, times: Array, station: TotalStation) -> Array:
    motion = rig.imu(times)
    return np.ascontiguousarray(motion.p + motion.R @ np.array(station.prism))


def _measured(rig: Rig, read_at: Array, place: Array, station: TotalStation) -> Array:
    """Positions (N, 3) from azimuth, elevation and distance, each read at its own instant (N, 3)."""
    order = np.argsort(read_at.ravel(), kind="stable")
    ways = np.empty((read_at.size, 3))
    ways[order] = _prism(rig, read_at.ravel()[order], station) - place
    ways = ways.reshape(*read_at.shape, 3)
    azimuth = np.arctan2(ways[:, 0, 1], ways[:, 0, 0])
    elevation = np.arctan2(ways[:, 1, 2], np.hypot(ways[:, 1, 0], ways[:, 1, 1]))
    distance = np.linalg.norm(ways[:, 2], axis=1)
    level = np.cos(elevation) * distance
    measured: Array = place + np.column_stack(
        [np.cos(azimuth) * level, np.sin(azimuth) * level, np.sin(elevation) * distance]
    )
    return measured
