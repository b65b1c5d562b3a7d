# SPDX-License-Identifier: MIT OR Apache-2.0
"""Decide what a cloud's time field means: its unit, and what it counts from.

Drivers agree on neither. The decision is made once per recording from the type of the field and
the values of a cloud: the reading whose sweep lasts nearest to the period of the messages wins.
Units differ by factors of 1000, sweeps and periods by less than 10, so there is no doubt.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol

import numpy as np

from bentwing.base.errors import PayloadError
from bentwing.recording.sweep_stamps import SINCE, WORDS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.recording.sections.lidar import Lidar, TimeReference, TimeUnit

NAMES = ("t", "time", "timestamp", "offset_time", "time_offset", "time_stamp", "ts", "timeoffset")
UNITS_NS: dict[TimeUnit, int] = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1}
MAX_OFFSET = 1.0  # s, of a point from its header
MAX_CLOCK_DIFFERENCE = 60.0  # s, of absolute times from the header on the same clock
MIN_SPAN, MAX_SPAN = 2e-4, 1.0  # s, of a sweep
MOSTLY = 0.8  # of a period, that the points of a sweep fill which lasts as long
DEFAULT_PERIOD = 0.1  # s, where the period of the messages is unknown

Origin = Literal["header", "epoch", "sensor"]
LIMITS: dict[Origin, float] = {"header": MAX_OFFSET, "epoch": MAX_CLOCK_DIFFERENCE}
_ORIGINS: dict[TimeReference | None, tuple[Origin, ...]] = {
    None: ("header", "epoch"),
    "absolute": ("epoch",),
    # Of the stamp, which a field that is absolute itself does not need then.
    **dict.fromkeys(("start", "middle", "end"), ("header",)),
}


class Reading(Protocol):
    """How points get their times, by a field or by where the lidar looked."""

    @property
    def first(self) -> float:
        """Of a sweep's first point, s after the stamp."""


class GivenTimes(NamedTuple):
    """What the payload says of the points' times; None for what is to be found."""

    field: str | None = None
    unit: TimeUnit | None = None
    reference: TimeReference | None = None

    @classmethod
    def of(cls, lidar: Lidar) -> GivenTimes:
        """Return what a payload's section says."""
        return cls(lidar.time_field, lidar.time_unit, lidar.time_reference)

    def refuse(self, messages: str, *keys: str) -> None:
        """Refuse keys that say nothing to some messages.

        Raises
        ------
        PayloadError
        """
        values = dict(zip(("time_field", "time_unit", "time_reference"), self, strict=True))
        given = [f"lidar.{key}" for key in keys if values[key] is not None]
        if given:
            msg = f"the payload gives {' and '.join(given)}, but the messages of the lidar {messages}: leave it out"
            raise PayloadError(msg)


NOTHING_GIVEN = GivenTimes()


@dataclass(frozen=True, slots=True)
class TimeReading:
    """How to read the time field `name`.

    `origin`: "header" (relative to the message's stamp), "epoch" (absolute, the stamp's clock) or
    "sensor" (absolute on another clock: the sweep's first point is put at the stamp). `first` and
    `last` are those of a cloud, s after the stamp. `shift`, s, is added for the `reference` that the
    payload gives.
    """

    name: str
    dtype: str
    unit: TimeUnit
    origin: Origin
    first: float = 0.0
    last: float = 0.0
    shift: float = 0.0
    reference: TimeReference | None = None

    def __str__(self) -> str:
        origin = {
            "header": "relative to the header stamp",
            "epoch": "absolute on the header's clock",
            "sensor": "absolute on another clock than the header's, aligned at the first point",
        }[self.origin]
        if self.reference is not None and self.reference != "absolute":
            origin += f", the stamp is that of the {WORDS[self.reference]} as the payload says"
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
        offsets = np.asarray(values, dtype=np.float64) * (unit_ns * 1e-9)
        return offsets + self.shift if self.shift else offsets

    def referred(self, reference: TimeReference, period: float | None) -> TimeReading:
        """Return the same with the moment of a sweep that its stamp is said to be."""
        if reference == "absolute":
            return replace(self, reference=reference)
        length = self.last - self.first
        if period is not None and MOSTLY * period <= length <= period:
            length = period  # of which the beginning and the end gave no return
        counts_from_start = abs(self.first) <= abs(self.last)
        shift = (0.0 if counts_from_start else length) - SINCE[reference] * length
        first, last = self.first + shift, self.last + shift
        return replace(self, first=first, last=last, shift=shift, reference=reference)


def decide(
    name: str,
    values: NDArray[np.generic],
    stamp_ns: int,
    period: float | None,
    given: GivenTimes = NOTHING_GIVEN,
) -> TimeReading | None:
    """Return how to read a time field, or None if its values do not tell points apart.

    Parameters
    ----------
    name : of the field, for messages
    values : (N,) integer or floating, of the valid points of one cloud
    stamp_ns : header stamp of the cloud
    period : s between clouds, where known
    given : what the payload says, which holds
    """
    values = values[np.isfinite(values)]
    if values.size < 2 or values.min() == values.max():
        return None
    target = period or DEFAULT_PERIOD
    best: tuple[float, TimeReading] | None = None
    units: Sequence[TimeUnit] = ("ns", "us", "ms", "s") if given.unit is None else (given.unit,)
    for unit in units:
        reading = _reading(name, values, stamp_ns, unit, _ORIGINS[given.reference])
        span = reading.last - reading.first
        if MIN_SPAN <= span <= MAX_SPAN:
            mismatch = abs(math.log(span / target))
            if best is None or mismatch < best[0]:
                best = (mismatch, reading)
    if best is None:
        return None
    return best[1] if given.reference is None else best[1].referred(given.reference, period)


def _reading(
    name: str,
    values: NDArray[np.generic],
    stamp_ns: int,
    unit: TimeUnit,
    origins: Sequence[Origin],
) -> TimeReading:
    """Return the reading of the field in one unit, its origin from where the values lie."""
    fitting = []
    for origin in origins:
        limit = LIMITS[origin]
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
