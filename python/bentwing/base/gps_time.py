# SPDX-License-Identifier: MIT OR Apache-2.0
"""GPS time, which has no leap seconds, and UTC, which has them."""

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


def utc_of_gps_ns(gps_ns: int) -> int:
    """Return the stamp in ns UTC of ns since the GPS epoch, 1980-01-06 00:00 UTC.

    Within the second of a leap the earlier of two is returned.
    """
    unix_ns = gps_ns + _GPS_EPOCH_UNIX * _NS
    inserted = [at + k for k, at in enumerate(_LEAP_SECONDS, start=1)]
    return unix_ns - bisect_right(inserted, unix_ns // _NS) * _NS


def leap_seconds(utc_ns: int) -> int:
    """Return by how many seconds GPS time is ahead of UTC at a stamp in ns UTC."""
    return bisect_right(_LEAP_SECONDS, utc_ns // _NS)


def gps_ns_of_date(unix_ns: int) -> int:
    """Return ns since the GPS epoch of a calendar date and time of the GPS time scale.

    Parameters
    ----------
    unix_ns : what the date would be, in ns since 1970, if it were of UTC
    """
    return unix_ns - _GPS_EPOCH_UNIX * _NS


def adjusted_gps_origin(clock_origin_ns: int) -> float:
    """Return the adjusted standard GPS time of LAS files (GPS seconds minus 1e9), s, of a stamp in ns UTC.

    Adding seconds since the recording's start to it gives stamps in steps of 60 ns.
    """
    whole_ns = (
        clock_origin_ns + (leap_seconds(clock_origin_ns) - _GPS_EPOCH_UNIX - _ADJUSTMENT) * _NS
    )
    return whole_ns / _NS
