# SPDX-License-Identifier: MIT OR Apache-2.0
"""Sentences of receivers (NMEA 0183): GGA for places, GST for their accuracy, RMC and ZDA for the date."""

from __future__ import annotations

import math
from datetime import date
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bentwing.recording.gnss_files.file_fix import BadLineError, FileFix

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from bentwing.recording.gnss_files.names import FixQuality

_DAY = 86_400 * 10**9  # ns
_EPOCH = date(1970, 1, 1).toordinal()
# Of GGA; dead reckoning, positions put in by hand and simulations are none.
_QUALITIES: dict[str, FixQuality] = {
    "1": "single", "2": "differential", "3": "single", "4": "fixed", "5": "float", "9": "differential",
}  # fmt: skip
_CENTURY = 80  # two-digit years from here on are of the last century


class _Place(NamedTuple):
    """A GGA: time of day in ns, where, and how good."""

    day_ns: int
    place: tuple[float, float, float]
    quality: FixQuality


def is_nmea(lines: Iterable[str]) -> bool:
    """Whether lines are sentences of a receiver."""
    return any(line.startswith("$") and line[3:6] in {"GGA", "RMC", "GST", "ZDA"} for line in lines)


def read_nmea(lines: Iterable[str], near_ns: int, counts: Counter[str]) -> Iterator[FileFix]:
    """Read the fixes of a log; times are UTC.

    Parameters
    ----------
    near_ns : ns UTC; the day of a log without dates is that which is nearest to it
    counts : gets what is left out
    """
    places: list[_Place] = []
    accuracies: dict[int, NDArray[np.float64]] = {}
    dates: list[tuple[int, int]] = []  # how many places stand before, and ns UTC
    for line in lines:
        kind = line[3:6]
        if not line.startswith("$") or kind not in {"GGA", "GST", "RMC", "ZDA"}:
            continue
        counts["messages"] += kind == "GGA"
        try:
            words = _checked(line)
            if kind == "GGA":
                found = _place(words, counts)
                places += [] if found is None else [found]
            elif kind == "GST" and all(words[6:9]):
                north, east, up = (float(word) for word in words[6:9])
                accuracies[_day_ns(words[1])] = np.diag(np.square([east, north, up]))
            elif (moment := _moment(kind, words)) is not None:
                dates.append((len(places), moment))
        except (BadLineError, ValueError, IndexError):
            counts["broken_messages"] += 1
    yield from _dated(places, accuracies, dates or [(0, near_ns)])


def _dated(
    places: list[_Place], accuracies: dict[int, NDArray[np.float64]], dates: list[tuple[int, int]]
) -> Iterator[FileFix]:
    """Give places the day that puts them nearest to the date told last, or first."""
    told = 0
    for number, (day_ns, place, quality) in enumerate(places):
        while told + 1 < len(dates) and dates[told + 1][0] <= number:
            told += 1
        near = dates[told][1]
        stamp = round((near - day_ns) / _DAY) * _DAY + day_ns
        covariance = accuracies.get(day_ns)
        if covariance is not None:
            variances = np.diag(covariance)
            covariance = covariance if ((variances > 0) & (variances < np.inf)).all() else None
        yield FileFix(stamp, place, quality, covariance)


def _place(words: list[str], counts: Counter[str]) -> _Place | None:
    if words[6] not in _QUALITIES or not words[2] or not words[4]:
        counts["no_fix"] += 1
        return None
    if (
        not words[9] or not words[11]
    ):  # the height above the geoid alone says nothing of the ellipsoid
        counts["no_geoid_separation"] += 1
        return None
    latitude = _degrees(words[2], 2) * (-1.0 if words[3] == "S" else 1.0)
    longitude = _degrees(words[4], 3) * (-1.0 if words[5] == "W" else 1.0)
    height = float(words[9]) + float(words[11])
    if not all(map(math.isfinite, (latitude, longitude, height))) or abs(latitude) > 90:
        counts["no_fix"] += 1
        return None
    return _Place(_day_ns(words[1]), (longitude, latitude, height), _QUALITIES[words[6]])


def _checked(line: str) -> list[str]:
    """Return the words of a sentence whose sum is right, or that has none."""
    body, star, stated = line.strip()[1:].partition("*")
    total = 0
    for letter in body.encode("ascii", "replace"):
        total ^= letter
    if star and int(stated[:2], 16) != total:
        msg = f"its sum is {total:02X}"
        raise BadLineError(msg)
    return body.split(",")


def _degrees(word: str, n: int) -> float:
    """Return degrees of DDMM.MMMM, with `n` digits of degrees."""
    return float(word[:n]) + float(word[n:]) / 60.0


def _day_ns(word: str) -> int:
    """Return ns since midnight of HHMMSS.SS."""
    whole, _, part = word.partition(".")
    seconds = 3600 * int(whole[:2]) + 60 * int(whole[2:4]) + int(whole[4:6])
    return seconds * 10**9 + int(part[:9].ljust(9, "0"))


def _moment(kind: str, words: list[str]) -> int | None:
    """Return ns UTC of a sentence with a date; None where that is empty."""
    if kind == "RMC":
        if not words[9] or not words[1]:
            return None
        day, month, year = (int(words[9][k : k + 2]) for k in (0, 2, 4))
        year += 1900 if year >= _CENTURY else 2000
    else:
        if not all(words[1:5]):
            return None
        day, month, year = (int(word) for word in words[2:5])
    return (date(year, month, day).toordinal() - _EPOCH) * _DAY + _day_ns(words[1])
