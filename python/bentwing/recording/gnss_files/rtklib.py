# SPDX-License-Identifier: MIT OR Apache-2.0
"""Solutions of RTKLIB (.pos): latitude, longitude and height with quality and standard deviations."""

from __future__ import annotations

import math
from datetime import datetime, timezone
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import InputError
from bentwing.base.gps_time import gps_ns_of_date, leap_seconds, utc_of_gps_ns
from bentwing.recording.gnss_files.file_fix import BadLineError, FileFix

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.recording.gnss_files.names import FixQuality, TimeScale

_NS = 10**9
_LATEST = 2**62  # ns; beyond it differences of stamps overflow
_WEEK = 7 * 86_400
_QUALITIES: dict[int, FixQuality] = {
    1: "fixed", 2: "float", 3: "differential", 4: "differential", 5: "single", 6: "ppp",
}  # fmt: skip
_SCALES: dict[str, TimeScale] = {"GPST": "gps", "UTC": "utc"}
_NEEDED = 5  # latitude, longitude, height, quality and satellites
_STATED = 6  # sdn, sde, sdu, sdne, sdeu, sdun


def is_rtklib(lines: Iterable[str]) -> bool:
    """Whether lines are the beginning of a solution of RTKLIB."""
    return any(
        line.startswith("%") and ("latitude" in line or "-ecef" in line or "baseline" in line)
        for line in lines
    )


def read_rtklib(
    path: Path, lines: Iterable[str], scale: TimeScale | None, counts: Counter[str]
) -> Iterator[FileFix]:
    """Read the fixes of a solution.

    Parameters
    ----------
    scale : time scale; None for that which the header names
    counts : gets what is left out

    Raises
    ------
    InputError
        If the solution is in other coordinates, or nothing names the time scale.
    """
    for line in lines:
        if line.startswith("%"):
            scale = _of_header(path, line, scale)
            continue
        words = line.replace(",", " ").split()
        if not words:
            continue
        counts["messages"] += 1
        if scale is None:
            msg = f"{path}: its header does not name the time scale (GPST or UTC); say it with --gnss-time"
            raise InputError(msg)
        try:
            fix = _fix(words, scale)
        except (BadLineError, ValueError, OverflowError):
            counts["broken_messages"] += 1
            continue
        if fix is None:
            counts["no_fix"] += 1
            continue
        if scale == "gps":
            counts["leap_seconds"] = leap_seconds(fix.stamp_ns)
        yield fix


def _of_header(path: Path, line: str, scale: TimeScale | None) -> TimeScale | None:
    """Return the time scale after a line of the header; refuse other coordinates."""
    if "-ecef" in line or "baseline" in line or "latitude(d'" in line:
        msg = (
            f"{path}: has no latitudes and longitudes in degrees; let RTKLIB write them "
            "(out-solformat = llh, out-degform = deg)"
        )
        raise InputError(msg)
    if "latitude" not in line or scale is not None:
        return scale
    name = line[1:].split()[0].rstrip(",").upper()
    return _SCALES.get(name)


def _fix(words: list[str], scale: TimeScale) -> FileFix | None:
    numbers = [float(word) for word in words[2:]]
    if len(numbers) < _NEEDED or not all(map(math.isfinite, numbers)):
        msg = "too few numbers"
        raise BadLineError(msg)
    stamp = _stamp_ns(words[0], words[1], scale)
    if abs(stamp) > _LATEST:
        msg = "no date"
        raise BadLineError(msg)
    latitude, longitude, height, quality = numbers[:4]
    if abs(latitude) > 90 or abs(longitude) > 360 or int(quality) not in _QUALITIES:
        return None
    stated = numbers[_NEEDED : _NEEDED + _STATED]
    covariance = _covariance(stated) if len(stated) == _STATED and all(stated[:3]) else None
    place = (longitude, latitude, height)
    return FileFix(stamp, place, _QUALITIES[int(quality)], covariance)


def _stamp_ns(first: str, second: str, scale: TimeScale) -> int:
    """Return ns UTC of a date and a time, or of GPS week and second."""
    if "/" in first:
        hours, minutes, seconds = second.split(":")
        day = datetime.strptime(first, "%Y/%m/%d").replace(tzinfo=timezone.utc)
        whole = int(day.timestamp()) + 3600 * int(hours) + 60 * int(minutes)
        unix_ns = whole * _NS + _ns(seconds)
        return unix_ns if scale == "utc" else utc_of_gps_ns(gps_ns_of_date(unix_ns))
    return utc_of_gps_ns(int(first) * _WEEK * _NS + _ns(second))


def _ns(seconds: str) -> int:
    """Return decimal seconds in ns, without the rounding of a float."""
    whole, _, part = seconds.partition(".")
    return int(whole) * _NS + int(part[:9].ljust(9, "0") or 0)


def _covariance(stated: list[float]) -> NDArray[np.float64]:
    """Return (3, 3) m², east, north, up; off the diagonal RTKLIB has roots with the sign of the product."""
    north, east, up, north_east, east_up, up_north = (math.copysign(s * s, s) for s in stated)
    return np.array(
        [
            [abs(east), north_east, east_up],
            [north_east, abs(north), up_north],
            [east_up, up_north, abs(up)],
        ]
    )
