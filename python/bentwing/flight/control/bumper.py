# SPDX-License-Identifier: MIT OR Apache-2.0
"""The virtual bumper: it keeps a carrier off what its lidar has just seen (Kaul 2015, section 5).

Points go into a local occupancy grid, springs to the occupied boundary give an acceleration, and
roll and pitch commands blend it with the pilot's.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.flight.control.checks import age_fault, fault, require_positive
from bentwing.flight.control.occupancy import GridSettings, OccupancyGrid
from bentwing.flight.control.springs import Springs, SpringSettings, push, springs_to

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

GRAVITY = 9.80665


@dataclass(frozen=True, slots=True)
class BumperSettings:
    """What the bumper may do.

    Attributes
    ----------
    hull_radius : m, of the carrier with its propellers
    max_push : rad, tilt that the bumper may command; its thrust authority
    max_tilt : rad, of pilot and bumper together
    max_age : s, of the newest points and of the state; older ones give no push
    max_speed : m/s, a faster carrier is an error of the estimate
    max_jump : m, a position that moves farther between two calls is a new one: the grid is cleared
    """

    hull_radius: float = 0.57
    max_push: float = math.radians(22.0)
    max_tilt: float = math.radians(25.0)
    max_age: float = 0.4
    max_speed: float = 20.0
    max_jump: float = 1.0
    springs: SpringSettings = field(default_factory=SpringSettings)
    grid: GridSettings = field(default_factory=GridSettings)

    def __post_init__(self) -> None:
        names = ("hull_radius", "max_push", "max_tilt", "max_age", "max_speed", "max_jump")
        require_positive({name: getattr(self, name) for name in names})
        if not self.max_push <= self.max_tilt < math.radians(60.0):
            msg = f"max_push ≤ max_tilt < 60°: expected, got {self.max_push}, {self.max_tilt} rad"
            raise UsageError(msg)
        if self.hull_radius + self.springs.length > self.grid.reach:
            msg = f"the springs are longer than the grid reaches: {self.grid.reach} m"
            raise UsageError(msg)


@dataclass(frozen=True, slots=True)
class CarrierState:
    """Where the carrier is.

    Attributes
    ----------
    time : s, of the estimate
    position, velocity : (3,) m, m/s, in the level frame of the points
    yaw : rad, of the body (x forward, y left, z up) in that frame
    """

    time: float
    position: Array
    velocity: Array
    yaw: float


@dataclass(frozen=True, slots=True)
class BumperCommand:
    """Attitude to fly.

    Attributes
    ----------
    roll, pitch : rad, pilot and bumper together; positive to the right and forward (nose down)
    push : (2,) m/s², level frame, what the bumper adds
    springs : those that are compressed
    faults : why there is no push, though there could be one; empty in good order
    """

    roll: float
    pitch: float
    push: Array
    springs: Springs
    faults: tuple[str, ...] = ()


NO_SPRINGS = Springs(np.empty((0, 2)), np.empty(0))


class VirtualBumper:
    """Keeps off what the lidar sees.

    Whatever cannot be used is refused and counted in `refused`. Without fresh points or with an
    unusable state there is no push, the pilot's command passes through, and `faults` says so.
    """

    def __init__(self, settings: BumperSettings | None = None) -> None:
        self.settings = settings or BumperSettings()
        self.grid = OccupancyGrid(self.settings.grid)
        self.refused: Counter[str] = Counter()
        self._newest = -math.inf
        self._position: Array | None = None

    def add_points(self, time: float, origin: ArrayLike, points: ArrayLike) -> bool:
        """Take the points of a scan or less; return whether they were taken.

        Parameters
        ----------
        time : s, of the newest of them, not before those added last
        origin : (3,) m, the lidar, level frame
        points : (N, 3) m, level frame; rows that are not finite are left out and counted

        Raises
        ------
        ValueError
            If an array has another shape.
        """
        start, table = _vector("origin", origin), np.asarray(points, np.float64)
        if table.ndim != 2 or table.shape[1] != 3:
            msg = f"points: expected shape (N, 3), got {table.shape}"
            raise ValueError(msg)
        if not (math.isfinite(time) and time >= self._newest and np.isfinite(start).all()):
            self.refused["scans"] += 1
            return False
        good = np.isfinite(table).all(axis=1)
        self.refused["points"] += int((~good).sum())
        if not good.any():
            return False
        self.grid.add(time, start, table[good])
        self._newest = time
        return True

    def command(
        self, time: float, state: CarrierState, *, pilot_roll: float, pilot_pitch: float
    ) -> BumperCommand:
        """Blend the pilot's roll and pitch (rad) with the push of the springs.

        A stick that is not finite counts as neutral. The part of the stick that points into an
        obstacle fades out as the push grows to its limit, the rest of it is left alone.
        """
        faults = [
            f"pilot's {name} is {value}: taken as neutral"
            for name, value in (("roll", pilot_roll), ("pitch", pilot_pitch))
            if not math.isfinite(value)
        ]
        most = self.settings.max_tilt
        roll, pitch = (_usable(stick, most) for stick in (pilot_roll, pilot_pitch))
        found = self._state_fault(time, state)
        if found is not None:
            return BumperCommand(
                roll, pitch, np.zeros(2), NO_SPRINGS, (*faults, f"{found}: no push")
            )
        boundary = self.grid.occupied(time)
        springs = springs_to(
            self.settings.springs, boundary, state.position[:2], self.settings.hull_radius
        )
        pushed = _limited(
            push(self.settings.springs, springs, state.velocity[:2]),
            GRAVITY * math.tan(self.settings.max_push),
        )
        roll, pitch = self._blend(roll, pitch, pushed, state.yaw)
        return BumperCommand(roll, pitch, pushed, springs, tuple(faults))

    def _state_fault(self, time: float, state: CarrierState) -> str | None:
        s = self.settings
        if not (np.isfinite(state.position).all() and np.isfinite(state.velocity).all()):
            return "position or velocity is not finite"
        found = (
            fault("yaw", state.yaw, 1e6)
            or age_fault("the state", time - state.time, s.max_age)
            or fault("speed", float(np.linalg.norm(state.velocity)), s.max_speed)
        )
        if found is not None:
            return found
        before, self._position = self._position, np.array(state.position, np.float64)
        jump = 0.0 if before is None else float(np.linalg.norm(state.position - before))
        if jump > s.max_jump:
            self.grid.clear()
            self._newest = -math.inf
            return f"the position has jumped by {jump:.2f} m"
        if self._newest == -math.inf:
            return "no points yet"
        return age_fault("the newest point", time - self._newest, s.max_age)

    def _blend(self, roll: float, pitch: float, pushed: Array, yaw: float) -> tuple[float, float]:
        cos, sin = math.cos(yaw), math.sin(yaw)
        forward, left = GRAVITY * math.tan(pitch), -GRAVITY * math.tan(roll)
        pilot = np.array([cos * forward - sin * left, sin * forward + cos * left])
        size = float(np.linalg.norm(pushed))
        if size > 0:
            away = pushed / size
            share = size / (GRAVITY * math.tan(self.settings.max_push))
            pilot = pilot - share * min(float(pilot @ away), 0.0) * away
        wanted = _limited(pilot + pushed, GRAVITY * math.tan(self.settings.max_tilt))
        forward, left = cos * wanted[0] + sin * wanted[1], cos * wanted[1] - sin * wanted[0]
        return -math.atan(left / GRAVITY), math.atan(forward / GRAVITY)


def _usable(stick: float, most: float) -> float:
    """Limit a stick; neutral if it is not finite."""
    return min(max(stick, -most), most) if math.isfinite(stick) else 0.0


def _vector(name: str, values: ArrayLike) -> Array:
    vector = np.asarray(values, np.float64)
    if vector.shape != (3,):
        msg = f"{name}: expected shape (3,), got {vector.shape}"
        raise ValueError(msg)
    return vector


def _limited(vector: Array, most: float) -> Array:
    size = float(np.linalg.norm(vector))
    return vector if size <= most else vector * (most / size)
