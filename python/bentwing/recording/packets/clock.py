# SPDX-License-Identifier: MIT OR Apache-2.0
"""Put the stamps in a lidar's packets on the clock of the recording.

The sensor stamps to the microsecond but often counts from when it was switched on, and Velodyne's
begin anew every hour. The computer knows the date, but receives packets late, by a varying time.
So the intervals are the sensor's, and the computer tells the hour; what else it tells depends on
whether another sensor has to agree.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Sequence

MAX_SYNCHRONIZED_NS = 1_000_000_000  # from the computer's time; more is a clock never set
MAX_DRIFT = 1e-4  # of two crystals; the worst are 50 ppm off each
WINDOW_NS = 1_000_000_000  # in which the fastest packet tells the difference of the clocks


@dataclass(frozen=True, slots=True)
class ClockReading:
    """What the stamps of a sensor mean.

    `origin`: "sensor" (its clock is set, e.g. by GPS or PTP, and is taken as it is), "start" (its
    intervals, from the computer's time at the start) or "computer" (its intervals, following the
    computer's clock slowly, on which other sensors are stamped).

    Attributes
    ----------
    period_ns : after which the sensor's stamps begin anew, None for never
    offset_ns : computer's minus sensor's time at the start, where packets came fastest
    """

    origin: Literal["sensor", "start", "computer"]
    offset_ns: int
    period_ns: int | None

    def __str__(self) -> str:
        unit = "since the top of the hour" if self.period_ns else "in ns"
        side = "behind" if self.offset_ns > 0 else "ahead of"
        meaning = {
            "sensor": "the sensor's clock, which is set and counts",
            "start": "the sensor's clock, put at the computer's time at the start",
            "computer": "the sensor's clock, put at the computer's time and kept there",
        }[self.origin]
        return (
            f"time per point from the packets ({unit}): {meaning}; it is "
            f"{abs(self.offset_ns) / 1e9:.6f} s {side} the computer's"
        )


def decide(
    pairs: Sequence[tuple[int, int]], period_ns: int | None, *, is_alone: bool
) -> ClockReading:
    """Return what the stamps mean, from the first packets' (sensor's, computer's time in ns).

    Parameters
    ----------
    period_ns : after which the sensor's stamps begin anew
    is_alone : nothing else in the recording has a clock
    """
    first = _wrapped(pairs[0][1] - pairs[0][0], 0, period_ns)
    offset_ns = min(_wrapped(host - sensor, first, period_ns) for sensor, host in pairs)
    if not is_alone:
        return ClockReading("computer", offset_ns, period_ns)
    is_set = abs(offset_ns) <= MAX_SYNCHRONIZED_NS
    return ClockReading("sensor" if is_set else "start", offset_ns, period_ns)


def _wrapped(difference_ns: int, near_ns: int, period_ns: int | None) -> int:
    """Return the difference that is nearest to `near_ns`, periods apart."""
    if period_ns is None:
        return difference_ns
    half = period_ns // 2
    return (difference_ns - near_ns + half) % period_ns - half + near_ns


class PacketClock:
    """The clock of one sensor during one pass over the recording, for all its streams."""

    def __init__(self, reading: ClockReading) -> None:
        self._reading = reading
        self._offset_ns = float(reading.offset_ns)
        self._target_ns = self._offset_ns
        self._window: tuple[int, int] | None = None  # its end, and the smallest difference in it
        self._last_ns: int | None = None

    def stamp_ns(self, sensor_ns: int, host_ns: int) -> int:
        """Return the absolute stamp in ns of a sensor's stamp received at `host_ns`."""
        continued = self._continued(sensor_ns, host_ns)
        return continued if self._reading.origin == "sensor" else continued + round(self._offset_ns)

    def observe(self, sensor_ns: int, host_ns: int) -> None:
        """Let the clock follow the computer's, where it is meant to."""
        if self._reading.origin != "computer":
            return
        continued = self._continued(sensor_ns, host_ns)
        difference = host_ns - continued
        end, smallest = self._window or (host_ns + WINDOW_NS, difference)
        self._window = (end, min(smallest, difference))
        if host_ns >= end:
            self._target_ns, self._window = float(self._window[1]), None
        if self._last_ns is not None:
            limit = MAX_DRIFT * max(0, min(continued - self._last_ns, WINDOW_NS))
            self._offset_ns += min(limit, max(-limit, self._target_ns - self._offset_ns))
        self._last_ns = continued

    def _continued(self, sensor_ns: int, host_ns: int) -> int:
        """Return the sensor's stamp with the periods that the computer's time says have passed."""
        period_ns = self._reading.period_ns
        if period_ns is None:
            return sensor_ns
        elapsed_ns = host_ns - round(self._offset_ns) - sensor_ns
        return sensor_ns + period_ns * ((elapsed_ns + period_ns // 2) // period_ns)
