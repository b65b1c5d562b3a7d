# SPDX-License-Identifier: MIT OR Apache-2.0
"""Decide what a cloud's time field means: its unit, and what it counts from.

Drivers agree on neither. The decision is made once per recording from the type of the field and
the values of a cloud: the reading whose sweep lasts nearest to the period of the messages wins.
Units differ by factors of 1000, sweeps and periods by less than 10, so there is no doubt.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

NAMES = ("t", "time", "timestamp", "offset_time", "time_offset", "time_stamp", "ts", "timeoffset")
UNITS_NS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1}
MAX_OFFSET = 1.0  # s, of a point from its header
MAX_CLOCK_DIFFERENCE = 60.0  # s, of absolute times from the header on the same clock
MIN_SPAN, MAX_SPAN = 2e-4, 1.0  # s, of a sweep
DEFAULT_PERIOD = 0.1  # s, where the period of the messages is unknown

Origin = Literal["header", "epoch", "sensor"]


@dataclass(frozen=True, slots=True)
class TimeReading:
    """How to read the time field `name`.

    `origin`: "header" (relative to the message's stamp), "epoch" (absolute, the stamp's clock) or
    "sensor" (absolute on another clock: the sweep's first point is put at the stamp).
    """

    name: str
    dtype: str
    unit: str
    origin: Origin
    first: float = 0.0
    last: float = 0.0

    def __str__(self) -> str:
        origin = {
            "header": "relative to the header stamp",
            "epoch": "absolute on the header's clock",
            "sensor": "absolute on another clock than the header's, aligned at the first point",
        }[self.origin]
        return (
            f"time per point from field '{self.name}' ({self.dtype}): {self.unit}, {origin}, "
            f"from {self.first * 1e3:+.1f} to {self.last * 1e3:+.1f} ms in the first cloud"
        )

    def offsets(self, values: NDArray[np.generic], stamp_ns: int) -> NDArray[np.float64]:
        """Return (N,) s relative to the header stamp; NaN where a value is not a number."""
        unit_ns = UNITS_NS[self.unit]
        if self.origin == "epoch":
            return _since_stamp(values, stamp_ns, unit_ns)
        if self.origin == "sensor" and values.size:
            # Subtracted in the field's own type, where integers of 64 bits keep their digits.
            values = np.subtract(values, np.nanmin(values))
        return np.asarray(values, dtype=np.float64) * (unit_ns * 1e-9)


def decide(
    name: str, values: NDArray[np.generic], stamp_ns: int, period: float | None
) -> TimeReading | None:
    """Return how to read a time field, or None if its values do not tell points apart.

    Parameters
    ----------
    name : of the field, for messages
    values : (N,) integer or floating, of the valid points of one cloud
    stamp_ns : header stamp of the cloud
    period : s between clouds, where known
    """
    values = values[np.isfinite(values)]
    if values.size < 2 or values.min() == values.max():
        return None
    target = period or DEFAULT_PERIOD
    best: tuple[float, TimeReading] | None = None
    for unit in ("ns", "us", "ms", "s"):
        reading = _reading(name, values, stamp_ns, unit)
        span = reading.last - reading.first
        if MIN_SPAN <= span <= MAX_SPAN:
            mismatch = abs(math.log(span / target))
            if best is None or mismatch < best[0]:
                best = (mismatch, reading)
    return None if best is None else best[1]


def _reading(name: str, values: NDArray[np.generic], stamp_ns: int, unit: str) -> TimeReading:
    """Return the reading of the field in one unit, its origin from where the values lie."""
    limits: dict[Origin, float] = {"header": MAX_OFFSET, "epoch": MAX_CLOCK_DIFFERENCE}
    fitting = []
    for origin, limit in limits.items():
        reading = _with_ends(TimeReading(name, values.dtype.name, unit, origin), values, stamp_ns)
        distance = max(abs(reading.first), abs(reading.last))
        if distance <= limit:
            fitting.append((distance, reading))
    if fitting:
        # Both fit where the clock itself starts near zero, as in simulations.
        return min(fitting, key=lambda pair: pair[0])[1]
    return _with_ends(TimeReading(name, values.dtype.name, unit, "sensor"), values, stamp_ns)


def _with_ends(reading: TimeReading, values: NDArray[np.generic], stamp_ns: int) -> TimeReading:
    offsets = reading.offsets(values, stamp_ns)
    return replace(reading, first=float(offsets.min()), last=float(offsets.max()))


def _since_stamp(values: NDArray[np.generic], stamp_ns: int, unit_ns: int) -> NDArray[np.float64]:
    """Subtract the stamp where it costs no digits: in integers, or in whole and rest units."""
    whole, rest_ns = divmod(stamp_ns, unit_ns)
    if np.issubdtype(values.dtype, np.integer):
        difference = (values.astype(np.int64) - np.int64(whole)).astype(np.float64)
    else:
        difference = values.astype(np.float64) - float(whole)
    return difference * (unit_ns * 1e-9) - rest_ns * 1e-9
