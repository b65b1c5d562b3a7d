# SPDX-License-Identifier: MIT OR Apache-2.0
"""The time scale of LAS files: adjusted standard GPS time, GPS seconds minus one billion."""

from __future__ import annotations

from bisect import bisect_right

_GPS_EPOCH_UNIX = 315_964_800  # 1980-01-06 00:00 UTC
_ADJUSTMENT = 1_000_000_000
_NS = 1_000_000_000

# Unix time at which UTC fell one more second behind GPS time (IERS Bulletin C); the next leap
# second would have to be added here, none is announced.
_LEAP_SECONDS = (
    362793600, 394329600, 425865600, 489024000, 567993600, 631152000,
    662688000, 709948800, 741484800, 773020800, 820454400, 867715200,
    915148800, 1136073600, 1230768000, 1341100800, 1435708800, 1483228800,
)  # fmt: skip


def adjusted_gps_origin(clock_origin_ns: int) -> float:
    """Return the adjusted standard GPS time, s, of an absolute stamp in ns UTC.

    Adding seconds since the recording's start to it gives stamps in steps of 60 ns.
    """
    leap = bisect_right(_LEAP_SECONDS, clock_origin_ns // _NS)
    whole_ns = clock_origin_ns + (leap - _GPS_EPOCH_UNIX - _ADJUSTMENT) * _NS
    return whole_ns / _NS
