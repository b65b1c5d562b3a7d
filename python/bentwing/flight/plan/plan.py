# SPDX-License-Identifier: MIT OR Apache-2.0
"""From a payload and what the flight is for: how fast to spin, and what comes of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from bentwing.base.errors import UsageError
from bentwing.flight.plan.patterns import PATTERNS, ScanPattern
from bentwing.flight.plan.turning import Coverage, Turning, coverage, turning_of
from bentwing.recording.payload import as_payload

if TYPE_CHECKING:
    from bentwing.recording.payload import Payload, PayloadLike

RANGES = (1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 60.0, 100.0)
"""m, at which the spacing of points is given, as far as the lidar reaches."""
_REVOLUTIONS = 2
_ROUND = math.radians(10.0)
_LAND = 60.0  # s, of every flight, for take-off and landing


@dataclass(frozen=True, slots=True)
class Intent:
    """What the flight is for; defaults are those of Kaul 2015, section 3.2.3.

    Attributes
    ----------
    distance : m, to the structure that is to be mapped
    speed : m/s, of the carrier
    voxel_size : m, of the finest surfels
    window : s, of the estimator
    scan_rate_hz, beam_step : of the lidar, rad; None takes those of its kind
    area : m², of the site
    flight_time : s, of one battery
    """

    distance: float = 5.0
    speed: float = 2.0
    voxel_size: float = 0.4
    window: float = 5.0
    scan_rate_hz: float | None = None
    beam_step: float | None = None
    area: float = 2500.0
    flight_time: float = 600.0

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                msg = f"{name}: expected a finite number above zero, got {value}"
                raise UsageError(msg)


@dataclass(frozen=True, slots=True)
class SpinRange:
    """Acceptable rates, rad/s.

    Attributes
    ----------
    lines : upper bound, from the spacing of lines
    revolutions : lower bound, from two sweeps of everything per window
    reobservation : lower bound, from the way between two views of the same surface
    """

    lines: float
    revolutions: float
    reobservation: float

    @property
    def lowest(self) -> float:
        """The greater of the lower bounds."""
        return max(self.revolutions, self.reobservation)

    @property
    def is_empty(self) -> bool:
        """Whether no rate satisfies all bounds."""
        return self.lowest > self.lines

    @property
    def rounded_deg(self) -> tuple[int, int]:
        """In tens of °/s: the lower bound upwards, the upper one to the nearest."""
        low, high = self.lowest / _ROUND, self.lines / _ROUND
        return 10 * math.ceil(low - 1e-9), 10 * round(high)


@dataclass(frozen=True, slots=True)
class Spacing:
    """Distances between points on a surface that faces the lidar at `range`, all in m."""

    range: float
    along: float
    across: float


@dataclass(frozen=True, slots=True)
class Plan:
    """The answer.

    Attributes
    ----------
    turning, pattern, intent : what was assumed
    spin : None for a lidar that is fixed
    rate : rad/s, the middle of the range (geometric), for which the spacings are given
    spacings : by range
    coverage : after a full turn
    site_time : s, in the air, with take-offs
    n_flights : batteries
    """

    turning: Turning
    pattern: ScanPattern
    intent: Intent
    spin: SpinRange | None
    rate: float
    spacings: tuple[Spacing, ...]
    coverage: Coverage
    site_time: float
    n_flights: int


def plan_flight(payload: PayloadLike, intent: Intent | None = None) -> Plan:
    """Plan a flight with a head, or the payload.yaml that describes it.

    Raises
    ------
    UsageError
        If the structure is beyond the lidar's reach, or a battery does not last for a lane.
    """
    head, intent = as_payload(payload), intent or Intent()
    reach = head.lidar.max_range
    if intent.distance > reach:
        msg = (
            f"distance: {intent.distance:g} m is beyond the {reach:g} m that the "
            f"lidar reaches; fly nearer or give another max_range in the payload"
        )
        raise UsageError(msg)
    pattern = _pattern(head, intent)
    turning = turning_of(head, pattern)
    seen = coverage(turning, pattern)
    spin = None if turning.turned == "fixed" else spin_range(pattern, seen.sweep, intent)
    rate = 0.0 if spin is None else math.sqrt(spin.lowest * spin.lines)
    spacings = tuple(_spacing(pattern, rate, r) for r in RANGES if r <= reach)
    time, n_flights = site_time(intent)
    return Plan(turning, pattern, intent, spin, rate, spacings, seen, time, n_flights)


def spin_range(pattern: ScanPattern, sweep: float, intent: Intent) -> SpinRange:
    """Bound the spin rate (Kaul 2015, section 3.2.3).

    Lines of consecutive sweeps are d ≈ ρ α τ apart, at most a voxel; a lidar with several lines
    covers a swath, beyond which the next one has to begin. A window has to hold two sweeps of
    everything. Between two views of a surface the carrier moves v Θ / α, Θ the turn of a sweep; at
    half the distance to the structure the surface is seen at another density and another angle.
    The paper says 72 °/s and "around 150 °/s" for the latter two.
    """
    lines = pattern.rate_hz * (intent.voxel_size / intent.distance + pattern.swath)
    revolutions = _REVOLUTIONS * sweep / intent.window
    reobservation = intent.speed * sweep / (0.5 * intent.distance)
    return SpinRange(lines, revolutions, reobservation)


def site_time(intent: Intent) -> tuple[float, int]:
    """Return the time in the air (s) and the number of batteries for the site.

    Lanes are one distance-to-structure apart, so that everything is seen from two of them.
    """
    usable = intent.flight_time - _LAND
    if usable <= 0:
        msg = f"flight_time: {intent.flight_time:g} s leaves nothing beside {_LAND:g} s for take-off and landing"
        raise UsageError(msg)
    mapping = intent.area / (intent.distance * intent.speed)
    n_flights = math.ceil(mapping / usable)
    return mapping + n_flights * _LAND, n_flights


def _pattern(payload: Payload, intent: Intent) -> ScanPattern:
    pattern = PATTERNS[payload.lidar.kind]
    rate = intent.scan_rate_hz or pattern.rate_hz
    return replace(pattern, rate_hz=rate, beam_step=intent.beam_step or pattern.beam_step)


def _spacing(pattern: ScanPattern, rate: float, distance: float) -> Spacing:
    """Across the lines: of one sweep if it has several, else from sweep to sweep."""
    across = pattern.line_step or rate / pattern.rate_hz
    return Spacing(distance, distance * pattern.beam_step, distance * across)
